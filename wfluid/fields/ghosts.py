"""Ghosts on the device: filled by the boundary rules, and the transpose of filling."""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import upload
from wfluid.kernels.adjoint import ghosts as ghosts_adjoint
from wfluid.kernels.cell.layout import HALO, Layout
from wfluid.kernels.step import ghosts


def ghost_table(n: int, rule: Rule) -> tuple[np.ndarray, np.ndarray]:
    """Source index 0 … n - 1 and sign of positions -2 … n + 1 of an axis of n cells: two arrays (n + 4,)."""
    i = np.arange(-HALO, n + HALO)
    if rule is Rule.PERIODIC:
        return i % n, np.ones(len(i))
    if rule is Rule.FACE:  # odd reflection about the points 0 and n, where the value is 0
        folded = i % (2 * n)
        source = np.where(folded <= n, folded, 2 * n - folded)
        sign = np.where(folded % n == 0, 0.0, np.where(folded < n, 1.0, -1.0))
        return np.where(sign == 0, min(1, n - 1), source), sign
    folded = i % (2 * n)  # reflect about the walls, half a cell outside 0 and n - 1
    inside = folded < n
    sign = np.where(inside, 1.0, -1.0 if rule is Rule.ODD else 1.0)
    return np.where(inside, folded, 2 * n - 1 - folded), sign


class Ghosts:
    """Fills the ghosts of fields of one layout, with one boundary rule per axis."""

    def __init__(self, layout: Layout, rules: tuple[Rule, Rule], device: wp.Device):
        self.layout = layout
        self.device = device
        self._tables = []
        for n, rule in zip((layout.nx, layout.ny), rules, strict=True):
            source, sign = ghost_table(n, rule)
            self._tables += [
                upload(source + HALO, device, wp.int32),
                upload(sign, device),
            ]

    def fill(self, f: wp.array) -> None:
        """Set the ghosts of f, and its faces on a wall, in place."""
        layout = self.layout
        ghosts.fill.launch(
            layout.ny + layout.nx + 2 * HALO,
            self.device,
            inputs=[*self._tables, layout.nx, layout.ny, layout.pitch],
            outputs=[f],
        )

    def fold(self, f_bar: wp.array) -> None:
        """The transpose of `fill`, in place: the gradient of a ghost is added to that of its source.

        The gradients of ghosts, and of faces on a wall, are then set to 0.
        """
        layout, (columns, rows) = self.layout, (self._tables[:2], self._tables[2:])
        inputs = [*rows, layout.ny, layout.pitch]
        ghosts_adjoint.fold_columns.launch(layout.nx + 2 * HALO, self.device, inputs, [f_bar])
        inputs = [*columns, layout.nx, layout.pitch]
        ghosts_adjoint.fold_rows.launch(layout.ny, self.device, inputs, [f_bar])
