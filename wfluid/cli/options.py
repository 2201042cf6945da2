"""What a command line draws, as a scene: the short forms of forces, and the flags of `wfluid animate`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from wfluid.files.names import numbering
from wfluid.files.points import read_points
from wfluid.scene.format import VERSION
from wfluid.scene.scene import Scene
from wfluid.scene.short_forms import as_number, as_pair, parse_density, parse_force, parse_move

_FORCE_FLAGS = {
    "push": "push",
    "vortex": "vortex",
    "grow": "grow",
    "stroke": "stroke",
    "wind": "wind",
    "noise": "noise",
    "image": "force_image",
}
"""Kind of force, and the option that holds its texts."""

_OF_FLUID = ("cells", "walls", "scheme", "solver", "pressure_cycles")
_OF_TIME = ("duration", "fps", "substeps", "loop")
_OF_FRAMES = ("width", "scale", "filter", "edge")
_OF_MORPH = ("fit", "warp_curve", "blend_curve", "blend", "reverse", "pingpong")
_OF_STILLS = ("start", "type", "compression", "quality")


def _flags(*places: tuple, keys: tuple[str, ...]) -> dict[tuple, str]:
    return {(*place, key): f"--{key.replace('_', '-')}" for place in places for key in keys}


_FLAGS = {
    ("seed",): "--seed",
    ("picture", "file"): "PICTURE",
    **_flags(("picture",), keys=("colorspace",)),
    **_flags(("fluid",), keys=_OF_FLUID),
    ("viscosity", "value"): "--viscosity",
    ("viscosity", "floor"): "--viscosity-floor",
    ("freeze", "strength"): "--freeze MASK:strength",
    **_flags(("time",), keys=_OF_TIME),
    **_flags(("frames",), keys=_OF_FRAMES),
    ("keyframes", "tolerance"): "--tolerance",
    ("keyframes", "pins"): "--pin",
    ("morph", "to"): "B",
    **_flags(("morph",), keys=_OF_MORPH),
    ("morph", "timing"): "--timing",
    ("morph", "delay"): "--timing MASK:DELAY",
    ("tracks",): "--track",
    **_flags(*(("output", n) for n in range(8)), keys=_OF_STILLS),
}
"""The flags by the keys that they set."""

KEYFRAME_TIME = 1.0
"""When points arrive that no time is given for [s]."""

KEYFRAME_VISCOSITY = 0.005
"""Viscosity where keyframes are on the command line and none is [longer side^2/s]: strains spread wider."""


def scene_of_options(options: argparse.Namespace) -> Scene:
    """The scene of a command line of `wfluid animate`.

    Raises:
        ValueError: a flag that makes no sense, by its name.
        SceneError: a value out of its range.
    """
    tables: dict[str, Any] = {"wfluid": VERSION}
    if options.seed is not None:
        tables["seed"] = options.seed
    tables["picture"] = {"file": options.picture, **_given(options, "colorspace")}
    tables["fluid"] = _given(options, *_OF_FLUID)
    tables["viscosity"] = _viscosity(options)
    if options.freeze is not None:
        tables["freeze"] = _freeze(options.freeze)
    if options.effect_mask is not None:
        tables["effect"] = {"mask": options.effect_mask}
    tables["time"] = _given(options, *_OF_TIME)
    tables["frames"] = _given(options, *_OF_FRAMES)
    tables["force"], tables["density"] = [], []
    flags = dict(_FLAGS)
    for kind, flag in _FORCE_FLAGS.items():
        for text in getattr(options, flag):
            flags["force", len(tables["force"])] = f"--{flag.replace('_', '-')} {text}"
            tables["force"].append(parse_force(kind, text))
    for look in ("ink", "smoke"):
        for text in getattr(options, look):
            density, lift = parse_density(look, text, f"{look} {len(tables['density']) + 1}")
            flags["density", len(tables["density"])] = f"--{look} {text}"
            tables["density"].append(density)
            if lift:
                flags["force", len(tables["force"])] = f"--{look} {text}"
                tables["force"].append(lift)
    if options.verb == "morph":
        tables["morph"] = _morph(options)
    if options.verb in ("keyframes", "morph"):
        tables["keyframes"], names = _keyframes(options)
        flags |= {("keyframes", "move", n): name for n, name in enumerate(names)}
    tables["layer"] = [{"name": _layer_name(file), "file": file} for file in options.layer]
    flags |= {("layer", n): f"--layer {file}" for n, file in enumerate(options.layer)}
    if options.track:
        tables["tracks"] = {
            "points": [as_pair(f"track {text!r}", "the point X,Y", text) for text in options.track]
        }
    tables["output"] = _outputs(options)
    given = {key: value for key, value in tables.items() if value}
    return Scene(given, source="command line", flags=flags)


def _keyframes(options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    """Moves, those of a file among them, and pins; and what of the command line each move comes from."""
    morphs = options.verb == "morph"
    if not (options.move or options.points):
        form = "X0,Y0:X1,Y1" + ("" if morphs else "[@T]")
        raise ValueError(f"where to? give at least one --move {form}, or --points FILE.csv")
    moves = [parse_move(text) for text in options.move]
    names = [f"--move {text}" for text in options.move]
    for row in read_points(options.points) if options.points else ():
        moves.append({"from": list(row.source), "to": list(row.target)})
        if row.time is not None:
            moves[-1]["time"] = row.time
        names.append(f"--points {options.points}:{row.line}")
    latest = next(time for time in (options.time, options.duration, KEYFRAME_TIME) if time is not None)
    timed = moves if morphs else [{**move, "time": move.get("time", latest)} for move in moves]
    table: dict[str, Any] = {"move": timed}
    if options.pin:
        table["pins"] = [as_pair(f"pin {text!r}", "the point X,Y", text) for text in options.pin]
    return {**table, **_given(options, "tolerance")}, names


def _morph(options: argparse.Namespace) -> dict[str, Any]:
    """The other picture, and how it goes."""
    table = {"to": options.to, **_given(options, "fit", "blend")}
    for key in ("warp_curve", "blend_curve"):
        text = getattr(options, key)
        if text is not None:
            what = f"--{key.replace('_', '-')} {text!r}"
            table[key] = [_key(what, part) for part in text.split(",")] if ":" in text else text
    if options.timing is not None:
        name, colon, number = options.timing.rpartition(":")
        try:
            table |= {"timing": name, "delay": float(number)} if colon else {"timing": options.timing}
        except ValueError:
            table["timing"] = options.timing
    return table | {key: True for key in ("reverse", "pingpong") if getattr(options, key)}


def _key(what: str, text: str) -> list[float]:
    """A key of a curve, "S:PART"."""
    parts = text.split(":")
    if len(parts) != 2:
        raise ValueError(f"{what}: {text!r} is not SECONDS:PART")
    return [as_number(what, "a key", part) for part in parts]


def _given(options: argparse.Namespace, *names: str) -> dict[str, Any]:
    """The options that are given, by name."""
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def _viscosity(options: argparse.Namespace) -> dict[str, Any]:
    if options.viscosity_image is None:
        for flag in ("viscosity_floor", "invert_viscosity", "viscosity_moves"):
            if getattr(options, flag) is not None and getattr(options, flag) is not False:
                raise ValueError(f"--{flag.replace('_', '-')} needs a --viscosity-image")
    value = options.viscosity
    if options.verb == "keyframes" and value is None and options.viscosity_image is None:
        value = KEYFRAME_VISCOSITY
    given = {
        "value": value,
        "image": options.viscosity_image,
        "floor": options.viscosity_floor,
        "invert": options.invert_viscosity or None,
        "moves": options.viscosity_moves or None,
    }
    return {key: value for key, value in given.items() if value is not None}


def _freeze(text: str) -> dict[str, Any]:
    """MASK:strength, or a MASK whose name may have colons."""
    name, colon, number = text.rpartition(":")
    try:
        return {"mask": name, "strength": float(number)} if colon else {"mask": text}
    except ValueError:
        return {"mask": text}


def _layer_name(file: str) -> str:
    return Path(file).stem


def _outputs(options: argparse.Namespace) -> list[dict[str, Any]]:
    """The picture's outputs, and beside each those of the layers; tracks and report."""
    stills = _given(options, *_OF_STILLS)
    found = []
    for name in options.output:
        found.append({"file": name, **stills})
        found += [
            {"file": _beside(name, layer), "of": layer, **stills} for layer in map(_layer_name, options.layer)
        ]
    for flag in ("tracks", "report"):
        if getattr(options, flag) is not None:
            found.append({"file": getattr(options, flag), "of": flag})
    if bool(options.track) != (options.tracks is not None):
        raise ValueError("--track X,Y and --tracks FILE.csv go together")
    return found


def _beside(output: str, layer: str) -> str:
    """The name of a layer's output: the picture's, with the layer's name before number and ending."""
    path = Path(output)
    number = numbering(path)
    stem = path.name[: path.name.index(number)] if number else path.stem
    rest = path.name[len(stem) :]
    base = stem.rstrip("._-")
    return str(path.with_name(f"{base}_{layer}{stem[len(base) :]}{rest}"))
