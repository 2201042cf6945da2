"""The adjoint of a look-up: from gradients with respect to pixels to those with respect to displacements.

Host side of `kernels/adjoint/lookup.py`.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import fill, upload, vector
from wfluid.fields.ghosts import ghost_table
from wfluid.kernels.adjoint import lookup as lookup_adjoint
from wfluid.kernels.cell.layout import HALO, Layout, whole_spans
from wfluid.kernels.cell.strips import alone, together
from wfluid.view.lookup import LookUp, cubic_weights

ADJOINTS = {
    "bilinear": lookup_adjoint.look_up_adjoint_bilinear,
    "cubic": lookup_adjoint.look_up_adjoint_cubic,
}
"""Adjoint programs of filters; the other filters have none."""


class LookUpAdjoint:
    """The transposed launches of a look-up, linearised about its last evaluation.

    `begin`, `read` for every four channels, `place` and `stretch`, in this order, contain launches only.
    x_bar is the gradient of an objective with respect to x. Gradients with respect to ghosts are added to
    cells.

    Raises:
        KeyError: a filter without an adjoint.
    """

    def __init__(self, look_up: LookUp):
        self._look_up, self._program = look_up, ADJOINTS[look_up.filter]
        grid, walls, device = look_up.grid, look_up.walls, look_up.device
        rules = (walls.displacement_x_rules(), walls.displacement_y_rules())
        self._columns = [transposed(grid.nx, look_up.width, along_x, device) for along_x, _ in rules]
        self._rows = [transposed(grid.ny, look_up.height, along_y, device) for _, along_y in rules]
        self.coordinates_bar = vector(look_up.layout, device, 2)
        self.stretched_bar = vector(look_up.strip, device, 2)

    coordinates_bar: tuple[wp.array, ...]
    """Gradient with respect to `LookUp.coordinates` [1/px of the source]; `read` adds to it."""
    stretched_bar: tuple[wp.array, ...]
    """Gradient with respect to displacements in rows of pixels and columns of cells, without ghosts."""

    def begin(self) -> None:
        """Set `coordinates_bar` to 0."""
        alone(lambda: fill(0.0, *self.coordinates_bar))

    def read(self, quad: int, shown_bar: wp.array) -> None:
        """Add to `coordinates_bar`, from the gradient with respect to `LookUp.shown[quad]`."""
        look_up, source = self._look_up, self._look_up.source
        inputs = [source.quads[quad], *look_up.coordinates, shown_bar, source.width, source.height]
        self._program.launch(
            look_up.layout, look_up.device, [*inputs, *look_up.edges], list(self.coordinates_bar)
        )

    def place(self) -> None:
        """Compute `stretched_bar` from `coordinates_bar`."""
        look_up = self._look_up
        axes = zip(self.coordinates_bar, self._columns, look_up.slopes, self.stretched_bar, strict=True)
        with together():
            for source_bar, table, slope, out in axes:
                inputs = [source_bar, *table, look_up.layout.pitch, slope]
                lookup_adjoint.stretch_x_adjoint.launch(look_up.strip, look_up.device, inputs, [out])

    def stretch(self, d_x_bar: wp.array, d_y_bar: wp.array) -> None:
        """Add to the gradients with respect to displacements [1/cells], without ghosts."""
        look_up = self._look_up
        layout = Layout(look_up.grid.nx, look_up.grid.ny)
        with together():
            for f, (first, *table), out in zip(
                self.stretched_bar, self._rows, (d_x_bar, d_y_bar), strict=True
            ):
                inputs = [f, first, first[1:], *table, look_up.strip.pitch]
                lookup_adjoint.stretch_y_adjoint.launch(layout, look_up.device, inputs, [out])


def transposed(cells: int, pixels: int, rule: Rule, device: wp.Device) -> list[wp.array]:
    """The transposed interpolation from cells to pixels of one axis, with ghosts replaced by a wall's rule.

    A sparse matrix by rows: the index of the first entry of each cell, padded to complete spans; and the
    pixel and the weight of each entry, ordered by pixels within a cell.
    """
    before, weights = cubic_weights(cells, pixels)
    source, sign = ghost_table(cells, rule)
    padded = HALO + before[:pixels, None] + np.arange(-1, 3)
    cell, weight = source[padded].ravel(), (sign[padded] * weights[:, :pixels].T).ravel()
    order = np.argsort(cell, kind="stable")
    first = np.searchsorted(cell[order], np.arange(whole_spans(cells) + 1))
    return [
        upload(first, device, wp.int32),
        upload(order // 4, device, wp.int32),
        upload(weight[order], device),
    ]
