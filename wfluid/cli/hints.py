"""Messages that name options of the command in use."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

BY_FLAGS = ("animate", "keyframes", "morph", "warmup")
"""Commands whose settings are flags; the others read a scene."""

OWN = {"check-gradient": ("--cells", "--seed")}
"""Flags of a command that reads a scene, which mean what they mean in messages."""


def fitted_hint(verb: str, text: str) -> str:
    """A message for a command: one that reads a scene has `--set frames.width=…` instead of `--width`.

    Messages name flags of `animate`; those that set one key of a scene are replaced.
    """
    if verb in BY_FLAGS or "--" not in text:
        return text
    keys = {flag: key for flag, key in _keys_of_flags() if flag not in OWN.get(verb, ())}
    return re.sub(
        r"(--[a-z]+(?:-[a-z]+)*)(=[\w.-]+)?",
        lambda found: f"--set {keys[found[1]]}{found[2] or '=…'}" if found[1] in keys else found[0],
        text,
    )


def _keys_of_flags() -> Iterator[tuple[str, str]]:
    """Each flag that sets one key of a scene, and the path of that key."""
    from wfluid.scene.format import SCENE

    yield from _below(SCENE, "")


def _below(table: Any, path: str) -> Iterator[tuple[str, str]]:
    for name, what in table.keys.items():
        if hasattr(what, "keys"):
            yield from _below(what, f"{path}{name}.")
        elif getattr(what, "flag", ""):
            yield what.flag, f"{path}{name}"
