"""What a density's sources pour in one step, on the device."""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.density import Density, PaintedSource, Source
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
        self.blobs = Blobs(len(self._round), grid, walls, device, gradients) if self._round else None
        self._painted = [n for n, source in enumerate(density.sources) if isinstance(source, PaintedSource)]
        self._fields = [field(self.layout, device) for _ in self._painted]
        for n, f in zip(self._painted, self._fields, strict=True):
            from_numpy(density.sources[n].paint.on(grid), f, self.layout)
        self._rows = wp.zeros(grid.ny, dtype=Real, device=device)

    blobs: Blobs | None
    """The round sources."""

    @property
    def painted(self) -> int:
        """How many sources are painted."""
        return len(self._painted)

    def bind(self, impulses: wp.array, impulses_bar: wp.array) -> None:
        """Where the painted sources' impulses are on the device, and their gradients."""
        self._impulses, self._impulses_bar = impulses, impulses_bar

    def impulses(self, density: Density, start: float, end: float) -> list[float]:
        """What the painted sources do from `start` to `end` [s]."""
        return [density.sources[n].envelope.integral(start, end) for n in self._painted]

    def row(self, density: Density, start: float, end: float, live: bool) -> tuple[np.ndarray, np.ndarray]:
        """The numbers and boxes of the round sources; `live` as for `Impulses.row`."""
        poured = [density.sources[n] for n in self._round]
        alive = [live and source.envelope.acts(start, end) for source in poured]
        return self.blobs.row([source.over(start, end) for source in poured], alive)

    def add(self, rho: wp.array) -> None:
        """Add what they pour to the density, in place: launches only."""
        if self.blobs:
            self.blobs.pour(rho)
        for n, f in enumerate(self._fields):
            inputs = [f, self._impulses[n : n + 1]]
            sources.pour_field.launch(self.layout, self.device, inputs, [rho])

    def adjoint(self, rho_bar: wp.array) -> None:
        """The transpose of `add` with respect to the sources' numbers: launches only."""
        if self.blobs:
            self.blobs.measure_centres(rho_bar)
        nx, ny, pitch = self.layout.nx, self.layout.ny, self.layout.pitch
        for n, f in enumerate(self._fields):
            krylov.row_products.launch(ny, self.device, [rho_bar, f, nx, pitch, 0], [self._rows])
            out = self._impulses_bar[n : n + 1]
            krylov.mean_of.launch(1, self.device, [self._rows, ny, 1], [out])

    def gradients(
        self, numbers: np.ndarray, moments: np.ndarray, impulses_bar: np.ndarray
    ) -> dict[int, np.ndarray]:
        """For each source, by its number, the gradient with respect to what it does in each step."""
        bars = {n: column[:, None] for n, column in zip(self._painted, impulses_bar.T, strict=True)}
        if self.blobs:
            table = self.blobs.pour_gradient(numbers, moments)
            bars.update((n, table[:, :, place].T) for place, n in enumerate(self._round))
        return bars
