"""How a picture is read between its pixels and beyond its edges, in words."""

from __future__ import annotations

FILTERS = ("nearest", "bilinear", "cubic", "lanczos")
"""How a picture is read between its pixels."""

EDGES = ("clamp", "mirror", "wrap", "transparent")
"""What lies beyond a picture; programs know an edge by its place here."""


def check_look_up(filter: str, edge: str) -> None:
    """Refuse a filter or an edge that does not exist.

    Raises:
        ValueError: with those that do.
    """
    for name, value, known in (("filter", filter, FILTERS), ("edge", edge, EDGES)):
        if value not in known:
            raise ValueError(f"{name} {value!r}: expected one of {', '.join(known)}")
