"""Checks of values that a user gives. Loads no numpy."""

from __future__ import annotations

from collections.abc import Sequence


def check_word(name: str, value: object, known: Sequence[str], error: type[ValueError] = ValueError) -> None:
    """Refuse a word that is not one of those known.

    Raises:
        ValueError: with the known words; or the `error` that is given.
    """
    if value not in known:
        raise error(f"{name} {value!r}: expected one of {', '.join(known)}")
