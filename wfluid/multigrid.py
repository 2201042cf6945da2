"""Linear solves: symmetric multigrid cycles, Chebyshev sweeps and plain Jacobi sweeps.

All solve (shift - scale Lap) x = b on one kind of grid point (centres, x-faces or y-faces):
diffusion has shift 1 and scale dt mu, pressure shift 0 and scale 1, with face coefficients where
something resists (div beta grad). A fixed number of V-cycles from zero, with the same sweeps before
and after in opposite order and a restriction that is the prolongation's transpose, is a symmetric
linear operator: its adjoint is itself, converged or not. So is a fixed polynomial of the operator,
which is what sweeps are.

Coarsening n -> ceil(n/2) per axis (the finer one alone where cells are not square) until at most
`DENSE` unknowns are left, which a stored inverse solves exactly. W. Briggs, V. Henson, S. McCormick,
A Multigrid Tutorial, 2nd ed., chapters 3 and 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.kernels import measure, relaxation, transfer
from wfluid.kernels.cells import HALO, Layout, Real, whole_spans
from wfluid.state import field
from wfluid.walls import Ghosts, Rule, ghost_table

DENSE = 64
"""Unknowns that the stored inverse of the coarsest level may have."""

SMOOTHED = 0.45
"""Least eigenvalue of D^-1 A that the sweeps damp; what lies below is smooth and left to the coarser
level. Measured at 256 x 256: three cycles leave 2.3e-4 to 3.0e-4 for any value from 0.3 to 0.6."""

SWEEP_LIMIT = 14
"""Chebyshev sweeps that cost about as much as two cycles."""

CYCLE_INTERVAL = (0.8, 1.0)
"""Where the eigenvalues of one cycle times A lie; the cycles' Chebyshev factors damp this interval."""


def chebyshev_factors(low: float, high: float, count: int) -> np.ndarray:
    """Inverse roots of the Chebyshev polynomial of degree `count` on [low, high], largest root first."""
    angles = np.pi * (2 * np.arange(count) + 1) / (2 * count)
    return 1.0 / ((high + low) / 2 + (high - low) / 2 * np.cos(angles))


def chebyshev_count(low: float, high: float, tolerance: float) -> int:
    """The least degree whose Chebyshev polynomial on [low, high] leaves `tolerance` of what it damps."""
    if high - low < 1e-12 * high:
        return 1
    return max(1, math.ceil(math.acosh(1 / tolerance) / math.acosh((high + low) / (high - low))))


@dataclass(frozen=True)
class Solve:
    """How a system is solved: a method and how often it is applied. Linear and symmetric, all three."""

    method: str
    """"multigrid", "chebyshev" or "jacobi"."""
    iterations: int
    """Cycles or sweeps, from zero."""


@dataclass(frozen=True)
class Residual:
    """What a solve left: the method, how many cycles or sweeps it ran, ||b - A x|| and ||b||."""

    method: str
    iterations: int
    norm: float
    norm_b: float

    @property
    def relative(self) -> float:
        """||b - A x|| / ||b||, 0 for b = 0."""
        return self.norm / self.norm_b if self.norm_b > 0 else 0.0


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


