"""The multigrid hierarchy: a level's grid and coefficients, and the way to the next coarser one.

Jacobi sweeps smooth on every level, the same before and after the coarser level's correction and in
opposite order; restriction is the prolongation's transpose. So a V-cycle is a symmetric operator. Any
grid size coarsens, n -> ceil(n/2) per axis (the finer one alone where cells are not square). W. Briggs,
V. Henson, S. McCormick, A Multigrid Tutorial, 2nd ed., chapters 3 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.chebyshev import chebyshev_factors
from wfluid.kernels import relaxation, transfer
from wfluid.kernels.cells import HALO, Layout, Real, whole_spans
from wfluid.state import field
from wfluid.walls import Ghosts, Rule, ghost_table

SMOOTHED = 0.45
"""Least eigenvalue of D^-1 A that the sweeps damp; what lies below is smooth and left to the coarser
level. Measured at 256 x 256: three cycles leave 2.3e-4 to 3.0e-4 for any value from 0.3 to 0.6."""


@dataclass(frozen=True)
class Points:
    """Which points of a grid a system's unknowns are."""

    size: tuple[float, float]
    """Width and height of the domain."""
    rules: tuple[Rule, Rule]
    """Continuation beyond the edges along x and y."""
    on_faces: tuple[bool, bool] = (False, False)
    """Whether they lie on faces (at i h) instead of centres (at (i + 1/2) h) along x and y."""


class Level:
    """One grid of the hierarchy: its scratch fields, its coefficients, the way to the coarser one."""

    def __init__(self, nx: int, ny: int, points: Points, device: wp.Device):
        self.layout = Layout(nx, ny)
        self.h = (points.size[0] / nx, points.size[1] / ny)
        self.points = points
        self.ghosts = Ghosts(self.layout, points.rules, device)
        self.b, self.x, self.y, self.r = (field(self.layout, device) for _ in range(4))
        self.beta: tuple[wp.array, wp.array] | None = None
        # in device memory, so that dt may change under a captured graph
        self._numbers = wp.zeros(8, dtype=Real, device=device)
        self.centre, self.ax, self.ay, self.own, self.near, self.first, self.second, self.plain = (
            self._numbers[n : n + 1] for n in range(8)
        )

    def set_coefficients(self, shift: float, scale: float) -> None:
        """Take the operator shift - scale Lap."""
        ax, ay = scale / self.h[0] ** 2, scale / self.h[1] ** 2
        centre = shift + 2 * ax + 2 * ay
        least = shift / centre
        first, second = chebyshev_factors(max(least, SMOOTHED), 2 - least, 2)
        own, near = (first + second - first * second) / centre, first * second / centre**2
        if self.beta is None:
            first, second, plain = first / centre, second / centre, 1 / centre
        else:
            plain = 1.0
        self._numbers.assign(np.array([centre, ax, ay, own, near, first, second, plain]))

    def smooth(self, b: wp.array, x: wp.array, rate: wp.array, out: wp.array) -> None:
        """One Jacobi sweep from x to out, both with ghosts; `rate` is `first`, `second` or `plain`."""
        layout, device = self.layout, out.device
        if self.beta is None:
            inputs = [b, x, rate, self.centre, self.ax, self.ay, layout.pitch]
            relaxation.jacobi.launch(layout, device, inputs, [out])
        else:
            inputs = [b, x, *self.beta, rate, self.ax, self.ay, layout.pitch]
            relaxation.jacobi_beta.launch(layout, device, inputs, [out])
        self.ghosts.fill(out)

    def smooth_from_zero(self, b: wp.array, out: wp.array) -> None:
        """The first two sweeps; b with ghosts."""
        layout, device = self.layout, out.device
        if self.beta is None:
            inputs = [b, self.own, self.near, self.ax, self.ay, layout.pitch]
            relaxation.first_two_sweeps.launch(layout, device, inputs, [out])
            self.ghosts.fill(out)
        else:
            self.r.zero_()
            self.smooth(b, self.r, self.first, self.y)
            self.smooth(b, self.y, self.second, out)

    def residual(self, b: wp.array, x: wp.array, out: wp.array) -> None:
        """Out = b - A x; x with ghosts."""
        layout, device = self.layout, out.device
        if self.beta is None:
            inputs = [b, x, self.centre, self.ax, self.ay, layout.pitch]
            relaxation.residual.launch(layout, device, inputs, [out])
        else:
            inputs = [b, x, *self.beta, self.ax, self.ay, layout.pitch]
            relaxation.residual_beta.launch(layout, device, inputs, [out])


