"""The state of the fluid at one time: arrays only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import clone, copy, field, fill, finite, read, to_numpy, vector, view, zeros
from wfluid.kernels.cell.layout import Layout

FIELDS = ("u", "v", "d_x", "d_y", "q")
"""Names of the arrays over the grid, without densities."""

PARTICLES = ("p_x", "p_y")
"""Names of the arrays with one entry per point of the picture."""


@dataclass(frozen=True, eq=False)
class State:
    """Velocity, displacement, pressure and densities over one `Layout`, with ghosts; and points."""

    grid: Grid
    """The grid of the arrays."""
    u: wp.array
    """Velocity along x on x-faces [longer side/s], face i of row j at (i hx, (j + 1/2) hy)."""
    v: wp.array
    """Velocity along y on y-faces [longer side/s], face j of column i at ((i + 1/2) hx, j hy)."""
    d_x: wp.array
    """Displacement (source - x) along x at centres [cells of hx]."""
    d_y: wp.array
    """Displacement (source - y) along y at centres [cells of hy]."""
    q: wp.array
    """Impulse of the pressure in the last step, at centres [longer side^2/s]: the initial guess of the next
    step.

    0 where the fluid does not use it."""
    rho: tuple[wp.array, ...]
    """The densities of the fluid at centres, in their order, without unit."""
    p_x: wp.array
    """Positions of points of the picture along x [cells from the left edge], one entry per point."""
    p_y: wp.array
    """Positions of points of the picture along y [cells from the top edge], one entry per point."""

    def __repr__(self) -> str:
        nx, ny = self.grid.nx, self.grid.ny
        return f"State({nx} x {ny} cells, {len(self.rho)} densities, {len(self.p_x)} points)"

    @classmethod
    def at_rest(cls, grid: Grid, device: wp.Device, densities: int = 0, points: int = 0) -> State:
        """A fluid at rest: velocity, displacement, pressure and densities are 0, all points at the origin."""
        layout = Layout(grid.nx, grid.ny)
        fields = {name: field(layout, device) for name in FIELDS}
        particles = {name: zeros(points, device) for name in PARTICLES}
        return cls(grid, rho=vector(layout, device, densities), **fields, **particles)

    @property
    def fields(self) -> list[wp.array]:
        """All arrays over the grid."""
        return [*(getattr(self, name) for name in FIELDS), *self.rho]

    @property
    def particles(self) -> list[wp.array]:
        """Positions of the points along x and y."""
        return [getattr(self, name) for name in PARTICLES]

    @property
    def arrays(self) -> list[wp.array]:
        """All arrays that have entries."""
        return [a for a in (*self.fields, *self.particles) if a.size]

    @property
    def seen(self) -> list[wp.array]:
        """Arrays that objectives and pictures read: displacement, points, densities."""
        return [self.d_x, self.d_y, *self.particles, *self.rho]

    def view(self) -> State:
        """A state over the same memory, whose arrays may have other gradients."""
        return self._with_each(view)

    def copy(self) -> State:
        """A state with the same values in new arrays."""
        return self._with_each(clone)

    def _with_each(self, change: Callable[[wp.array], wp.array]) -> State:
        """A state with `change` applied to each array."""
        arrays = {name: change(getattr(self, name)) for name in (*FIELDS, *PARTICLES)}
        return State(self.grid, rho=tuple(change(rho) for rho in self.rho), **arrays)

    def copy_into(self, other: State) -> None:
        """Write the values into another state with the same grid, densities and points."""
        for a, b in zip(self.arrays, other.arrays, strict=True):
            copy(a, b)

    def zero_(self) -> None:
        """Set all arrays to 0, in place."""
        fill(0.0, *self.arrays)

    @property
    def finite(self) -> bool:
        """Whether all values are finite."""
        return finite(self.arrays)

    def take_gradient(self, bar: State) -> None:
        """Make the arrays of `bar` the gradients of these arrays."""
        pairs = zip((*self.fields, *self.particles), (*bar.fields, *bar.particles), strict=True)
        for a, b in pairs:
            a.grad = b

    @property
    def layout(self) -> Layout:
        """Layout of the cells in the arrays."""
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
        """Positions of the points [longer side]: (points, 2), x and y, a copy."""
        columns = [read(p).astype(np.float64) for p in self.particles]
        return np.stack(columns, axis=1) * (self.grid.hx, self.grid.hy)
