"""The flags of the commands that make a scene; those of single keys come from the fields of its tables."""

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


def add_animate(parser: argparse.ArgumentParser) -> None:
    """The flags of animate."""
    parser.add_argument("picture", metavar="PICTURE", help="the picture to animate")
    _add_forces(parser)
    _add_companions(parser)
    _add_keys(parser, without=("keyframes", "morph"))
    _add_shot(parser)


def add_keyframes(parser: argparse.ArgumentParser) -> None:
    """The flags of keyframes."""
    add = parser.add_argument
    add("picture", metavar="PICTURE", help="the picture to animate")
    add("--move", **repeated("X0,Y0:X1,Y1[@T]", "the point X0,Y0 should be at X1,Y1 at T seconds [px]"))
    add("--pin", **repeated("X,Y", "this point should stay [px]"))
    add("--points", metavar="FILE.csv", help="moves in a file: from x, from y, to x, to y[, seconds]")
    text = f"when points arrive whose time is not given [s] ({KEYFRAME_TIME:g}, or the duration)"
    add("--time", type=float, help=text)
    add_plot(parser)
    _add_forces(parser)
    _add_companions(parser)
    _add_keys(parser, without=("morph",))
    _add_shot(parser)


def add_morph(parser: argparse.ArgumentParser) -> None:
    """The flags of morph."""
    delay = SCENE.keys["morph"].keys["delay"].shown_default
    add = parser.add_argument
    add("picture", metavar="A", help="the picture to begin with")
    add("to", metavar="B", help="the picture that it flows into")
    add("--points", metavar="FILE.csv", help="points that correspond: x in A, y in A, x in B, y in B [px]")
    add("--move", **repeated("X0,Y0:X1,Y1", "the point X0,Y0 of A is X1,Y1 of B [px]"))
    add("--pin", **repeated("X,Y", "this point of A should stay [px]"))
    text = f"a mask, white where it happens first, black DELAY later ({delay})"
    add("--timing", metavar="MASK[:DELAY]", help=text)
    add_plot(parser)
    _add_keys(parser, morphs=True)
    _add_shot(parser)


# Flags of a scene's keys


def _add_keys(parser: argparse.ArgumentParser, without: Sequence[str] = (), morphs: bool = False) -> None:
    """The flags of a scene's keys and of its tables', `without` some; of a morph those it has a use for."""
    add_key_flags(parser, "scene", SCENE.meaning, SCENE.keys)
    for name, what in SCENE.keys.items():
        table = what.each if isinstance(what, ArrayOf) else what
        if not isinstance(table, Table) or name in without or (morphs and name in SCENE.not_in_morph):
            continue
        keys = {key: one for key, one in table.keys.items() if not (morphs and key in table.not_in_morph)}
        add_key_flags(parser, name, table.meaning, keys)


def add_key_flags(parser: argparse.ArgumentParser, name: str, meaning: str, keys: Mapping[str, Any]) -> None:
    """Add a group of flags, one for each key that has one."""
    flags = {key.flag: key for key in keys.values() if isinstance(key, Key) and key.flag}
    if flags:
        group = parser.add_argument_group(name, meaning)
        for flag, key in flags.items():
            _add_key_flag(group, flag, key)


def _add_key_flag(group: Any, flag: str, key: Key) -> None:
    """Add the flag of a key, whose value is None where it is not given."""
    unit = f" [{key.unit}]" if key.unit else ""
    words = f": {', '.join(key.kind.words)}" if key.kind.words else ""
    default = f" ({key.shown_default})" if key.shown_default and key.kind.read is not bool else ""
    text = f"{key.meaning}{words}{unit}{default}".replace("%", "%%")
    if key.kind.read is bool:
        group.add_argument(flag, action="store_true", default=None, help=text)
    else:
        type_ = key.kind.read if key.kind.read in (int, float) else str
        group.add_argument(flag, type=type_, metavar=key.metavar, dest=flag_name(flag), help=text)


# Flags that say more than one key


def _add_forces(parser: argparse.ArgumentParser) -> None:
    """The short forms of forces and densities."""
    group = parser.add_argument_group("forces", "What moves the picture, places and lengths in pixels")
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
    """The flags of what goes with the picture."""
    add = parser.add_argument
    add("--track", **repeated("X,Y", "follow this point"))
    add("--tracks", metavar="FILE.csv", help="write where the followed points go")
    text = "a picture or matte that goes through the same map, written beside OUT as OUT_FILE"
    add("--layer", **repeated("FILE", text))


def _add_shot(parser: argparse.ArgumentParser) -> None:
    """The flags of every command that makes a scene."""
    strength = SCENE.keys["freeze"].keys["strength"]
    text = f"a mask, white where the picture stays (drag {strength.shown_default}/s)"
    parser.add_argument("--freeze", metavar="MASK[:STRENGTH]", help=text)
    text = "x.gif, x.mp4, x.webm, or a sequence such as x.####.png"
    parser.add_argument("-o", "--output", **repeated("OUT", text))
    parser.add_argument(
        "--save-scene", metavar="FILE.toml", help="write what this command line says as a scene"
    )
    add_run(parser)
