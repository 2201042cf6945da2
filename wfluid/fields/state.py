"""The fluid at one time: arrays only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import clone, copy, field, fill, finite, read, to_numpy, vector, view, zeros
from wfluid.kernels.cell.layout import Layout

FIELDS = ("u", "v", "d_x", "d_y", "q")
"""Arrays of a state over the grid, beside its densities."""

PARTICLES = ("p_x", "p_y")
"""Arrays of a state with an entry a point."""


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
        fields = {name: field(layout, device) for name in FIELDS}
        particles = {name: zeros(points, device) for name in PARTICLES}
        return cls(grid, rho=vector(layout, device, densities), **fields, **particles)

    @property
    def fields(self) -> list[wp.array]:
        """Every array over the grid."""
        return [*(getattr(self, name) for name in FIELDS), *self.rho]

    @property
    def particles(self) -> list[wp.array]:
        """Where points are along x and y."""
        return [getattr(self, name) for name in PARTICLES]

    @property
    def arrays(self) -> list[wp.array]:
        """Every array that has entries."""
        return [a for a in (*self.fields, *self.particles) if a.size]

    @property
    def seen(self) -> list[wp.array]:
        """What is seen of it: the map, the points, the densities."""
        return [self.d_x, self.d_y, *self.particles, *self.rho]

    def view(self) -> State:
        """The same memory in arrays of its own, which may have other gradients."""
        return self._with_each(view)

    def copy(self) -> State:
        """The same values in arrays of their own."""
        return self._with_each(clone)

    def _with_each(self, change: Callable[[wp.array], wp.array]) -> State:
        """A state whose arrays are made of this one's, each by itself."""
        arrays = {name: change(getattr(self, name)) for name in (*FIELDS, *PARTICLES)}
        return State(self.grid, rho=tuple(change(rho) for rho in self.rho), **arrays)

    def copy_into(self, other: State) -> None:
        """Write its values into another state of the same grid, densities and points."""
        for a, b in zip(self.arrays, other.arrays, strict=True):
            copy(a, b)

    def zero_(self) -> None:
        """Write 0 into every array, in place."""
        fill(0.0, *self.arrays)

    @property
    def finite(self) -> bool:
        """Whether every number of it is finite."""
        return finite(self.arrays)

    def take_gradient(self, bar: State) -> None:
        """Let the arrays of `bar` hold the gradients."""
        pairs = zip((*self.fields, *self.particles), (*bar.fields, *bar.particles), strict=True)
        for a, b in pairs:
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
        columns = [read(p).astype(np.float64) for p in self.particles]
        return np.stack(columns, axis=1) * (self.grid.hx, self.grid.hy)
