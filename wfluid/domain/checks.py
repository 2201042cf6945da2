"""Checks of a user's values. Loads no numpy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import Any


def check_word(name: str, value: object, known: Sequence[str], error: type[ValueError] = ValueError) -> None:
    """Check that a value is one of the known words.

    Raises:
        ValueError: it is not; the message lists the known words. `error` replaces the type.
    """
    if value not in known:
        raise error(f"{name} {value!r}: expected one of {', '.join(known)}")


def check_whole(name: str, value: object, least: int, most: int, unit: str = "") -> None:
    """Check that a value is a whole number within a range.

    Raises:
        ValueError: it is not; the message states the range.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ValueError(f"{name} {value!r}: expected a whole number, {least} … {most}{unit}")
    if not least <= int(value) <= most:
        raise ValueError(f"{name} {value}: expected {least} … {most}{unit}")


def check_number(name: str, value: object) -> None:
    """Check that a value is a number; `name` is what the message calls it.

    Raises:
        TypeError: it is something else.
    """
    if not isinstance(value, Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")


def listed(name: str, given: Any, kinds: type | tuple[type, ...], what: str) -> tuple:
    """Objects of some kinds as a tuple; one alone needs no list.

    Raises:
        TypeError: something else; the message has `name` and `what` was expected.
    """
    if isinstance(given, kinds):
        return (given,)
    found = tuple(given) if isinstance(given, Iterable) else (given,)
    for one in found:
        if not isinstance(one, kinds):
            got = f"the class {one.__name__}" if isinstance(one, type) else type(one).__name__
            raise TypeError(f"{name}: expected {what}, got {got}")
    return found
