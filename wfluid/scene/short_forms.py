"""Forces, densities and moves in the short form of the command line: `621,451:22,15:period=1`."""

from __future__ import annotations

from typing import Any

from wfluid.scene.checking import checked
from wfluid.scene.forces import FORCES
from wfluid.scene.schema import SchemaError
from wfluid.scene.types import as_number, nearest

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
"""By kind: the form, and the keys of the parts before the options."""

DENSITY_OPTIONS = ("radius", "amount", "start", "end", "at", "rise", "fall", "strength", "diffusion", "lift")
"""Options of the short form of a density: keys of its source and of itself, and `lift`."""

_FILE_ONLY = ("path", "envelope", "points", "name", "group")
"""Keys that only a scene file can have."""


def parse_force(kind: str, text: str) -> dict[str, Any]:
    """The table of a force from its short form, such as push "X,Y:DX,DY:key=value,…".

    Raises:
        ValueError: an unknown kind, or a wrong part; the message names it.
    """
    kinds = [known for known in FORMS if known in FORCES.tables]
    if kind not in kinds:
        raise ValueError(f"kind {kind!r}: expected one of {', '.join(kinds)}{nearest(kind, kinds)}")
    try:
        return checked(FORCES, read_force(kind, text))
    except SchemaError as error:
        raise ValueError(f"{kind} {text!r}: {error}") from None


def read_force(kind: str, text: str) -> dict[str, Any]:
    """The table of a force from its short form; the ranges of its values are not checked yet.

    Raises:
        ValueError: a part that cannot be read; the message names it.
    """
    return {"kind": kind, **_parsed(kind, text, force_options(kind))}


def force_options(kind: str) -> list[str]:
    """Options of the short form of a force, each written key=value."""
    _, *positional = FORMS[kind]
    return [key for key in FORCES.tables[kind].keys if key not in (*positional, *_FILE_ONLY)]


def parse_density(look: str, text: str, name: str) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """The tables of a density with a source, and of its buoyancy, from "X,Y:#RRGGBB:key=value,…".

    `lift` is the displacement upwards by its buoyancy where it is 1 [px].

    Raises:
        ValueError: a part that cannot be read; the message names it.
    """
    source = _parsed(look, text, list(DENSITY_OPTIONS))
    density = {"name": name, "color": source.pop("color"), "look": look}
    if "diffusion" in source:
        density["diffusion"] = source.pop("diffusion")
    lift = source.pop("lift", None)
    density["source"] = [source]
    if lift is None:
        return density, None
    return density, {"kind": "buoyancy", "density": name, "by": [0.0, -lift]}


def _parsed(kind: str, text: str, keys: list[str]) -> dict[str, Any]:
    """The values of a short form, by key."""
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
        return [as_pair(what, "a point X,Y", point) for point in part.split("/")]
    if key == "center":
        return as_pair(what, "the point X,Y", part)
    return as_pair(what, "the arrow DX,DY", part) if key == "by" else as_number(f"{what}: {key}", part)


def _options(what: str, text: str, keys: list[str]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for item in text.split(","):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or key not in keys:
            near = nearest(key, keys) if equals else ""
            raise ValueError(f"{what}: {item!r} is not key=value with a key of {', '.join(keys)}{near}")
        if key in options:
            raise ValueError(f"{what}: {key} is given twice")
        options[key] = _option(what, key, value)
    return options


def _option(what: str, key: str, value: str) -> Any:
    if key in ("mask", "along"):
        return value
    return int(value) if key == "seed" and value.isdecimal() else as_number(f"{what}: {key}", value)


def as_pair(what: str, name: str, part: str) -> list[float]:
    """Two numbers from "X,Y".

    Raises:
        ValueError: not two numbers; the message begins with `what`.
    """
    numbers = part.split(",")
    if len(numbers) != 2:
        raise ValueError(f"{what}: {name} is {part!r}: expected two numbers")
    return [as_number(f"{what}: {name}", number) for number in numbers]


def parse_move(text: str) -> dict[str, Any]:
    """The table of a move from its short form, "X0,Y0:X1,Y1" or "X0,Y0:X1,Y1@SECONDS".

    Raises:
        ValueError: a part that cannot be read; the message names it.
    """
    what = f"move {text!r}"
    places, at, time = text.partition("@")
    parts = places.split(":")
    if len(parts) != 2:
        raise ValueError(f"{what}: expected X0,Y0:X1,Y1 or X0,Y0:X1,Y1@SECONDS")
    start, end = (as_pair(what, "a point X,Y", part) for part in parts)
    return {"from": start, "to": end, **({"time": as_number(f"{what}: time", time)} if at else {})}
