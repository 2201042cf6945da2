"""What a command line draws, as a scene: the short forms of forces, and the flags of `wfluid animate`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from wfluid.output import numbering
from wfluid.point_file import read_points
from wfluid.scene import Scene
from wfluid.scene_format import FORCES, VERSION
from wfluid.schema import SchemaError, checked

FORMS = {
    "push": ("X,Y:DX,DY", "center", "by"),
    "vortex": ("X,Y:DEGREES", "center", "turn"),
    "grow": ("X,Y:FACTOR", "center", "factor"),
    "stroke": ("X,Y/X,Y/…", "points"),
    "wind": ("DX,DY", "by"),
    "noise": ("PIXELS", "amount"),
    "image": ("FILE", "file"),
    "ink": ("X,Y:#RRGGBB", "center", "color"),
    "smoke": ("X,Y:#RRGGBB", "center", "color"),
}
"""By kind: how it is written, and the keys of what comes before the options."""

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

_DENSITY_KEYS = ("diffusion", "lift")
"""Keys of a poured density that are not its source's."""

_SOURCE_KEYS = ("radius", "amount", "start", "end", "at", "rise", "fall", "strength")

_UNWRITTEN = ("path", "envelope", "points", "name", "group")
"""Keys that have no short form."""


def parse_force(kind: str, text: str) -> dict[str, Any]:
    """The table of a force from its short form, such as push "X,Y:DX,DY:key=value,…".

    Raises:
        ValueError: naming the part that is wrong.
    """
    what = f"{kind} {text!r}"
    _, *positional = FORMS[kind]
    keys = [key for key in FORCES[kind].keys if key not in (*positional, *_UNWRITTEN)]
    table = _parsed(kind, text, keys)
    try:
        return {"kind": kind, **checked(FORCES[kind], table)}
    except SchemaError as error:
        raise ValueError(f"{what}: {error}") from None


def parse_density(look: str, text: str, name: str) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """The table of a density poured at a point, and that of its buoyancy, from "X,Y:#RRGGBB:key=value,…".

    `lift` is how far its own buoyancy carries it upwards where it is 1 [px].

    Raises:
        ValueError: naming the part that is wrong.
    """
    source = _parsed(look, text, [*_SOURCE_KEYS, *_DENSITY_KEYS])
    density = {"name": name, "color": source.pop("color"), "look": look}
    if "diffusion" in source:
        density["diffusion"] = source.pop("diffusion")
    lift = source.pop("lift", None)
    density["source"] = [source]
    if lift is None:
        return density, None
    return density, {"kind": "buoyancy", "density": name, "by": [0.0, -lift]}


def _parsed(kind: str, text: str, keys: list[str]) -> dict[str, Any]:
    """The parts of a short form, by key."""
    what, (form, *positional) = f"{kind} {text!r}", FORMS[kind]
    if kind == "image":
        name, colon, options = text.rpartition(":")
        parts = [name, options] if colon and "=" in options else [text]
    else:
        parts = text.split(":")
    if len(parts) not in (len(positional), len(positional) + 1):
        raise ValueError(f"{what}: expected {form} or {form}:key=value,…")
    table = {key: _part(what, key, part) for key, part in zip(positional, parts, strict=False)}
    if len(parts) > len(positional):
        table |= _options(what, parts[-1], keys)
    return table


def _part(what: str, key: str, part: str) -> Any:
    if key in ("file", "color"):
        return part
    if key == "points":
        return [_pair(what, "a point X,Y", point) for point in part.split("/")]
    if key == "center":
        return _pair(what, "the point X,Y", part)
    return _pair(what, "the arrow DX,DY", part) if key == "by" else _number(what, key, part)


def _options(what: str, text: str, keys: list[str]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for item in text.split(","):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or key not in keys:
            raise ValueError(f"{what}: {item!r} is not key=value with a key of {', '.join(keys)}")
        if key in options:
            raise ValueError(f"{what}: {key} is given twice")
        options[key] = _option(what, key, value)
    return options


def _option(what: str, key: str, value: str) -> Any:
    if key in ("mask", "along"):
        return value
    return int(value) if key == "seed" and value.isdecimal() else _number(what, key, value)


def _pair(what: str, name: str, part: str) -> list[float]:
    numbers = part.split(",")
    if len(numbers) != 2:
        raise ValueError(f"{what}: {name} needs two numbers, got {part!r}")
    return [_number(what, name, number) for number in numbers]


def _number(what: str, name: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        raise ValueError(f"{what}: {name}: {part!r} is not a number") from None
    if value - value != 0:
        raise ValueError(f"{what}: {name}: {part} is not finite")
    return value


def scene_of(options: argparse.Namespace) -> Scene:
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
            "points": [_pair(f"track {text!r}", "the point X,Y", text) for text in options.track]
        }
    tables["output"] = _outputs(options)
    given = {key: value for key, value in tables.items() if value}
    return Scene(given, source="command line", flags=flags)


def parse_move(text: str) -> dict[str, Any]:
    """The table of a move from its short form, "X0,Y0:X1,Y1" or "X0,Y0:X1,Y1@SECONDS".

    Raises:
        ValueError: naming the part that is wrong.
    """
    what = f"move {text!r}"
    places, at, time = text.partition("@")
    parts = places.split(":")
    if len(parts) != 2:
        raise ValueError(f"{what}: expected X0,Y0:X1,Y1 or X0,Y0:X1,Y1@SECONDS")
    start, end = (_pair(what, "a point X,Y", part) for part in parts)
    return {"from": start, "to": end, **({"time": _number(what, "time", time)} if at else {})}


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
        table["pins"] = [_pair(f"pin {text!r}", "the point X,Y", text) for text in options.pin]
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
    return [_number(what, "a key", part) for part in parts]


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
