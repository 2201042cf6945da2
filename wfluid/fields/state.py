"""The fluid at one time: arrays only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import field, to_numpy, vector
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.real import Real


@dataclass(frozen=True)
class State:
    """A fluid over one `Layout`, with ghosts: velocity, displacement, pressure, densities; and points."""

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
    rho: tuple[wp.array, ...]
    """The fluid's densities at centres, in their order; of no unit."""
    p_x: wp.array
    """Where points of the picture are now, along x [cells from the left edge]; one number a point."""
    p_y: wp.array
    """The same along y [cells from the top edge]."""

    @classmethod
    def at_rest(cls, grid: Grid, device: wp.Device, densities: int = 0, points: int = 0) -> State:
        """A still fluid under an untouched picture, without densities; all points at the origin."""
        layout = Layout(grid.nx, grid.ny)
        p_x, p_y = (wp.zeros(points, dtype=Real, device=device) for _ in range(2))
        return cls(
            grid, *(field(layout, device) for _ in range(5)), vector(layout, device, densities), p_x, p_y
        )

    @property
    def arrays(self) -> list[wp.array]:
        """Every array that has entries."""
        return [
            a for a in (self.u, self.v, self.d_x, self.d_y, self.q, *self.rho, self.p_x, self.p_y) if a.size
        ]

    @property
    def fields(self) -> list[wp.array]:
        """Every array over the grid."""
        return [self.u, self.v, self.d_x, self.d_y, self.q, *self.rho]

    @property
    def particles(self) -> list[wp.array]:
        """Where points are along x and y."""
        return [self.p_x, self.p_y]

    def view(self) -> State:
        """The same memory in arrays of its own, which may have other gradients."""
        u, v, d_x, d_y, q, p_x, p_y = (
            a[:] if a.size else wp.empty_like(a)
            for a in (self.u, self.v, self.d_x, self.d_y, self.q, self.p_x, self.p_y)
        )
        return State(self.grid, u, v, d_x, d_y, q, tuple(rho[:] for rho in self.rho), p_x, p_y)

    def copy(self) -> State:
        """The same values in arrays of their own."""
        u, v, d_x, d_y, q, *rho = (wp.clone(a, requires_grad=False) for a in self.fields)
        return State(self.grid, u, v, d_x, d_y, q, tuple(rho), wp.clone(self.p_x), wp.clone(self.p_y))

    def take_gradient(self, bar: State) -> None:
        """Let the arrays of `bar` hold the gradients."""
        own = (self.u, self.v, self.d_x, self.d_y, self.q, *self.rho, self.p_x, self.p_y)
        theirs = (bar.u, bar.v, bar.d_x, bar.d_y, bar.q, *bar.rho, bar.p_x, bar.p_y)
        for a, b in zip(own, theirs, strict=True):
            a.grad = b

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

    @property
    def densities(self) -> tuple[np.ndarray, ...]:
        """The densities at centres: (ny, nx) arrays, copies."""
        return tuple(to_numpy(rho, self.layout) for rho in self.rho)

    @property
    def points(self) -> np.ndarray:
        """Where the points are now [longer side]: (points, 2), x and y, a copy."""
        columns = [p.numpy().astype(np.float64) for p in self.particles]
        return np.stack(columns, axis=1) * (self.grid.hx, self.grid.hy)
