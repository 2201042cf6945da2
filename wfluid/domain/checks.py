"""Checks of a user's values. Loads no numpy."""

from __future__ import annotations

from collections.abc import Sequence


def check_word(name: str, value: object, known: Sequence[str], error: type[ValueError] = ValueError) -> None:
    """Check that a value is one of the known words.

    Raises:
        ValueError: it is not; the message lists the known words. `error` replaces the type.
    """
    if value not in known:
        raise error(f"{name} {value!r}: expected one of {', '.join(known)}")
