"""Fields: 1-D padded arrays on a device, and their way to NumPy and back."""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.kernels.cell.layout import HALO, Layout
from wfluid.kernels.cell.real import Real

Vector = tuple[wp.array, ...]
"""One field a component: (q,) of a scalar, (u, v) of a velocity."""


def field(layout: Layout, device: wp.Device) -> wp.array:
    """A new field of zeros."""
    return wp.zeros(layout.size, dtype=Real, device=device)


def vector(layout: Layout, device: wp.Device, components: int) -> Vector:
    """New fields of zeros, one a component."""
    return tuple(field(layout, device) for _ in range(components))


def where(grid: Grid, walls: Walls, layout: Layout) -> list[int]:
    """What programs that look values up need to know: cells, which axes wrap, and the pitch."""
    periodic_x, periodic_y = walls.periodic
    return [grid.nx, grid.ny, int(periodic_x), int(periodic_y), layout.pitch]


def to_numpy(f: wp.array, layout: Layout, extra: tuple[int, int] = (0, 0)) -> np.ndarray:
    """The values of a field as a (ny + extra[0], nx + extra[1]) array: a copy without the halo."""
    rows = layout.size // layout.pitch
    grid = f.numpy()[: rows * layout.pitch].reshape(rows, layout.pitch)
    return grid[HALO : HALO + layout.ny + extra[0], HALO : HALO + layout.nx + extra[1]].copy()


def from_numpy(values: np.ndarray, f: wp.array, layout: Layout) -> None:
    """Write an array of at most (ny + 2, nx + 2) values into a field, from row 0, column 0 on."""
    padded = f.numpy().copy()
    rows = layout.size // layout.pitch
    grid = padded[: rows * layout.pitch].reshape(rows, layout.pitch)
    grid[HALO : HALO + values.shape[0], HALO : HALO + values.shape[1]] = values
    f.assign(padded)