class LinearSystem:
    """(shift - scale Lap) x = b, or -div (beta grad x) = b, on `points` of an nx by ny grid."""

    def __init__(self, nx: int, ny: int, points: Points, device: wp.Device):
        self.device = device
        self.levels = [Level(nx, ny, points, device)]
        self.transfers: list[Transfer] = []
        while nx * ny > DENSE:
            nx, ny = _coarser(nx, ny, points.size)
            self.levels.append(Level(nx, ny, points, device))
            self.transfers.append(Transfer(*self.levels[-2:], device))
        top = self.levels[0].layout
        self.zero, self.left, self.correction, self.spare = (field(top, device) for _ in range(4))
        self.inverse = wp.zeros((nx * ny) ** 2, dtype=Real, device=device)
        self._factors: dict[int, wp.array] = {}
        self._rates = wp.zeros(SWEEP_LIMIT, dtype=Real, device=device)
        self._coefficients: tuple[float, float] | None = None

    def set_coefficients(self, shift: float, scale: float) -> None:
        """Take the operator shift - scale Lap; costs something only when they changed."""
        if self._coefficients == (shift, scale) and self.levels[0].beta is None:
            return
        self._coefficients = (shift, scale)
        for level in self.levels:
            level.beta = None
            level.set_coefficients(shift, scale)
        coarsest = self.levels[-1]
        self._store_inverse(_matrix(coarsest, shift, scale, None))

    def set_beta(self, beta_x: np.ndarray, beta_y: np.ndarray) -> None:
        """Take the operator -div (beta grad).

        `beta_x` (ny, nx + 1) on x-faces and `beta_y` (ny + 1, nx) on y-faces, positive. Coarser
        levels take the mean of the faces that a coarse face covers.
        """
        self._coefficients = None
        for index, level in enumerate(self.levels):
            if index:
                ratio = self.levels[index - 1].layout
                beta_x = _coarse_faces(beta_x, ratio.nx, level.layout.nx, ratio.ny, level.layout.ny)
                beta_y = _coarse_faces(beta_y.T, ratio.ny, level.layout.ny, ratio.nx, level.layout.nx).T
            level.beta = tuple(_face_field(level.layout, beta, self.device) for beta in (beta_x, beta_y))
            level.set_coefficients(0.0, 1.0)
        self._store_inverse(_matrix(self.levels[-1], 0.0, 1.0, (beta_x, beta_y)))

    def _store_inverse(self, matrix: np.ndarray) -> None:
        inverse = np.linalg.pinv(matrix, rcond=1e-10, hermitian=True)
        self.inverse.assign(inverse.ravel())

    def plan(self, tolerance: float) -> Solve:
        """The cheapest solve that leaves at most `tolerance` of any right-hand side.

        Chebyshev sweeps where the operator is close enough to the identity that few of them do, which
        they do to the bound of the polynomial; else multigrid.
        """
        shift, scale = self._coefficients
        centre = shift + 2 * scale * sum(h**-2 for h in self.levels[0].h)
        least = shift / centre
        sweeps = chebyshev_count(least, 2 - least, tolerance) if least > 0 else SWEEP_LIMIT + 1
        if sweeps > SWEEP_LIMIT:
            return Solve("multigrid", chebyshev_count(*CYCLE_INTERVAL, tolerance))
        factors = chebyshev_factors(least, 2 - least, sweeps)
        factors = np.stack([factors, factors[::-1]], axis=1).ravel()[:sweeps]  # short and long in turn
        self._rates.assign(np.pad(factors / centre, (0, SWEEP_LIMIT - sweeps)))
        return Solve("chebyshev", sweeps)

    def solve(self, how: Solve, b: wp.array, x: wp.array) -> None:
        """X = what `how` makes of b. Fills the ghosts of b and x."""
        if how.method == "multigrid":
            self.multigrid(b, x, how.iterations)
        elif how.method == "chebyshev":
            self._sweep(b, x, [self._rates[n : n + 1] for n in range(how.iterations)])
        else:
            self._sweep(b, x, [self.levels[0].plain] * how.iterations)

    def prepare(self, how: Solve) -> None:
        """Put the Chebyshev factors of the cycles on the device, before a graph is captured."""
        cycles = how.iterations
        if how.method == "multigrid" and cycles not in self._factors:
            factors = chebyshev_factors(*CYCLE_INTERVAL, cycles) if cycles > 1 else np.ones(1)
            self._factors[cycles] = wp.array(factors, dtype=Real, device=self.device)

    def multigrid(self, b: wp.array, x: wp.array, cycles: int) -> None:
        """X = `cycles` V-cycles on b, from zero. Fills the ghosts of b and x."""
        top = self.levels[0]
        self.prepare(Solve("multigrid", cycles))
        factors = self._factors[cycles]
        top.ghosts.fill(b)
        at, other = (x, self.spare) if cycles % 2 else (self.spare, x)
        for cycle in range(cycles):
            left = b
            if cycle:
                at, other = other, at
                top.residual(b, other, self.left)
                top.ghosts.fill(self.left)
                left = self.left
            self._cycle(0, left, self.correction)
            inputs = [other if cycle else self.zero, self.correction, factors[cycle : cycle + 1]]
            relaxation.add_scaled.launch(top.layout, self.device, inputs, [at])
            top.ghosts.fill(at)

    def _sweep(self, b: wp.array, x: wp.array, rates: list[wp.array]) -> None:
        """X = one Jacobi sweep for each of `rates`, from zero."""
        top = self.levels[0]
        top.ghosts.fill(b)
        at, other = (x, self.spare) if len(rates) % 2 else (self.spare, x)
        for n, rate in enumerate(rates):
            top.smooth(b, other if n else self.zero, rate, at)
            at, other = other, at

    def _cycle(self, depth: int, b: wp.array, out: wp.array) -> None:
        """Out = one V-cycle on b (with ghosts), from zero; out has ghosts and may be the level's y."""
        level = self.levels[depth]
        if depth == len(self.levels) - 1:
            layout = level.layout
            inputs = [self.inverse, b, layout.nx, layout.ny, layout.pitch]
            relaxation.dense_solve.launch(layout.nx * layout.ny, self.device, inputs, [out])
            level.ghosts.fill(out)
            return
        coarse, between = self.levels[depth + 1], self.transfers[depth]
        level.smooth_from_zero(b, level.x)
        level.residual(b, level.x, level.r)
        between.restrict(level.r, coarse.b)
        self._cycle(depth + 1, coarse.b, coarse.y)
        between.prolong_add(level.x, coarse.y, level.y)
        level.smooth(b, level.y, level.second, level.x)
        level.smooth(b, level.x, level.first, out)

    def measure(self, how: Solve, b: wp.array, x: wp.array) -> Residual:
        """The true residual of a solve."""
        top = self.levels[0]
        top.residual(b, x, self.left)
        top.ghosts.fill(self.left)
        top.ghosts.fill(b)
        return Residual(how.method, how.iterations, norm(self.left, top.layout)[0], norm(b, top.layout)[0])


