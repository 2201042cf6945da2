"""Gaussian forces on the device, in groups that share a weight: those that push, and those that grow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.grid import Grid
from wfluid.kernels import forces, forces_adjoint, krylov, sources
from wfluid.kernels.cells import Layout, Real
from wfluid.kernels.strips import alone
from wfluid.painted import Painted
from wfluid.state import Vector, field, from_numpy, vector
from wfluid.walls import Ghosts, Walls


class _Gaussians:
    """Forces `members`, counted among all, with one weight."""

    def __init__(
        self,
        weight: Painted | None,
        members: Sequence[int],
        grid: Grid,
        walls: Walls,
        device: wp.Device,
        gradients: bool,
    ):
        self.members, self.device, self.layout = members, device, Layout(grid.nx, grid.ny)
        self.blobs = Blobs(len(members), grid, walls, device, gradients)
        self._weights = None
        if weight is not None:
            self._weights = field(self.layout, device)
            from_numpy(weight.on(grid), self._weights, self.layout)
            Ghosts(self.layout, walls.centre_rules(), device).fill(self._weights)


class Pushes(_Gaussians):
    """Gaussian forces with one weight."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._gained = vector(self.layout, self.device, 2) if self._weights is not None else ()

    def add(self, velocity: Vector) -> None:
        """Add what they gain to the velocity, in place: launches only."""
        if not self._gained:
            self.blobs.push(velocity)
            return
        gained = self._gained
        alone(lambda: [f.zero_() for f in gained])
        self.blobs.push(gained)
        for f, component, before in zip(gained, velocity, (1, self.layout.pitch), strict=True):
            inputs = [f, self._weights, before]
            forces.push_weighted.launch(self.layout, self.device, inputs, [component])

    def adjoint(self, velocity_bar: Vector) -> None:
        """The transpose of `add`, down to the moments of the Gaussians: launches only."""
        if self._gained:
            for f_bar, gained, before in zip(velocity_bar, self._gained, (1, self.layout.pitch), strict=True):
                inputs = [f_bar, self._weights, before]
                forces_adjoint.weighted.launch(self.layout, self.device, inputs, [gained])
        self.blobs.measure_push(self._gained or velocity_bar)

    def gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The gradient with respect to rows of numbers, from the moments `adjoint` took."""
        return self.blobs.push_gradient(numbers, moments)


class Growths(_Gaussians):
    """Growths with one weight: their divergence is a field first, of which the mean is taken off."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._swell = field(self.layout, self.device)
        self._ones = wp.full(self.layout.size, 1.0, dtype=Real, device=self.device)
        self._rows = wp.zeros(self.layout.ny, dtype=Real, device=self.device)
        self.mean = wp.zeros(1, dtype=Real, device=self.device)

    mean: wp.array
    """What was taken off [1/s]."""

    def add(self, b: wp.array) -> None:
        """Add what they prescribe to b, in place: launches only."""
        alone(self._swell.zero_)
        self.blobs.swell(self._swell)
        if self._weights is not None:
            sources.weigh.launch(self.layout, self.device, [self._weights], [self._swell])
        self._add_balanced(self._swell, b)

    def _add_balanced(self, s: wp.array, b: wp.array) -> None:
        nx, ny = self.layout.nx, self.layout.ny
        inputs = [s, self._ones, nx, self.layout.pitch, 0]
        krylov.row_products.launch(ny, self.device, inputs, [self._rows])
        krylov.mean_of.launch(1, self.device, [self._rows, ny, nx * ny], [self.mean])
        sources.add_balanced.launch(self.layout, self.device, [s, self.mean], [b])

    def adjoint(self, minus_b_bar: wp.array) -> None:
        """The transpose of `add`, down to the moments of the Gaussians, all with minus: launches only."""
        minus_s_bar = self._swell
        alone(minus_s_bar.zero_)
        self._add_balanced(minus_b_bar, minus_s_bar)
        if self._weights is not None:
            sources.weigh.launch(self.layout, self.device, [self._weights], [minus_s_bar])
        self.blobs.measure_centres(minus_s_bar)

    def gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The gradient with respect to rows of numbers, from the moments `adjoint` took."""
        return -self.blobs.swell_gradient(numbers, moments)
