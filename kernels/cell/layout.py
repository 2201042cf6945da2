"""Where a cell lies in a 1-D padded field."""

from dataclasses import dataclass

import warp as wp

HALO = 2
"""Ghost cells on each side of a field: what a cubic stencil at a wall reaches."""

SPAN = 64
"""Cells a CPU thread runs. Long enough to pay for the loop's entry, short enough that padding a row
to a multiple of it stays cheap."""


def whole_spans(n: int) -> int:
    """n rounded up to whole spans: the room a row, or a table over columns, takes."""
    return -(-n // SPAN) * SPAN


@wp.func
def index(column: int, row: int, pitch: int):
    """Where the cell in a column and a row lies in a field; both count from -`HALO` on."""
    return (row + 2) * pitch + column + 2


@dataclass(frozen=True)
class Layout:
    """Where the cell in row j, column i of an nx by ny grid lies in a 1-D field."""

    nx: int
    ny: int

    @property
    def pitch(self) -> int:
        """Elements from one row to the next: whole spans and a halo on both sides."""
        return whole_spans(self.nx) + 2 * HALO

    @property
    def size(self) -> int:
        """Elements of a field. One row more than the halo, for stencils that read ahead of it."""
        return (self.ny + 2 * HALO + 1) * self.pitch

    @property
    def first(self) -> int:
        """Index of the cell in row 0, column 0."""
        return HALO * self.pitch + HALO