def norm(f: wp.array, layout: Layout) -> tuple[float, float]:
    """Euclidean norm and largest absolute value of f over its cells."""
    squares, largest = (wp.empty(layout.ny, dtype=Real, device=f.device) for _ in range(2))
    measure.row_norms.launch(layout.ny, f.device, [f, layout.nx, layout.pitch], [squares, largest])
    return float(np.sqrt(squares.numpy().sum(dtype=np.float64))), float(largest.numpy().max())


def _coarser(nx: int, ny: int, size: tuple[float, float]) -> tuple[int, int]:
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


def _matrix(level: Level, shift: float, scale: float, beta) -> np.ndarray:
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


def _coarse_faces(beta: np.ndarray, n: int, m: int, rows: int, coarse_rows: int) -> np.ndarray:
    """Coefficients on the m + 1 faces of the coarser level, from (rows, n + 1) finer ones."""
    at = np.linspace(0, n, m + 1)
    along = np.stack([np.interp(at, np.arange(n + 1), row) for row in beta])
    edges = np.linspace(0, rows, coarse_rows + 1)
    summed = np.vstack([np.zeros(m + 1), np.cumsum(along, axis=0)])
    at_edges = np.stack([np.interp(edges, np.arange(rows + 1), column) for column in summed.T], axis=1)
    return np.diff(at_edges, axis=0) / np.diff(edges)[:, None]


def _face_field(layout: Layout, values: np.ndarray, device: wp.Device) -> wp.array:
    """Face values (ny or ny + 1, nx or nx + 1) as a field."""
    padded = np.ones(layout.size)
    grid = padded[: layout.size // layout.pitch * layout.pitch].reshape(-1, layout.pitch)
    grid[HALO : HALO + values.shape[0], HALO : HALO + values.shape[1]] = values
    return wp.array(padded, dtype=Real, device=device)
