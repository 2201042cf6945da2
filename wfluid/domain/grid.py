"""The grid of the fluid: cells over the rectangle of the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wfluid.domain.limits import CELLS, LEAST_CELLS


@dataclass(frozen=True)
class Grid:
    """A staggered (MAC) grid of nx by ny cells over a domain of width by height.

    The unit of length is the longer side of the picture. x points right, y down; the origin is the top left
    corner of the picture. The walls lie exactly on its edges, so that hx and hy differ slightly for most
    pictures.

    Raises:
        ValueError: fewer than 4 cells along an axis, or a size that is not positive and finite.
    """

    nx: int
    """Cells along x."""
    ny: int
    """Cells along y."""
    width: float = 1.0
    """Length of the domain along x [longer side of the picture]."""
    height: float = 1.0
    """Length of the domain along y [longer side of the picture]."""

    def __post_init__(self) -> None:
        if min(self.nx, self.ny) < LEAST_CELLS:
            raise ValueError(
                f"a grid of {self.nx} x {self.ny} cells: expected {LEAST_CELLS} or more along each axis"
            )
        for name, length in (("width", self.width), ("height", self.height)):
            if not (math.isfinite(length) and length > 0):
                raise ValueError(f"grid {name} {length}: expected a positive, finite length")

    @classmethod
    def for_picture(cls, width: int, height: int, cells: int = CELLS) -> Grid:
        """The grid for a picture of width x height pixels with `cells` along its longer side."""
        longer = max(width, height)
        nx = max(LEAST_CELLS, round(cells * width / longer))
        ny = max(LEAST_CELLS, round(cells * height / longer))
        return cls(nx, ny, width / longer, height / longer)

    @property
    def hx(self) -> float:
        """Width of a cell [longer side]."""
        return self.width / self.nx

    @property
    def hy(self) -> float:
        """Height of a cell [longer side]."""
        return self.height / self.ny
