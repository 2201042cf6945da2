"""What a file of tables may say: keys with types, ranges and units, and refusals that name the key.

A `Table` is checked against nested dictionaries as TOML gives them. What is wrong is refused with the
key's path, such as `force.2.radius`, and the nearest key or word there is.
"""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

LARGEST = sys.float_info.max
"""Largest number: TOML's integers may be larger."""


class SchemaError(ValueError):
    """A key that is unknown, missing, or has a wrong value, with which the reason then begins.

    `path` leads to it.
    """

    def __init__(self, path: Sequence[str | int], reason: str, about_value: bool = False):
        self.path, self.reason, self.about_value = tuple(path), reason, about_value
        super().__init__(f"{dotted(path)}: {reason}")


def dotted(path: Sequence[str | int]) -> str:
    """A path as a person writes it."""
    return ".".join(map(str, path)) or "the file"


@dataclass(frozen=True)
class Key:
    """One value."""

    meaning: str
    """What it is for, in a few words."""
    check: Callable[[Any], Any]
    """Gives the value as it is kept; raises ValueError with what was expected."""
    type: str = ""
    """What is expected, for people."""
    unit: str = ""
    """Unit."""
    default: Any = None
    """What it is when left out, for people; None where that needs no word."""
    required: bool = False
    """Whether it must be there."""
    file: str = ""
    """"file" where it names one, relative to the scene's folder; "painting" where `self` is none."""


@dataclass(frozen=True)
class Table:
    """Keys and tables by name."""

    meaning: str
    """What it is for."""
    keys: Mapping[str, Key | Table | Many | Named | Variants] = field(default_factory=dict)
    """What may be in it."""


@dataclass(frozen=True)
class Many:
    """An array of tables."""

    each: Table | Variants
    """What each is."""
    unique: str | None = None
    """A key whose values must differ."""


@dataclass(frozen=True)
class Named:
    """Tables under names of the user's choice."""

    each: Table | Variants
    """What each is."""


@dataclass(frozen=True)
class Variants:
    """A table whose key `kind` says which."""

    meaning: str
    """What it is for."""
    tables: Mapping[str, Table]
    """By kind."""
    default: str | None = None
    """The kind when left out."""


def number(least: float = -math.inf, most: float = math.inf, above: float | None = None) -> dict[str, Any]:
    """The type of a finite number within a range; `above` excludes its lower end."""

    def check(value: Any) -> float:
        wrong = isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST
        if wrong or not least <= value <= most or (above is not None and value <= above):
            raise ValueError(f"expected {kind}")
        return value

    low = f"above {above:g}" if above is not None else f"from {least:g}" if least > -math.inf else ""
    high = f"to {most:g}" if most < math.inf else ""
    kind = " ".join(part for part in ("a number", low, high) if part)
    return {"check": check, "type": kind}


def whole(least: int, most: int) -> dict[str, Any]:
    """The type of a whole number within a range."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise ValueError(f"expected {kind}")
        return value

    kind = f"a whole number from {least} to {most}"
    return {"check": check, "type": kind}


def text() -> dict[str, Any]:
    """The type of a text that is not empty."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            raise ValueError("expected a text on one line")
        return value

    return {"check": check, "type": "a text"}


def flag() -> dict[str, Any]:
    """The type of true or false."""

    def check(value: Any) -> bool:
        if not isinstance(value, bool):
            raise ValueError("expected true or false")
        return value

    return {"check": check, "type": "true or false"}


def word(*words: str) -> dict[str, Any]:
    """The type of one of some words."""

    def check(value: Any) -> str:
        if value not in words:
            raise ValueError(f"expected one of {', '.join(words)}{nearest(value, words)}")
        return value

    return {"check": check, "type": " or ".join(words)}


def numbers(count: int, what: str) -> dict[str, Any]:
    """The type of so many finite numbers."""
    one = number()["check"]

    def check(value: Any) -> list[float]:
        try:
            if not isinstance(value, list) or len(value) != count:
                raise ValueError
            return [one(item) for item in value]
        except ValueError:
            raise ValueError(f"expected {what}") from None

    return {"check": check, "type": what}


