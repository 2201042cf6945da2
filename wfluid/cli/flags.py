"""The flags of the commands that make a scene; a flag of one key comes from the field of its table."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from wfluid.cli.run_flags import add_plot, add_run, repeated
from wfluid.scene.forces import FORCES
from wfluid.scene.format import SCENE
from wfluid.scene.schema import ArrayOf, Key, Table
from wfluid.scene.short_forms import DENSITY_OPTIONS, FORMS, force_options

KEYFRAME_TIME = 1.0
"""Default time of the keyframes of `wfluid keyframes` [s]."""

DENSITIES = ("ink", "smoke")
"""Short forms of densities; the others are forces."""


def flag_name(flag: str) -> str:
    """The attribute of the parsed options that holds a flag's value."""
    return flag.lstrip("-").replace("-", "_")


def drawn_flag(kind: str) -> str:
    """The flag of a short form: its kind, except for a force from a picture."""
    return "--force-image" if kind == "image" else f"--{kind}"


def scene_tables() -> dict[str, Table]:
    """The tables of a scene by their keys; of an array, the table of its items."""
    found = {}
    for name, what in SCENE.keys.items():
        table = what.each if isinstance(what, ArrayOf) else what
        if isinstance(table, Table):
            found[name] = table
    return found


def add_animate(parser: argparse.ArgumentParser) -> None:
    """Add the flags of animate."""
    parser.add_argument("picture", metavar="PICTURE", help="the picture to animate")
    _add_forces(parser)
    _add_companions(parser)
    _add_keys(parser, without=("keyframes", "morph"))
    _add_shot(parser)


def add_keyframes(parser: argparse.ArgumentParser) -> None:
    """Add the flags of keyframes."""
    add = parser.add_argument
    add("picture", metavar="PICTURE", help="the picture to animate")
    add("--move", **repeated("X0,Y0:X1,Y1[@T]", "move the point X0,Y0 to X1,Y1 [px] by time T [s]"))
    add("--pin", **repeated("X,Y", "keep this point in place [px]"))
    add(
        "--points",
        metavar="FILE.csv",
        help="read moves from a CSV file: from x, from y, to x, to y [px][, time [s]]",
    )
    text = f"arrival time of moves without one [s] (the duration, or else {KEYFRAME_TIME:g})"
    add("--time", type=float, help=text)
    add_plot(parser)
    _add_forces(parser)
    _add_companions(parser)
    _add_keys(parser, without=("morph",))
    _add_shot(parser)


def add_morph(parser: argparse.ArgumentParser) -> None:
    """Add the flags of morph."""
    add = parser.add_argument
    add("picture", metavar="A", help="the first picture")
    add("to", metavar="B", help="the second picture")
    add(
        "--points",
        metavar="FILE.csv",
        help="read corresponding points from a CSV file: x, y in A, x, y in B [px]",
    )
    add("--move", **repeated("X0,Y0:X1,Y1", "the point X0,Y0 of A corresponds to X1,Y1 of B [px]"))
    add("--pin", **repeated("X,Y", "keep this point of A in place [px]"))
    delay = _default("morph", "delay")
    text = f"mask: black parts morph later than white ones, by DELAY, a part of the duration ({delay})"
    add("--timing", metavar="MASK[:DELAY]", help=text)
    add_plot(parser)
    _add_keys(parser, morphs=True)
    _add_shot(parser)


def _default(table: str, name: str) -> str:
    """The default of a key, for a help text."""
    key = scene_tables()[table].keys[name]
    return key.shown_default if isinstance(key, Key) else ""


# Flags of a scene's keys


def _add_keys(parser: argparse.ArgumentParser, without: Sequence[str] = (), morphs: bool = False) -> None:
    """Add the flags of keys, `without` those of some tables; for a morph only those of allowed keys."""
    add_key_flags(parser, "scene", SCENE.meaning, SCENE.keys)
    for name, table in scene_tables().items():
        if name in without or (morphs and name in SCENE.not_in_morph):
            continue
        keys = {key: one for key, one in table.keys.items() if not (morphs and key in table.not_in_morph)}
        add_key_flags(parser, name, table.meaning, keys)


def add_key_flags(parser: argparse.ArgumentParser, name: str, meaning: str, keys: Mapping[str, Any]) -> None:
    """Add a group with a flag for each key that has one."""
    flags = {key.flag: key for key in keys.values() if isinstance(key, Key) and key.flag}
    if flags:
        group = parser.add_argument_group(name, meaning)
        for flag, key in flags.items():
            _add_key_flag(group, flag, key)


def _add_key_flag(group: Any, flag: str, key: Key) -> None:
    """Add the flag of a key; its value is None if it is not given."""
    unit = f" [{key.unit}]" if key.unit else ""
    words = f": {', '.join(key.kind.words)}" if key.kind.words else ""
    default = f" ({key.shown_default})" if key.shown_default and key.kind.read is not bool else ""
    text = f"{key.meaning}{words}{unit}{default}".replace("%", "%%")
    if key.kind.read is bool:
        both = argparse.BooleanOptionalAction if key.default is None else "store_true"
        group.add_argument(flag, action=both, default=None, help=text)
    else:
        type_ = key.kind.read if key.kind.read in (int, float) else str
        group.add_argument(flag, type=type_, metavar=key.metavar, dest=flag_name(flag), help=text)


# Flags that set several keys


def _add_forces(parser: argparse.ArgumentParser) -> None:
    """Add the short forms of forces and densities."""
    group = parser.add_argument_group("forces", "Forces and densities; places and lengths in pixels")
    for kind, (form, *_) in FORMS.items():
        if kind in DENSITIES:
            meaning, keys = f"pour {kind} of a colour", list(DENSITY_OPTIONS)
        else:
            table = FORCES.tables[kind]
            meaning = table.meaning[0].lower() + table.meaning[1:]
            keys = force_options(kind)
        group.add_argument(
            drawn_flag(kind),
            **repeated(f"{form}[:key=value,…]", f"{meaning}; keys {', '.join(keys)}".replace("%", "%%")),
        )


def _add_companions(parser: argparse.ArgumentParser) -> None:
    """Add the flags of followed points and layers."""
    add = parser.add_argument
    add("--track", **repeated("X,Y", "follow this point [px]"))
    add("--tracks", metavar="FILE.csv", help="write the paths of the followed points")
    text = "warp another picture or matte by the same map; it is written beside OUT as OUT_FILE"
    add("--layer", **repeated("FILE", text))


def _add_shot(parser: argparse.ArgumentParser) -> None:
    """Add the flags of every command that makes a scene."""
    text = f"mask: white parts stay in place, by a drag of STRENGTH [1/s] ({_default('freeze', 'strength')})"
    parser.add_argument("--freeze", metavar="MASK[:STRENGTH]", help=text)
    text = "write the frames to OUT: x.gif, x.mp4, x.webm, or a sequence such as x.####.png"
    parser.add_argument("-o", "--output", **repeated("OUT", text))
    parser.add_argument("--save-scene", metavar="FILE.toml", help="save this command line as a scene file")
    add_run(parser)
