"""Names of the filters and edges with which a picture is sampled."""

from __future__ import annotations

from wfluid.domain.checks import check_word

FILTERS, FILTER = ("nearest", "bilinear", "cubic", "lanczos"), "cubic"
"""Interpolation between pixels, and the default."""

EDGES, EDGE = ("clamp", "mirror", "wrap", "transparent"), "clamp"
"""Values beyond the edges of a picture, and the default; kernels receive an edge as its index in this
list."""


def check_look_up(filter: str, edge: str) -> None:
    """Check the names of a filter and an edge.

    Raises:
        ValueError: an unknown name; the message lists the known ones.
    """
    check_word("filter", filter, FILTERS)
    check_word("edge", edge, EDGES)
