"""The fluid at one time: arrays only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.grid import Grid
from wfluid.kernels.cells import HALO, Layout, Real
from wfluid.walls import Walls

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


@dataclass(frozen=True)
class State:
    """Velocity, displacement and pressure of a fluid, as device arrays over one `Layout`, ghosts filled."""

    grid: Grid
    """The grid the arrays are on."""
    u: wp.array
    """Velocity along x on x-faces [longer side/s], face i of row j at (i hx, (j + 1/2) hy)."""
    v: wp.array
    """Velocity along y on y-faces [longer side/s], face j of column i at ((i + 1/2) hx, j hy)."""
    d_x: wp.array
    """Displacement (source - x) along x at centres [cells of hx]."""
    d_y: wp.array
    """Displacement (source - y) along y at centres [cells of hy]."""
    q: wp.array
    """Impulse of the pressure in the last step, at centres [longer side^2/s], the next step's first guess;
    0 where diffusion needs none."""

    @classmethod
    def at_rest(cls, grid: Grid, device: wp.Device) -> State:
        """A still fluid under an untouched picture."""
        layout = Layout(grid.nx, grid.ny)
        return cls(grid, *(field(layout, device) for _ in range(5)))

    @property
    def arrays(self) -> tuple[wp.array, ...]:
        """u, v, d_x, d_y, q."""
        return self.u, self.v, self.d_x, self.d_y, self.q

    @property
    def layout(self) -> Layout:
        """Where the cells lie in the arrays."""
        return Layout(self.grid.nx, self.grid.ny)

    @property
    def velocity(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity on faces [longer side/s]: u (ny, nx + 1) and v (ny + 1, nx), copies."""
        return to_numpy(self.u, self.layout, (0, 1)), to_numpy(self.v, self.layout, (1, 0))

    @property
    def displacement(self) -> tuple[np.ndarray, np.ndarray]:
        """Source minus position at centres [longer side]: two (ny, nx) arrays, copies."""
        d_x, d_y = (to_numpy(d, self.layout) for d in (self.d_x, self.d_y))
        return d_x * self.grid.hx, d_y * self.grid.hy
