"""Names of the filters and edges with which a picture is sampled."""

from __future__ import annotations

FILTERS = ("nearest", "bilinear", "cubic", "lanczos")
"""Interpolation between pixels."""

EDGES = ("clamp", "mirror", "wrap", "transparent")
"""Values beyond the edges of a picture; kernels are given an edge by its index here."""


def check_look_up(filter: str, edge: str) -> None:
    """Refuse an unknown filter or edge.

    Raises:
        ValueError: with the known ones.
    """
    for name, value, known in (("filter", filter, FILTERS), ("edge", edge, EDGES)):
        if value not in known:
            raise ValueError(f"{name} {value!r}: expected one of {', '.join(known)}")
