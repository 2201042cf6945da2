"""What a density's sources pour in one step, on the device."""

from __future__ import annotations

from copy import copy

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.density import Density, PaintedSource, Source
from wfluid.forces import Blob
from wfluid.grid import Grid
from wfluid.kernels import krylov, sources
from wfluid.kernels.cells import Layout, Real
from wfluid.state import field, from_numpy
from wfluid.walls import Walls


class Pouring:
    """The sources of one density."""

    def __init__(self, density: Density, grid: Grid, walls: Walls, device: wp.Device, gradients: bool):
        self.device, self.layout = device, Layout(grid.nx, grid.ny)
        self._round = [n for n, source in enumerate(density.sources) if isinstance(source, Source)]
        self._blobs = Blobs(len(self._round), grid, walls, device, gradients) if self._round else None
        self._painted = [n for n, source in enumerate(density.sources) if isinstance(source, PaintedSource)]
        self._fields = [field(self.layout, device) for _ in self._painted]
        for n, f in zip(self._painted, self._fields, strict=True):
            from_numpy(density.sources[n].paint.on(grid), f, self.layout)
        self._rows = wp.zeros(grid.ny, dtype=Real, device=device)
        self._allocate()

    def another(self) -> Pouring:
        """The same for another step: numbers of its own, working memory in common."""
        other = copy(self)
        other._blobs = self._blobs and self._blobs.another()
        other._allocate()
        return other

    def _allocate(self) -> None:
        count = len(self._painted)
        self._impulses, self._impulses_bar = (
            wp.zeros(count, dtype=Real, device=self.device) for _ in range(2)
        )

    def set(self, density: Density, start: float, end: float, live: bool) -> None:
        """Put what the sources do from `start` to `end` [s] on the device; `live` as for `Impulses.set`."""
        if self._blobs:
            poured = [density.sources[n] for n in self._round]
            alive = [live and source.envelope.acts(start, end) for source in poured]
            self._blobs.set([source.over(start, end) for source in poured], alive)
        if self._painted:
            integrals = [density.sources[n].envelope.integral(start, end) for n in self._painted]
            self._impulses.assign(np.array(integrals))

    def add(self, rho: wp.array) -> None:
        """Add what they pour to the density, in place: launches only."""
        if self._blobs:
            self._blobs.pour(rho)
        for n, f in enumerate(self._fields):
            inputs = [f, self._impulses[n : n + 1]]
            sources.pour_field.launch(self.layout, self.device, inputs, [rho])

    def adjoint(self, rho_bar: wp.array) -> None:
        """The transpose of `add` with respect to the sources' numbers: launches only."""
        if self._blobs:
            self._blobs.measure_centres(rho_bar)
        nx, ny, pitch = self.layout.nx, self.layout.ny, self.layout.pitch
        for n, f in enumerate(self._fields):
            krylov.row_products.launch(ny, self.device, [rho_bar, f, nx, pitch, 0], [self._rows])
            out = self._impulses_bar[n : n + 1]
            krylov.mean_of.launch(1, self.device, [self._rows, ny, 1], [out])

    def gradients(self) -> dict[int, Blob | list[float]]:
        """What the last `adjoint` found for each source, by its number."""
        bars: dict = dict(zip(self._painted, self._impulses_bar.numpy()[:, None].tolist(), strict=True))
        if self._blobs:
            bars.update(zip(self._round, self._blobs.pour_gradient(), strict=True))
        return bars
