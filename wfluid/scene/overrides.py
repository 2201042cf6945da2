"""Changes of single values of a scene: `--set time.duration=1`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wfluid.scene.schema import SceneError
from wfluid.scene.types import nearest


def copied(tables: Any) -> Any:
    """A deep copy of nested tables and lists."""
    if isinstance(tables, Mapping):
        return {key: copied(value) for key, value in tables.items()}
    return [copied(value) for value in tables] if isinstance(tables, list) else tables


def parse_value(text: str) -> Any:
    """The TOML value of a text; a text that is no TOML value is returned as it is."""
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    try:
        parsed = tomlkit.parse(f"value = {text}").unwrap()
        return parsed["value"] if len(parsed) == 1 else text
    except TOMLKitError:
        return text


def set_value(tables: Any, path: list[str], value: Any, setting: str) -> tuple[str | int, ...]:
    """Set the value at a path of keys, names and numbers, in place; returns the path with numbers for names.

    Raises:
        SceneError: an item of a list that does not exist; the message quotes `setting`.
    """
    at, found = tables, []
    step: str | int
    for n, step in enumerate(path):
        last = n == len(path) - 1
        if isinstance(at, list):
            step = _item(at, path[n], setting)
        elif isinstance(at, dict):
            if not last and step not in at:
                at[step] = {}
        else:
            raise SceneError(f"--set {setting!r}: {'.'.join(path[:n])} is a value: expected a table")
        found.append(step)
        if last:
            at[step] = value
        else:
            at = at[step]
    return tuple(found)


def _item(items: list, step: str, setting: str) -> int:
    names = [item.get("name") for item in items if isinstance(item, dict)]
    if step in names:
        return names.index(step)
    if step.isdecimal() and int(step) < len(items):
        return int(step)
    known = [name for name in names if name]
    raise SceneError(f"--set {setting!r}: no item {step!r} of {len(items)}{nearest(step, known)}")
