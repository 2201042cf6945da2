"""Linear solves: symmetric multigrid cycles, Chebyshev sweeps and plain Jacobi sweeps.

All solve (shift - scale Lap) x = b on one kind of grid point (centres, x-faces or y-faces):
diffusion has shift 1 and scale dt mu, pressure shift 0 and scale 1, with face coefficients where
something resists (div beta grad). A fixed number of V-cycles from zero is a symmetric linear operator:
its adjoint is itself, converged or not. So is a fixed polynomial of the operator, which is what sweeps
are. On the coarsest level, of at most `DENSE` unknowns, a stored inverse solves exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.chebyshev import chebyshev_count, chebyshev_factors
from wfluid.kernels import measure, relaxation
from wfluid.kernels.cells import Layout, Real
from wfluid.multigrid import Level, Points, Transfer, coarse_faces, coarser, face_field, matrix_of
from wfluid.state import field

DENSE = 64
"""Unknowns that the stored inverse of the coarsest level may have."""

SWEEP_LIMIT = 14
"""Chebyshev sweeps that cost about as much as two cycles."""

CYCLE_INTERVAL = (0.8, 1.0)
"""Where the eigenvalues of one cycle times A lie; the cycles' Chebyshev factors damp this interval."""


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


class LinearSystem:
    """(shift - scale Lap) x = b, or -div (beta grad x) = b, on `points` of an nx by ny grid."""

    def __init__(self, nx: int, ny: int, points: Points, device: wp.Device):
        self.device = device
        self.levels = [Level(nx, ny, points, device)]
        self.transfers: list[Transfer] = []
        while nx * ny > DENSE:
            nx, ny = coarser(nx, ny, points.size)
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
        self._store_inverse(matrix_of(coarsest, shift, scale, None))

    def set_beta(self, beta_x: np.ndarray, beta_y: np.ndarray) -> None:
        """Take the operator -div (beta grad).

        `beta_x` (ny, nx + 1) on x-faces and `beta_y` (ny + 1, nx) on y-faces, positive. Coarser
        levels take the mean of the faces that a coarse face covers.
        """
        self._coefficients = None
        for index, level in enumerate(self.levels):
            if index:
                ratio = self.levels[index - 1].layout
                beta_x = coarse_faces(beta_x, ratio.nx, level.layout.nx, ratio.ny, level.layout.ny)
                beta_y = coarse_faces(beta_y.T, ratio.ny, level.layout.ny, ratio.nx, level.layout.nx).T
            level.beta = tuple(face_field(level.layout, beta, self.device) for beta in (beta_x, beta_y))
            level.set_coefficients(0.0, 1.0)
        self._store_inverse(matrix_of(self.levels[-1], 0.0, 1.0, (beta_x, beta_y)))

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
