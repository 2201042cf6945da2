"""The scene of a command line of animate, keyframes or morph."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wfluid.cli.flags import DENSITIES, KEYFRAME_TIME, drawn_flag, flag_name, scene_tables
from wfluid.domain.limits import KEYFRAME_VISCOSITY
from wfluid.files.names import numbering
from wfluid.files.points import read_points
from wfluid.scene.format import SCENE, VERSION
from wfluid.scene.scene import COMMAND_LINE, Scene
from wfluid.scene.schema import ArrayOf, Key, Table
from wfluid.scene.short_forms import FORMS, as_pair, parse_density, parse_move, read_force


def scene_of_options(options: argparse.Namespace) -> Scene:
    """The scene of a command line.

    Raises:
        ValueError: a flag with a wrong value; the message names the flag.
        SceneError: a value outside its range.
    """
    tables: dict[str, Any] = {"wfluid": VERSION, **given_keys(options, SCENE)}
    tables["picture"] = {"file": options.picture}
    for name, table in scene_tables().items():
        if name not in ("keyframes", "morph"):
            tables[name] = {**tables.get(name, {}), **given_keys(options, table)}
    _check_viscosity(options)
    if options.verb == "keyframes" and not {"value", "image"} & tables["viscosity"].keys():
        tables["viscosity"]["value"] = KEYFRAME_VISCOSITY
    if options.freeze is not None:
        tables["freeze"] = dict(zip(("mask", "strength"), _mask_and_number(options.freeze), strict=False))
    flags: dict[tuple, str] = {("freeze",): "--freeze"}
    tables["force"], tables["density"] = [], []
    _add_drawn(options, tables, flags)
    if options.verb == "morph":
        tables["morph"] = _morph(options)
    if options.verb in ("keyframes", "morph"):
        tables["keyframes"], names = _keyframes(options)
        flags |= {("keyframes", "move", n): name for n, name in enumerate(names)}
    layers = _several(options, "layer")
    tables["layer"] = [{"name": _layer_name(file), "file": file} for file in layers]
    flags |= {("layer", n): f"--layer {file}" for n, file in enumerate(layers)}
    points = [as_pair(f"track {text!r}", "the point X,Y", text) for text in _several(options, "track")]
    tables["tracks"] = {"points": points} if points else {}
    tables["output"] = _outputs(options)
    given = {key: value for key, value in tables.items() if value}
    return Scene(given, source=COMMAND_LINE, flags={**dict(_flags(SCENE, given)), **flags})


def _flags(what: Any, value: Any, path: tuple = ()) -> Iterator[tuple[tuple, str]]:
    """The flag, or the form, that sets a key, by the path of the key."""
    if isinstance(what, Key):
        if what.flag or what.form:
            yield path, what.flag or what.form
    elif isinstance(what, Table):
        for name, inner in what.keys.items():
            yield from _flags(inner, value.get(name, {}), (*path, name))
    elif isinstance(what, ArrayOf):
        for n, item in enumerate(value):
            yield from _flags(what.each, item, (*path, n))


def given_keys(options: argparse.Namespace, table: Table) -> dict[str, Any]:
    """The keys of a table whose flags are given."""
    found = {}
    for name, key in table.keys.items():
        if not isinstance(key, Key) or not key.flag:
            continue
        value = getattr(options, flag_name(key.flag), None)
        if value is not None:
            found[name] = _read(key, value) if isinstance(value, str) else value
    return found


def _read(key: Key, text: str) -> Any:
    """The value of a key from a text.

    Raises:
        ValueError: a wrong text; the message names the flag.
    """
    try:
        return key.kind.read(text)
    except ValueError as error:
        raise ValueError(f"{key.flag} {text!r}: {error}") from None


def _several(options: argparse.Namespace, name: str) -> list[str]:
    """The values of a repeatable flag; none if the command does not have it."""
    return getattr(options, name, [])


def _add_drawn(options: argparse.Namespace, tables: dict[str, Any], flags: dict[tuple, str]) -> None:
    """Add the forces and densities of short forms, and the flag of each."""
    forces, densities = tables["force"], tables["density"]
    for kind in FORMS:
        flag = drawn_flag(kind)
        for text in _several(options, flag_name(flag)):
            if kind in DENSITIES:
                density, force = parse_density(kind, text, f"{kind} {len(densities) + 1}")
                flags["density", len(densities)] = f"{flag} {text}"
                densities.append(density)
            else:
                force = read_force(kind, text)
            if force:
                flags["force", len(forces)] = f"{flag} {text}"
                forces.append(force)


def _keyframes(options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    """The table of keyframes, with the moves of a file; and the flag of each move."""
    morphs = options.verb == "morph"
    if not (options.move or options.points):
        form = "X0,Y0:X1,Y1" + ("" if morphs else "[@T]")
        raise ValueError(f"no points to move: give at least one --move {form}, or --points FILE.csv")
    moves = [parse_move(text) for text in options.move]
    names = [f"--move {text}" for text in options.move]
    for row in read_points(options.points) if options.points else ():
        moves.append({"from": list(row.source), "to": list(row.target)})
        if row.time is not None:
            moves[-1]["time"] = row.time
        names.append(f"--points {options.points}:{row.line}")
    if not morphs:
        latest = next(time for time in (options.time, options.duration, KEYFRAME_TIME) if time is not None)
        moves = [{**move, "time": move.get("time", latest)} for move in moves]
    table: dict[str, Any] = {"move": moves}
    if options.pin:
        table["pins"] = [as_pair(f"pin {text!r}", "the point X,Y", text) for text in options.pin]
    return {**table, **given_keys(options, scene_tables()["keyframes"])}, names


def _morph(options: argparse.Namespace) -> dict[str, Any]:
    """The table of a morph."""
    table = {"to": options.to, **given_keys(options, scene_tables()["morph"])}
    if options.timing is not None:
        table |= dict(zip(("timing", "delay"), _mask_and_number(options.timing), strict=False))
    return table


def _mask_and_number(text: str) -> tuple[str, float] | tuple[str]:
    """The parts of MASK:NUMBER; of MASK alone, whose name may contain colons, only the mask."""
    name, colon, number = text.rpartition(":")
    try:
        return (name, float(number)) if colon else (text,)
    except ValueError:
        return (text,)


def _check_viscosity(options: argparse.Namespace) -> None:
    """Refuse flags that need a viscosity image without one."""
    if options.viscosity_image is None:
        for flag in ("--viscosity-floor", "--invert-viscosity", "--viscosity-moves"):
            if getattr(options, flag_name(flag)) is not None:
                raise ValueError(f"{flag} needs a --viscosity-image")


def _layer_name(file: str) -> str:
    return Path(file).stem


def _outputs(options: argparse.Namespace) -> list[dict[str, Any]]:
    """The outputs: pictures, each with those of the layers beside it; tracks and report."""
    stills, layers = given_keys(options, scene_tables()["output"]), _several(options, "layer")
    numbered = [name for name in options.output if numbering(Path(name))] or options.output
    found = []
    for name in options.output:
        own = stills if name in numbered else {}  # beside stills a movie goes without their settings
        found.append({"file": name, **own})
        found += [{"file": _beside(name, layer), "of": layer, **own} for layer in map(_layer_name, layers)]
    tracks = getattr(options, "tracks", None)
    for of, file in (("tracks", tracks), ("report", options.report)):
        if file is not None:
            found.append({"file": file, "of": of})
    if bool(_several(options, "track")) != (tracks is not None):
        raise ValueError("--track X,Y and --tracks FILE.csv go together: give both")
    return found


def _beside(output: str, layer: str) -> str:
    """The name of a layer's output: that of the picture, with the layer before number and ending."""
    path = Path(output)
    number = numbering(path)
    stem = path.name[: path.name.index(number)] if number else path.stem
    rest = path.name[len(stem) :]
    base = stem.rstrip("._-")
    return str(path.with_name(f"{base}_{layer}{stem[len(base) :]}{rest}"))
