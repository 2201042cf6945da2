"""A density's part of a step: advection, its sources, diffusion; with the transpose."""

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
        count = len(self._round)
        self.gaussians = GaussianBatch(count, grid, walls, device, gradients) if count else None
        self._painted: list[int] = []
        self._fields: list[wp.array] = []
        for n, source in enumerate(density.sources):
            if isinstance(source, PaintedSource):
                self._painted.append(n)
                self._fields.append(field(self.layout, device))
                from_numpy(source.paint.sample(grid), self._fields[-1], self.layout)
        self._inner = InnerProduct(self.layout, device)
        self._impulses: list[wp.array] = []
        self._impulses_bar: list[wp.array] = []

    gaussians: GaussianBatch | None
    """The round sources."""

    @property
    def painted(self) -> int:
        """Number of painted sources."""
        return len(self._painted)

    def bind(self, impulses: wp.array, impulses_bar: wp.array) -> None:
        """Set the device arrays of the painted sources' impulses and of their gradients."""
        self._impulses, self._impulses_bar = entries(impulses), entries(impulses_bar)

    def impulses(self, density: Density, start: float, end: float) -> list[float]:
        """The time integrals of the painted sources from `start` to `end` [s]."""
        return [density.sources[n].envelope.integral(start, end) for n in self._painted]

    def row(
        self, density: Density, start: float, end: float, act_at_zero: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """The numbers and boxes of the round sources in a step; `act_at_zero` as for `Forcing.row`."""
        if not self.gaussians:
            return np.empty(0), np.empty(0, dtype=np.int32)
        poured = [source for source in density.sources if isinstance(source, Source)]
        forced = [act_at_zero and source.envelope.acts(start, end) for source in poured]
        return self.gaussians.row([source.impulse(start, end) for source in poured], forced)

    def add(self, rho: wp.array) -> None:
        """Add the sources to the density, in place: launches only."""
        if self.gaussians:
            self.gaussians.pour(rho)
        for f, impulse in zip(self._fields, self._impulses, strict=True):
            sources.pour_field.launch(self.layout, self.device, [f, impulse], [rho])

    def adjoint(self, rho_bar: wp.array) -> None:
        """The transpose of `add` with respect to the sources' numbers: launches only."""
        if self.gaussians:
            self.gaussians.measure_centres(rho_bar)
        for f, out in zip(self._fields, self._impulses_bar, strict=True):
            self._inner.dot([rho_bar], [f], out)

    def gradients(
        self, numbers: np.ndarray, moments: np.ndarray, impulses_bar: np.ndarray
    ) -> dict[int, np.ndarray]:
        """By the source's number, the gradient with respect to its Gaussian or integral in each step."""
        bars = {n: column[:, None] for n, column in zip(self._painted, impulses_bar.T, strict=True)}
        if self.gaussians:
            table = self.gaussians.pour_gradient(numbers, moments)
            bars.update((n, table[:, :, place].T) for place, n in enumerate(self._round))
        return bars


class DensityTransport:
    """The stage of one density of a fluid."""

    def __init__(self, density: Density, grid: Grid, fluid: Fluid, device: wp.Device):
        self.density, self.device, self.layout = density, device, Layout(grid.nx, grid.ny)
        rules = fluid.boundary.centre_rules()
        self._ghosts = Ghosts(self.layout, rules, device)
        self._diffusion = None
        if density.diffusion:
            self._diffusion = ScalarDiffusion(grid, fluid, Location(rules), device, conserved=True)
        self._carried = field(self.layout, device)
        self._initial = None if density.initial is None else density.initial.sample(grid)

    def begin(self, rho: wp.array) -> None:
        """Set a density to its initial values."""
        if self._initial is not None:
            from_numpy(self._initial, rho, self.layout)
            self._ghosts.fill(rho)

    def plan(self, dt: float) -> SolveMethod:
        """Set up steps of dt. Returns the method of the diffusion's solve, "none" without diffusion."""
        if self._diffusion is None:
            return SolveMethod("none", 0)
        return self._diffusion.plan(dt * self.density.diffusion)

    def allow_gradients(self) -> None:
        """Allocate the arrays of the transpose."""
        self._carried_bar, *self._foot_bar = vector(self.layout, self.device, 3)

    def _active_diffusion(self) -> ScalarDiffusion | None:
        """The diffusion, if steps of the planned length have any."""
        return self._diffusion if self._diffusion and self._diffusion.method.iterations else None

    def advance(
        self, rho: wp.array, foot: Vector, lookup_args: Sequence[int], sources: DensitySources, out: wp.array
    ) -> None:
        """out = the density after advection, sources and diffusion, with ghosts: launches only."""
        diffusion = self._active_diffusion()
        carried = self._carried if diffusion else out
        transport.carry_density.launch(self.layout, self.device, [rho, *foot, *lookup_args], [carried])
        sources.add(carried)
        self._ghosts.fill(carried)
        if diffusion:
            diffusion.diffuse(carried, out)
        record(partial(self._advance_back, rho, foot, lookup_args, sources, out), [rho, *foot], [out])

    def _advance_back(
        self, rho: wp.array, foot: Vector, lookup_args: Sequence[int], sources: DensitySources, out: wp.array
    ) -> None:
        """Add to the gradients of the density and of the feet; compute those of the sources."""
        carried_bar, diffusion = out.grad, self._active_diffusion()
        if diffusion:
            carried_bar = self._carried_bar
            diffusion.adjoint(out.grad, carried_bar)
        sources.adjoint(carried_bar)
        inputs, outputs = [rho, *foot, carried_bar, *lookup_args], [rho.grad, *self._foot_bar]
        transport_adjoint.carry_density_adjoint.launch(self.layout, self.device, inputs, outputs, turn=0)
        self._ghosts.fold(rho.grad)
        for f, to in zip(self._foot_bar, bars(foot), strict=True):
            algebra.add.launch(self.layout, self.device, [f], [to])
