"""Sums over the cells of fields: inner products, means and norms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.fields.arrays import Vector, read, zeros
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import sums


class InnerProduct:
    """Sums over the cells of fields of one layout, for vectors of at most `components` components.

    Rows are summed first, into an array that belongs to the object: each call overwrites the last one's sums.
    """

    def __init__(self, layout: Layout, device: wp.Device, components: int = 1):
        self.layout, self.device = layout, device
        self._rows = zeros(components * layout.ny, device)
        self._largest = zeros(layout.ny, device)

    def along_rows(self, x: Sequence[wp.array], y: Sequence[wp.array]) -> wp.array:
        """The sums of x y over each row of each component: launches only."""
        layout = self.layout
        with together():
            for n, (f, g) in enumerate(zip(x, y, strict=True)):
                inputs = [f, g, layout.nx, layout.pitch, n * layout.ny]
                sums.row_products.launch(layout.ny, self.device, inputs, [self._rows])
        return self._rows

    def dot(self, x: Sequence[wp.array], y: Sequence[wp.array], out: wp.array) -> None:
        """out[0] = the sum of x y over all cells and components: launches only."""
        rows = self.along_rows(x, y)
        sums.mean_of.launch(1, self.device, [rows, len(x) * self.layout.ny, 1], [out])

    def mean(self, f: wp.array, out: wp.array) -> None:
        """out[0] = the mean of f over the cells: launches only."""
        nx, ny = self.layout.nx, self.layout.ny
        sums.row_sums.launch(ny, self.device, [f, nx, self.layout.pitch], [self._rows])
        sums.mean_of.launch(1, self.device, [self._rows, ny, nx * ny], [out])

    def total(self) -> float:
        """The sum over the rows of the last `along_rows`, in double precision."""
        return float(read(self._rows).sum(dtype=np.float64))

    def norm(self, x: Vector) -> float:
        """Euclidean norm of x over all cells and components."""
        return float(np.sqrt(sum(self._squares(f).sum(dtype=np.float64) for f in x)))

    def largest(self, f: wp.array) -> float:
        """Largest absolute value of f over the cells."""
        self._squares(f)
        return float(read(self._largest).max())

    def _squares(self, f: wp.array) -> np.ndarray:
        """The sum of the squares of f over each row; writes the largest absolute values to `_largest`."""
        layout = self.layout
        inputs = [f, layout.nx, layout.pitch]
        sums.row_norms.launch(layout.ny, self.device, inputs, [self._rows, self._largest])
        return read(self._rows)[: layout.ny]