class Transfer:
    """Restriction from a level to the next coarser one, and prolongation back."""

    def __init__(self, fine: Level, coarse: Level, device: wp.Device):
        self.fine, self.coarse = fine, coarse
        self.between = field(Layout(fine.layout.nx, coarse.layout.ny), device)
        x, y = (
            _interpolation(n, m, rule, on_faces)
            for n, m, rule, on_faces in zip(
                _shape(fine), _shape(coarse), fine.points.rules, fine.points.on_faces, strict=True
            )
        )
        self.down_x, self.down_y = (_transposed(*axis, device) for axis in (x, y))
        self.up_x, self.up_y = (_padded(axis[0] + HALO, axis[1], device) for axis in (x, y))

    def restrict(self, r: wp.array, out: wp.array) -> None:
        """Out = the transpose of the prolongation times the ratio of the cells' areas, applied to r."""
        fine, coarse, device = self.fine.layout, self.coarse.layout, out.device
        strip = Layout(fine.nx, coarse.ny)
        transfer.restrict_y.launch(strip, device, [r, *self.down_y, fine.pitch], [self.between])
        transfer.restrict_x.launch(coarse, device, [self.between, *self.down_x, strip.pitch], [out])
        self.coarse.ghosts.fill(out)

    def prolong_add(self, x: wp.array, e: wp.array, out: wp.array) -> None:
        """Out = x + the interpolated e; e with ghosts."""
        fine, coarse, device = self.fine.layout, self.coarse.layout, out.device
        strip = Layout(fine.nx, coarse.ny)
        inputs = [e, *self.up_x, coarse.pitch]
        transfer.prolong_x.launch(strip, device, inputs, [self.between], rows=(-1, coarse.ny + 1))
        transfer.prolong_y_add.launch(fine, device, [x, self.between, *self.up_y, strip.pitch], [out])
        self.fine.ghosts.fill(out)


