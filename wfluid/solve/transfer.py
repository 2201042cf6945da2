"""Transfer between the grids of a hierarchy: prolongation, and restriction as its scaled transpose."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import warp as wp

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import Vector, field, upload
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
        """out = the transpose of the prolongation times the ratio of the cells' areas, applied to r."""
        with together():
            for component, f in zip(self.components, r, strict=True):
                component.down.along_y(f)
        with together():
            for component, to in zip(self.components, out, strict=True):
                component.down.along_x(to)
        self.coarse.fill(out)

    def prolong_add(self, x: Vector, e: Vector, out: Vector) -> None:
        """out = x + the interpolated e; e with ghosts."""
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
        """Interpolate rows to the fine grid's columns."""
        inputs, rows = [e, *self.up_x, self.coarse.pitch], (-1, self.coarse.ny + 1)
        transfer.prolong_x.launch(self.down.strip, self.device, inputs, [self.down.between], rows=rows)

    def add_along_y(self, x: wp.array, out: wp.array) -> None:
        """out = x + what `along_x` made, interpolated to the fine grid's rows."""
        inputs = [x, self.down.between, *self.up_y, self.down.strip.pitch]
        transfer.prolong_y_add.launch(self.fine, self.device, inputs, [out])


class WeightedSums:
    """Sums of at most 4 x 4 points of a fine grid with weights, for each point of a coarse one."""

    def __init__(self, fine: Layout, coarse: Layout, x: list[dict], y: list[dict], device: wp.Device):
        self.fine, self.coarse, self.device = fine, coarse, device
        self.strip = Layout(fine.nx, coarse.ny)
        self.between = field(self.strip, device)
        self._x, self._y = _tables(x, device), _tables(y, device)

    def along_y(self, f: wp.array) -> None:
        """Sum rows."""
        inputs = [f, *self._y, self.fine.pitch]
        transfer.restrict_y.launch(self.strip, self.device, inputs, [self.between])

    def along_x(self, out: wp.array) -> None:
        """out = the sums over columns of what `along_y` made, without ghosts."""
        inputs = [self.between, *self._x, self.strip.pitch]
        transfer.restrict_x.launch(self.coarse, self.device, inputs, [out])


class Averaging:
    """Means of a coefficient on the next coarser grid: over the area that a coarse point stands for.

    Along an axis on whose faces it lies, that is weighted like a hat, as the correction is interpolated:
    the coarse operator then has the fine one's energy, which plain means of faces overestimate by any
    factor where the coefficient jumps.
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
        """out = the means of f, without ghosts."""
        self._collection.along_y(f)
        self._collection.along_x(out)


def _interpolation(n: int, m: int, rule: Rule, on_faces: bool):
    """Linear interpolation from m coarse points of an axis to n fine ones.

    Returns for each fine point the coarse point before it (from -1), the fraction past it, and the
    coarse axis's ghost table.
    """
    i = np.arange(n)
    position = i * (m / n) if on_faces else (i + 0.5) * (m / n) - 0.5
    before = np.floor(position).astype(int)
    return before, position - before, ghost_table(m, rule)


def _transposed(before: np.ndarray, fraction: np.ndarray, ghosts) -> list[dict[int, float]]:
    """The transpose of an interpolation, ghosts folded in, times the ratio of point counts.

    For each coarse point the fine points that it collects, with their weights.
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
    """For each of m cells the cells of n over the same length that it covers, with their parts of it."""
    edges = np.arange(m + 1) * (n / m)
    covered = []
    for start, end in pairwise(edges):
        cells = range(int(np.floor(start + 1e-9)), int(np.ceil(end - 1e-9)))
        covered.append({i: (min(end, i + 1) - max(start, i)) / (end - start) for i in cells})
    return covered


def _hats(n: int, m: int, periodic: bool) -> list[dict[int, float]]:
    """For each of m faces the faces of n around it, with the parts that sum to one of a hat."""
    weights = np.zeros((m, n))
    for c in range(m):
        distance = np.abs(np.arange(n) * (m / n) - c)
        if periodic:
            distance = np.minimum(distance, m - distance)
        weights[c] = np.maximum(0.0, 1.0 - distance)
    weights /= weights.sum(axis=1, keepdims=True)
    return [{int(i): float(row[i]) for i in np.flatnonzero(row)} for row in weights]


def _tables(collected: list[dict[int, float]], device: wp.Device):
    """Four tables of points (counted with the halo) that a coarse point collects, and four of weights."""
    room = whole_spans(len(collected))
    points, weights = np.full((4, room), HALO), np.zeros((4, room))
    for c, terms in enumerate(collected):
        for slot, (i, weight) in enumerate(terms.items()):
            points[slot, c], weights[slot, c] = i + HALO, weight
    return (
        *(upload(row, device, wp.int32) for row in points),
        *(upload(row, device) for row in weights),
    )


def _padded(before: np.ndarray, fraction: np.ndarray, device: wp.Device):
    """An axis's interpolation tables, padded to whole spans."""
    room = whole_spans(len(before)) - len(before)
    return (
        upload(np.pad(before, (0, room), constant_values=HALO), device, wp.int32),
        upload(np.pad(fraction, (0, room)), device),
    )