def rows(count: int, least: int, what: str) -> dict[str, Any]:
    """The type of a list of `least` or more rows of `count` numbers each; of one each, plain numbers."""
    row = number()["check"] if count == 1 else numbers(count, what)["check"]

    def check(value: Any) -> list:
        try:
            if not isinstance(value, list) or len(value) < least:
                raise ValueError
            return [row(item) for item in value]
        except ValueError:
            raise ValueError(f"expected {what}") from None

    return {"check": check, "type": what}


def names() -> dict[str, Any]:
    """The type of one name, or a list of names."""

    def check(value: Any) -> list[str]:
        found = value if isinstance(value, list) else [value]
        if not found or not all(isinstance(item, str) and item for item in found):
            raise ValueError("expected a name, or a list of names")
        return found

    return {"check": check, "type": "a name or a list of names"}


def nearest(value: Any, known: Sequence[str]) -> str:
    """Ask for the most similar of what is known, if there is one."""
    near = difflib.get_close_matches(str(value), list(known), n=1, cutoff=0.5)
    return f"; did you mean {near[0]}?" if near else ""


def checked(what: Table | Many | Named | Variants | Key, value: Any, path: tuple = ()) -> Any:
    """The value as plain dictionaries and lists, with what each key's check makes of it.

    Raises:
        SchemaError: the first key that is wrong.
    """
    if isinstance(what, Key):
        try:
            return what.check(value)
        except ValueError as error:
            shown = repr(value) if len(repr(value)) <= 60 else repr(value)[:57] + "…"
            raise SchemaError(path, f"{shown}: {error}", about_value=True) from None
    if isinstance(what, Many):
        if not isinstance(value, list):
            raise SchemaError(path, f"expected a list of tables, [[{dotted(path)}]]")
        found = [checked(what.each, item, (*path, n)) for n, item in enumerate(value)]
        _refuse_twins(what.unique, found, path)
        return found
    if not isinstance(value, Mapping):
        raise SchemaError(path, f"expected a table, [{dotted(path)}]")
    if isinstance(what, Named):
        return {name: checked(what.each, item, (*path, name)) for name, item in value.items()}
    if isinstance(what, Variants):
        return _variant(what, value, path)
    return _table(what, value, path)


def _variant(what: Variants, value: Mapping, path: tuple) -> dict:
    kind = value.get("kind", what.default)
    if kind is None:
        raise SchemaError(path, f"kind is missing: expected one of {', '.join(what.tables)}")
    if not isinstance(kind, str) or kind not in what.tables:
        reason = f"{kind!r}: expected one of {', '.join(what.tables)}{nearest(kind, list(what.tables))}"
        raise SchemaError((*path, "kind"), reason)
    rest = {name: item for name, item in value.items() if name != "kind"}
    return {"kind": str(kind), **_table(what.tables[str(kind)], rest, path)}


def _table(what: Table, value: Mapping, path: tuple) -> dict:
    for name in value:
        if name not in what.keys:
            there = f"; there is {', '.join(what.keys)}" if what.keys else ""
            raise SchemaError((*path, name), f"no such key{nearest(name, list(what.keys)) or there}")
    for name, key in what.keys.items():
        if isinstance(key, Key) and key.required and name not in value:
            raise SchemaError(path, f"{name} is missing: {key.meaning}")
    return {str(name): checked(what.keys[name], item, (*path, str(name))) for name, item in value.items()}


def _refuse_twins(key: str | None, found: Sequence[Mapping], path: tuple) -> None:
    seen: dict[Any, int] = {}
    for n, table in enumerate(found):
        name = table.get(key) if key else None
        if name is None:
            continue
        if name in seen:
            raise SchemaError((*path, n, key), f"{name!r} is the name of {dotted((*path, seen[name]))} too")
        seen[name] = n


class SceneError(ValueError):
    """A scene that cannot be read or makes no sense; the message names file, line where known, and key."""
