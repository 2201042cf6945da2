"""Transfer between the grids of a hierarchy: prolongation, and restriction as its scaled transpose."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import warp as wp

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import Vector, field, upload, upload_rows
from wfluid.fields.ghosts import ghost_table
from wfluid.kernels.cell.layout import HALO, Layout, whole_spans
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import transfer
from wfluid.solve.multigrid import Level, Location


class Transfer:
    """Restriction from a level to the next coarser one, and prolongation back."""

    def __init__(self, fine: Level, coarse: Level, device: wp.Device):
        self.components = [
            _Interpolation(fine.layout, coarse.layout, points, device) for points in fine.points
        ]
        self.fine, self.coarse = fine, coarse

    def restrict(self, r: Vector, out: Vector) -> None:
        """out = R r: R is the transpose of prolongation times the ratio of the two cell areas.

        Fills the ghosts of out.
        """
        with together():
            for component, f in zip(self.components, r, strict=True):
                component.down.along_y(f)
        with together():
            for component, f in zip(self.components, out, strict=True):
                component.down.along_x(f)
        self.coarse.fill(out)

    def prolong_add(self, x: Vector, e: Vector, out: Vector) -> None:
        """out = x + e interpolated to the fine grid. Reads the ghosts of e, fills those of out."""
        with together():
            for component, correction in zip(self.components, e, strict=True):
                component.along_x(correction)
        with together():
            for component, f, to in zip(self.components, x, out, strict=True):
                component.add_along_y(f, to)
        self.fine.fill(out)


class _Interpolation:
    """Linear interpolation of one component from a coarse to a fine grid, and its transpose."""

    def __init__(self, fine: Layout, coarse: Layout, points: Location, device: wp.Device):
        self.fine, self.coarse, self.device = fine, coarse, device
        x, y = (
            _interpolation(n, m, rule, on_faces)
            for n, m, rule, on_faces in zip(
                (fine.nx, fine.ny), (coarse.nx, coarse.ny), points.rules, points.on_faces, strict=True
            )
        )
        self.down = WeightedSums(fine, coarse, _transposed(*x), _transposed(*y), device)
        self.up_x, self.up_y = (_padded(axis[0] + HALO, axis[1], device) for axis in (x, y))

    def along_x(self, e: wp.array) -> None:
        """Interpolate e along its rows to the columns of the fine grid."""
        inputs, rows = [e, *self.up_x, self.coarse.pitch], (-1, self.coarse.ny + 1)
        transfer.prolong_x.launch(self.down.strip, self.device, inputs, [self.down.between], rows=rows)

    def add_along_y(self, x: wp.array, out: wp.array) -> None:
        """out = x + the result of `along_x`, interpolated to the rows of the fine grid."""
        inputs = [x, self.down.between, *self.up_y, self.down.strip.pitch]
        transfer.prolong_y_add.launch(self.fine, self.device, inputs, [out])


class WeightedSums:
    """For each point of a coarse grid, the weighted sum of at most 4 x 4 points of a fine grid."""

    def __init__(self, fine: Layout, coarse: Layout, x: list[dict], y: list[dict], device: wp.Device):
        self.fine, self.coarse, self.device = fine, coarse, device
        self.strip = Layout(fine.nx, coarse.ny)
        self.between = field(self.strip, device)
        self._x, self._y = _tables(x, device), _tables(y, device)

    def along_y(self, f: wp.array) -> None:
        """Sum f over rows, with the weights along y."""
        inputs = [f, *self._y, self.fine.pitch]
        transfer.restrict_y.launch(self.strip, self.device, inputs, [self.between])

    def along_x(self, out: wp.array) -> None:
        """out = the result of `along_y` summed over columns, with the weights along x.

        Does not fill the ghosts of out.
        """
        inputs = [self.between, *self._x, self.strip.pitch]
        transfer.restrict_x.launch(self.coarse, self.device, inputs, [out])


class Averaging:
    """Means of a coefficient over the area of each point of the next coarser grid.

    Along an axis on whose faces the coefficient is given, the mean has the weights of a hat function, as the
    interpolation of the correction has. The coarse operator then has the energy of the fine one; plain means
    of faces overestimate it by any factor where the coefficient jumps.
    """

    def __init__(
        self,
        fine: Layout,
        coarse: Layout,
        device: wp.Device,
        on_faces: tuple[bool, bool] = (False, False),
        periodic: tuple[bool, bool] = (False, False),
    ):
        x, y = (
            _hats(n, m, wraps) if faces else _means(n, m)
            for n, m, faces, wraps in zip(
                (fine.nx, fine.ny), (coarse.nx, coarse.ny), on_faces, periodic, strict=True
            )
        )
        self._collection = WeightedSums(fine, coarse, x, y, device)

    def average(self, f: wp.array, out: wp.array) -> None:
        """out = the means of f. Does not fill the ghosts of out."""
        self._collection.along_y(f)
        self._collection.along_x(out)


def _interpolation(n: int, m: int, rule: Rule, on_faces: bool):
    """Linear interpolation from m coarse points of an axis to n fine ones.

    Returns for each fine point the coarse point before it (from -1) and the fraction past that point; and the
    ghost table of the coarse axis.
    """
    i = np.arange(n)
    position = i * (m / n) if on_faces else (i + 0.5) * (m / n) - 0.5
    before = np.floor(position).astype(int)
    return before, position - before, ghost_table(m, rule)


def _transposed(before: np.ndarray, fraction: np.ndarray, ghosts) -> list[dict[int, float]]:
    """The transpose of an interpolation, times the ratio of point counts m / n.

    Returns for each coarse point the weights of the fine points, by their index. Weights of ghosts are added
    to those of the points that the ghosts copy.
    """
    source, sign = ghosts
    m, n = len(source) - 2 * HALO, len(before)
    collected: list[dict[int, float]] = [{} for _ in range(m)]
    for i in range(n):
        for point, weight in ((before[i], 1 - fraction[i]), (before[i] + 1, fraction[i])):
            entry = point + HALO
            if weight * sign[entry] != 0:
                to = collected[source[entry]]
                to[i] = to.get(i, 0.0) + weight * sign[entry] * m / n
    return collected


def _means(n: int, m: int) -> list[dict[int, float]]:
    """For each of m coarse cells on an axis, the part of it that each of n fine cells covers, by index."""
    edges = np.arange(m + 1) * (n / m)
    covered = []
    for start, end in pairwise(edges):
        cells = range(int(np.floor(start + 1e-9)), int(np.ceil(end - 1e-9)))
        covered.append({i: (min(end, i + 1) - max(start, i)) / (end - start) for i in cells})
    return covered


def _hats(n: int, m: int, periodic: bool) -> list[dict[int, float]]:
    """For each of m coarse faces, the weights of n fine faces under its hat function, by index; sum 1."""
    weights = np.zeros((m, n))
    for c in range(m):
        distance = np.abs(np.arange(n) * (m / n) - c)
        if periodic:
            distance = np.minimum(distance, m - distance)
        weights[c] = np.maximum(0.0, 1.0 - distance)
    weights /= weights.sum(axis=1, keepdims=True)
    return [{int(i): float(row[i]) for i in np.flatnonzero(row)} for row in weights]


def _tables(collected: list[dict[int, float]], device: wp.Device):
    """Tables over coarse points: four of fine points, as indices with the halo, and four of their weights."""
    room = whole_spans(len(collected))
    points, weights = np.full((4, room), HALO), np.zeros((4, room))
    for c, terms in enumerate(collected):
        for slot, (i, weight) in enumerate(terms.items()):
            points[slot, c], weights[slot, c] = i + HALO, weight
    return *upload_rows(points, device, wp.int32), *upload_rows(weights, device)


def _padded(before: np.ndarray, fraction: np.ndarray, device: wp.Device):
    """Interpolation tables of an axis, padded to full spans."""
    room = whole_spans(len(before)) - len(before)
    return (
        upload(np.pad(before, (0, room), constant_values=HALO), device, wp.int32),
        upload(np.pad(fraction, (0, room)), device),
    )