def coarser(nx: int, ny: int, size: tuple[float, float]) -> tuple[int, int]:
    """Cells of the next coarser grid: each axis halved, but first the one with much finer cells alone.

    Point smoothers damp only what varies along the finer axis when cells are far from square.
    """
    hx, hy = size[0] / nx, size[1] / ny
    halve_x = nx > 2 and (hx < 1.5 * hy or ny <= 2)
    halve_y = ny > 2 and (hy < 1.5 * hx or nx <= 2)
    return -(-nx // 2) if halve_x else nx, -(-ny // 2) if halve_y else ny


def _shape(level: Level) -> tuple[int, int]:
    return level.layout.nx, level.layout.ny


def _interpolation(n: int, m: int, rule: Rule, on_faces: bool):
    """Linear interpolation from m coarse points of an axis to n fine ones.

    Returns for each fine point the coarse point before it (from -1), the fraction past it, and the
    coarse axis's ghost table.
    """
    i = np.arange(n)
    position = i * (m / n) if on_faces else (i + 0.5) * (m / n) - 0.5
    before = np.floor(position).astype(int)
    return before, position - before, ghost_table(m, rule)


def _transposed(before: np.ndarray, fraction: np.ndarray, ghosts, device: wp.Device):
    """The transpose of an interpolation, ghosts folded in, times the ratio of point counts.

    Four tables of points (counted with the halo) that a coarse point collects, and four of their
    weights.
    """
    source, sign = ghosts
    m, n = len(source) - 2 * HALO, len(before)
    collected: list[dict[int, float]] = [{} for _ in range(m)]
    for i in range(n):
        for point, weight in ((before[i], 1 - fraction[i]), (before[i] + 1, fraction[i])):
            entry = point + HALO
            if weight * sign[entry] != 0:
                to = collected[source[entry]]
                to[i] = to.get(i, 0.0) + weight * sign[entry]
    points = np.full((4, whole_spans(m)), HALO)
    weights = np.zeros((4, whole_spans(m)))
    for c, terms in enumerate(collected):
        for slot, (i, weight) in enumerate(terms.items()):
            points[slot, c] = i + HALO
            weights[slot, c] = weight * m / n
    return (
        *(wp.array(row, dtype=wp.int32, device=device) for row in points),
        *(wp.array(row, dtype=Real, device=device) for row in weights),
    )


def _padded(before: np.ndarray, fraction: np.ndarray, device: wp.Device):
    """An axis's interpolation tables, padded to whole spans."""
    room = whole_spans(len(before)) - len(before)
    return (
        wp.array(np.pad(before, (0, room), constant_values=HALO), dtype=wp.int32, device=device),
        wp.array(np.pad(fraction, (0, room)), dtype=Real, device=device),
    )


def matrix_of(level: Level, shift: float, scale: float, beta) -> np.ndarray:
    """The level's operator as a dense symmetric matrix, unknowns row by row."""
    layout = level.layout
    nx, ny = layout.nx, layout.ny
    (source_x, sign_x), (source_y, sign_y) = (
        ghost_table(n, rule) for n, rule in zip((nx, ny), level.points.rules, strict=True)
    )
    beta_x, beta_y = beta if beta is not None else (np.ones((ny, nx + 1)), np.ones((ny + 1, nx)))
    matrix = np.zeros((nx * ny, nx * ny))
    for j in range(ny):
        for i in range(nx):
            k = j * nx + i
            matrix[k, k] += shift
            for side in (0, 1):
                flow = scale * beta_x[j, i + side] / level.h[0] ** 2
                entry = i + 2 * side - 1 + HALO
                matrix[k, k] += flow
                matrix[k, j * nx + source_x[entry]] -= flow * sign_x[entry]
                flow = scale * beta_y[j + side, i] / level.h[1] ** 2
                entry = j + 2 * side - 1 + HALO
                matrix[k, k] += flow
                matrix[k, source_y[entry] * nx + i] -= flow * sign_y[entry]
    on_wall = np.zeros((ny, nx), dtype=bool)
    on_wall[:, 0] |= level.points.rules[0] is Rule.FACE
    on_wall[0, :] |= level.points.rules[1] is Rule.FACE
    matrix[on_wall.ravel(), :] = 0
    matrix[:, on_wall.ravel()] = 0
    return matrix


def coarse_faces(beta: np.ndarray, n: int, m: int, rows: int, coarse_rows: int) -> np.ndarray:
    """Coefficients on the m + 1 faces of the coarser level, from (rows, n + 1) finer ones."""
    at = np.linspace(0, n, m + 1)
    along = np.stack([np.interp(at, np.arange(n + 1), row) for row in beta])
    edges = np.linspace(0, rows, coarse_rows + 1)
    summed = np.vstack([np.zeros(m + 1), np.cumsum(along, axis=0)])
    at_edges = np.stack([np.interp(edges, np.arange(rows + 1), column) for column in summed.T], axis=1)
    return np.diff(at_edges, axis=0) / np.diff(edges)[:, None]


def face_field(layout: Layout, values: np.ndarray, device: wp.Device) -> wp.array:
    """Face values (ny or ny + 1, nx or nx + 1) as a field."""
    padded = np.ones(layout.size)
    grid = padded[: layout.size // layout.pitch * layout.pitch].reshape(-1, layout.pitch)
    grid[HALO : HALO + values.shape[0], HALO : HALO + values.shape[1]] = values
    return wp.array(padded, dtype=Real, device=device)
