"""A density's part of a step: carried along the flow, poured, diffused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.density import Density, PaintedSource, Source
from wfluid.diffusion import ScalarDiffusion
from wfluid.fluid import Fluid
from wfluid.grid import Grid
from wfluid.kernels import sources, transport
from wfluid.kernels.cells import Layout, Real
from wfluid.linear import Solve
from wfluid.multigrid import Points
from wfluid.state import Vector, field, from_numpy
from wfluid.walls import Ghosts


class DensityTransport:
    """Steps one density of a fluid."""

    def __init__(self, density: Density, grid: Grid, fluid: Fluid, device: wp.Device):
        self.density, self.device, self.layout = density, device, Layout(grid.nx, grid.ny)
        rules = fluid.walls.centre_rules()
        self._ghosts = Ghosts(self.layout, rules, device)
        self._diffusion = None
        if density.diffusion:
            self._diffusion = ScalarDiffusion(grid, fluid, Points(rules), device, conserved=True)
        self._carried = field(self.layout, device)
        self._poured = [source for source in density.sources if isinstance(source, Source)]
        self._blobs = Blobs(len(self._poured), grid, fluid.walls, device) if self._poured else None
        self._painted = [source for source in density.sources if isinstance(source, PaintedSource)]
        self._fields = [field(self.layout, device) for _ in self._painted]
        for source, f in zip(self._painted, self._fields, strict=True):
            from_numpy(source.paint.on(grid), f, self.layout)
        self._impulses = wp.zeros(len(self._painted), dtype=Real, device=device)
        self._initial = None if density.initial is None else density.initial.on(grid)

    def begin(self, rho: wp.array) -> None:
        """Give a density its initial values."""
        if self._initial is not None:
            from_numpy(self._initial, rho, self.layout)
            self._ghosts.fill(rho)

    def plan(self, dt: float) -> Solve:
        """Make ready for steps of dt; what the diffusion's solve will be."""
        return self._diffusion.plan(dt * self.density.diffusion) if self._diffusion else Solve("none", 0)

    def set(self, start: float, end: float) -> None:
        """Put what the sources do from `start` to `end` [s] on the device."""
        if self._blobs:
            self._blobs.set([source.over(start, end) for source in self._poured])
        if self._painted:
            integrals = [source.envelope.integral(start, end) for source in self._painted]
            self._impulses.assign(np.array(integrals))

    def advance(self, rho: wp.array, foot: Vector, where: Sequence[int], out: wp.array) -> None:
        """Out = the density a step later, with ghosts: launches only."""
        diffuses = self._diffusion and self._diffusion.how.iterations
        carried = self._carried if diffuses else out
        inputs = [rho, *foot, *where]
        transport.carry_density.launch(self.layout, self.device, inputs, [carried])
        if self._blobs:
            self._blobs.pour(carried)
        for n, f in enumerate(self._fields):
            inputs = [f, self._impulses[n : n + 1]]
            sources.pour_field.launch(self.layout, self.device, inputs, [carried])
        self._ghosts.fill(carried)
        if diffuses:
            self._diffusion.diffuse(carried, out)
