"""The layout of a grid in a 1-D padded field."""

from dataclasses import dataclass

import warp as wp

HALO = 2
"""Ghost cells on each side of a field: as many as a cubic stencil at a wall reads."""

SPAN = 64
"""Cells that a CPU thread runs in one loop.

Large, so that the start of the loop costs little; small, so that padding rows to a multiple of it does
too."""


def whole_spans(n: int) -> int:
    """n rounded up to a multiple of `SPAN`: the length of a row, or of a table over columns."""
    return -(-n // SPAN) * SPAN


@wp.func
def index(column: int, row: int, pitch: int):
    """Index in a field of the cell at a column and a row, from -`HALO` on; 2 is `HALO`."""
    return (row + 2) * pitch + column + 2


@dataclass(frozen=True)
class Layout:
    """Layout of an nx by ny grid: the cell in column i, row j has index first + j pitch + i."""

    nx: int
    ny: int

    @property
    def pitch(self) -> int:
        """Elements from one row to the next: nx rounded up to spans, and a halo on both sides."""
        return whole_spans(self.nx) + 2 * HALO

    @property
    def size(self) -> int:
        """Elements of a field. After the halo one spare row, which stencils in the halo may read."""
        return (self.ny + 2 * HALO + 1) * self.pitch

    @property
    def first(self) -> int:
        """Index of the cell in row 0, column 0."""
        return HALO * self.pitch + HALO
