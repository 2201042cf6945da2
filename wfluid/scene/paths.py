"""Names of files within a scene's tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from wfluid.scene.format import SELF
from wfluid.scene.schema import Key, Many, Named, Variants


def files_renamed(what: Any, value: Any, rename: Callable[[str], str]) -> Any:
    """The value with what names a file renamed."""
    if isinstance(what, Key):
        named = what.file and not (what.file == "painting" and value == SELF)
        return rename(value) if named else value
    if isinstance(what, Many):
        return [files_renamed(what.each, item, rename) for item in value]
    if isinstance(what, Named):
        return {name: files_renamed(what.each, item, rename) for name, item in value.items()}
    keys = what.tables[value["kind"]].keys if isinstance(what, Variants) else what.keys
    return {
        name: files_renamed(keys[name], item, rename) if name in keys else item
        for name, item in value.items()
    }
