"""Checks of a user's values. Loads no numpy."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral


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
