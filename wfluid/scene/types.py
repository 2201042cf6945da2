"""Types of a scene's values: numbers with ranges, words, texts, lists."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

LARGEST = sys.float_info.max
"""Largest number: TOML's integers may be larger."""


class Type(NamedTuple):
    """The type of a value."""

    check: Callable[[Any], Any]
    """Returns the value in its stored form; raises ValueError with the expected type."""
    text: str
    """The expected type, in words."""
    read: Callable[[str], Any] = str
    """Reads the value from an argument of the command line."""
    words: tuple[str, ...] = ()
    """The allowed words, if the type is a choice."""


def number(least: float = -math.inf, most: float = math.inf, above: float | None = None) -> Type:
    """A finite number within a range; `above` excludes its lower end."""

    def check(value: Any) -> float:
        wrong = isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST
        if wrong or not least <= value <= most or (above is not None and value <= above):
            raise ValueError(f"expected {text}")
        return value

    low = f"above {above:g}" if above is not None else f"from {least:g}" if least > -math.inf else ""
    high = f"to {most:g}" if most < math.inf else ""
    text = " ".join(part for part in ("a number", low, high) if part)
    return Type(check, text, float)


def whole(least: int, most: int) -> Type:
    """A whole number within a range."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise ValueError(f"expected {text}")
        return value

    text = f"a whole number from {least} to {most}"
    return Type(check, text, int)


def text() -> Type:
    """A text that is not empty."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            raise ValueError("expected a text on one line")
        return value

    return Type(check, "a text")


def flag() -> Type:
    """True or false."""

    def check(value: Any) -> bool:
        if not isinstance(value, bool):
            raise ValueError("expected true or false")
        return value

    return Type(check, "true or false", bool)


def word(*words: str) -> Type:
    """One of some words."""

    def check(value: Any) -> str:
        if value not in words:
            raise ValueError(f"expected one of {', '.join(words)}{nearest(value, words)}")
        return value

    return Type(check, " or ".join(words), words=words)


def word_by_axis(*words: str) -> Type:
    """One of some words for both axes, or one for each, such as "periodic,no-slip"."""

    def check(value: Any) -> str:
        parts = value.split(",") if isinstance(value, str) else [value]
        wrong = [part for part in parts if not isinstance(part, str) or part.strip() not in words]
        if wrong or len(parts) > 2:
            near = nearest(wrong[0], words) if wrong else ""
            raise ValueError(f"expected {', '.join(words)}, or two of them as x,y{near}")
        return value

    return Type(check, " or ".join(words))


def numbers(count: int, what: str) -> Type:
    """A list of `count` finite numbers; `what` describes it in messages."""
    one = number().check

    def check(value: Any) -> list[float]:
        try:
            if not isinstance(value, list) or len(value) != count:
                raise ValueError
            return [one(item) for item in value]
        except ValueError:
            raise ValueError(f"expected {what}") from None

    return Type(check, what)


def rows(count: int, least: int, what: str) -> Type:
    """A list of at least `least` rows of `count` numbers each; with a count of 1, a list of numbers."""
    row = number().check if count == 1 else numbers(count, what).check

    def check(value: Any) -> list:
        try:
            if not isinstance(value, list) or len(value) < least:
                raise ValueError
            return [row(item) for item in value]
        except ValueError:
            raise ValueError(f"expected {what}") from None

    return Type(check, what)


def names() -> Type:
    """One name, or a list of names; stored as a list."""

    def check(value: Any) -> list[str]:
        found = value if isinstance(value, list) else [value]
        if not found or not all(isinstance(item, str) and item for item in found):
            raise ValueError("expected a name, or a list of names")
        return found

    return Type(check, "a name or a list of names")


def color() -> Type:
    """A colour of six hexadecimal digits; stored in lower case."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
            raise ValueError('expected a colour such as "#1a2b3c"')
        return value.lower()

    return Type(check, 'a colour such as "#1a2b3c"')


def curve(words: Sequence[str]) -> Type:
    """A curve, by its name or by keys; on the command line "SECONDS:PART,…"."""
    by_name = word(*words).check
    by_keys = rows(2, 1, f"{', '.join(words)}, or a list of keys, [[seconds, value], …]").check

    def check(value: Any) -> str | list[list[float]]:
        return by_name(value) if isinstance(value, str) else by_keys(value)

    def key(part: str) -> list[float]:
        numbers = part.split(":")
        if len(numbers) != 2:
            raise ValueError(f"{part!r}: expected SECONDS:PART")
        return [as_number("a key", number) for number in numbers]

    def read(text: str) -> str | list[list[float]]:
        return [key(part) for part in text.split(",")] if ":" in text else text

    return Type(check, "a word or keys", read)


def version(newest: int) -> Type:
    """A version of the format, at most the `newest` that this program reads."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise ValueError("expected a whole number from 1")
        if value > newest:
            raise ValueError(f"a scene of a newer version; this wfluid reads up to {newest}: update wfluid")
        return value

    return Type(check, f"a whole number to {newest}", int)


def as_number(name: str, part: str) -> float:
    """A finite number in a text.

    Raises:
        ValueError: not a finite number; the message begins with `name`.
    """
    try:
        value = float(part)
    except ValueError:
        raise ValueError(f"{name}: {part!r} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{name}: {part} is not finite")
    return value


def nearest(value: Any, known: Sequence[str]) -> str:
    """A question that proposes the most similar known word; empty if none is similar."""
    import difflib  # only for messages: every start of the command line loads this file

    near = difflib.get_close_matches(str(value), list(known), n=1, cutoff=0.5)
    return f"; did you mean {near[0]}?" if near else ""
