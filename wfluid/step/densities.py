"""A density's part of a step: carried along the flow, poured by its sources, diffused; with the transpose."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import Vector, entries, field, from_numpy, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.adjoint import transport as transport_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import sources, transport
from wfluid.model.densities import Density, PaintedSource, Source
from wfluid.model.fluid import Fluid
from wfluid.solve.multigrid import Location
from wfluid.solve.system import SolveMethod
from wfluid.step.diffusion import ScalarDiffusion
from wfluid.step.gaussians import GaussianBatch
from wfluid.step.tape import bars, record


class DensitySources:
    """The sources of one density."""

    def __init__(self, density: Density, grid: Grid, walls: Walls, device: wp.Device, gradients: bool):
        self.device, self.layout = device, Layout(grid.nx, grid.ny)
        self._round = [n for n, source in enumerate(density.sources) if isinstance(source, Source)]
        self.blobs = GaussianBatch(len(self._round), grid, walls, device, gradients) if self._round else None
        self._painted = [n for n, source in enumerate(density.sources) if isinstance(source, PaintedSource)]
        self._fields = [field(self.layout, device) for _ in self._painted]
        for n, f in zip(self._painted, self._fields, strict=True):
            from_numpy(density.sources[n].paint.sample(grid), f, self.layout)
        self._inner = InnerProduct(self.layout, device)

        self._impulses: list[wp.array] = []
        self._impulses_bar: list[wp.array] = []

    blobs: GaussianBatch | None
    """The round sources."""

    @property
    def painted(self) -> int:
        """How many sources are painted."""
        return len(self._painted)

    def bind(self, impulses: wp.array, impulses_bar: wp.array) -> None:
        """Where the painted sources' impulses are on the device, and their gradients."""
        self._impulses, self._impulses_bar = entries(impulses), entries(impulses_bar)

    def impulses(self, density: Density, start: float, end: float) -> list[float]:
        """What the painted sources do from `start` to `end` [s]."""
        return [density.sources[n].envelope.integral(start, end) for n in self._painted]

    def row(self, density: Density, start: float, end: float, live: bool) -> tuple[np.ndarray, np.ndarray]:
        """The numbers and boxes of the round sources; `live` as for `Forcing.row`."""
        poured = [density.sources[n] for n in self._round]
        alive = [live and source.envelope.acts(start, end) for source in poured]
        return self.blobs.row([source.impulse(start, end) for source in poured], alive)

    def add(self, rho: wp.array) -> None:
        """Add what they pour to the density, in place: launches only."""
        if self.blobs:
            self.blobs.pour(rho)
        for f, impulse in zip(self._fields, self._impulses, strict=True):
            sources.pour_field.launch(self.layout, self.device, [f, impulse], [rho])

    def adjoint(self, rho_bar: wp.array) -> None:
        """The transpose of `add` with respect to the sources' numbers: launches only."""
        if self.blobs:
            self.blobs.measure_centres(rho_bar)
        for f, out in zip(self._fields, self._impulses_bar, strict=True):
            self._inner.dot([rho_bar], [f], out)

    def gradients(
        self, numbers: np.ndarray, moments: np.ndarray, impulses_bar: np.ndarray
    ) -> dict[int, np.ndarray]:
        """For each source, by its number, the gradient with respect to what it does in each step."""
        bars = {n: column[:, None] for n, column in zip(self._painted, impulses_bar.T, strict=True)}
        if self.blobs:
            table = self.blobs.pour_gradient(numbers, moments)
            bars.update((n, table[:, :, place].T) for place, n in enumerate(self._round))
        return bars


class DensityTransport:
    """Steps one density of a fluid."""

    def __init__(self, density: Density, grid: Grid, fluid: Fluid, device: wp.Device):
        self.density, self.device, self.layout = density, device, Layout(grid.nx, grid.ny)
        rules = fluid.walls.centre_rules()
        self._ghosts = Ghosts(self.layout, rules, device)
        self._diffusion = None
        if density.diffusion:
            self._diffusion = ScalarDiffusion(grid, fluid, Location(rules), device, conserved=True)
        self._carried = field(self.layout, device)
        self._initial = None if density.initial is None else density.initial.sample(grid)

    def begin(self, rho: wp.array) -> None:
        """Give a density its initial values."""
        if self._initial is not None:
            from_numpy(self._initial, rho, self.layout)
            self._ghosts.fill(rho)

    def plan(self, dt: float) -> SolveMethod:
        """Make ready for steps of dt; what the diffusion's solve will be."""
        return (
            self._diffusion.plan(dt * self.density.diffusion) if self._diffusion else SolveMethod("none", 0)
        )

    def allow_gradients(self) -> None:
        """Allocate what the transpose needs."""
        self._carried_bar, *self._foot_bar = vector(self.layout, self.device, 3)

    def _diffuses(self) -> bool:
        return bool(self._diffusion and self._diffusion.method.iterations)

    def advance(
        self, rho: wp.array, foot: Vector, where: Sequence[int], sources: DensitySources, out: wp.array
    ) -> None:
        """out = the density a step later, with ghosts, and with what its sources pour: launches only."""
        carried = self._carried if self._diffuses() else out
        transport.carry_density.launch(self.layout, self.device, [rho, *foot, *where], [carried])
        sources.add(carried)
        self._ghosts.fill(carried)
        if self._diffuses():
            self._diffusion.diffuse(carried, out)
        record(partial(self._advance_back, rho, foot, where, sources, out), [rho, *foot], [out])

    def _advance_back(
        self, rho: wp.array, foot: Vector, where: Sequence[int], sources: DensitySources, out: wp.array
    ) -> None:
        """Add to the gradients of the density and of the feet; find those of the sources."""
        carried_bar = out.grad
        if self._diffuses():
            carried_bar = self._carried_bar
            self._diffusion.adjoint(out.grad, carried_bar)
        sources.adjoint(carried_bar)
        inputs, outputs = [rho, *foot, carried_bar, *where], [rho.grad, *self._foot_bar]
        transport_adjoint.carry_density_adjoint.launch(self.layout, self.device, inputs, outputs, turn=0)
        self._ghosts.fold(rho.grad)
        for f, to in zip(self._foot_bar, bars(foot), strict=True):
            algebra.add.launch(self.layout, self.device, [f], [to])
