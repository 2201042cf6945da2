"""Linear solves: symmetric multigrid cycles, Chebyshev sweeps, conjugate gradients, plain Jacobi sweeps.

All solve A x = b for the equations in `equations`. A fixed number of V-cycles from zero is a symmetric
linear operator: its adjoint is itself, converged or not. So is a fixed polynomial of the operator, which
is what sweeps are. Conjugate gradients, preconditioned by the cycle, run to a tolerance instead, where
coefficients jump and cycles alone would stall. On the coarsest level a stored inverse solves exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import warp as wp

from wfluid.fields.arrays import Vector, assign, entries, fill, upload, vector, zeros
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.cell.strips import alone, together
from wfluid.kernels.solve import algebra, dense
from wfluid.solve.chebyshev import chebyshev_count, chebyshev_factors
from wfluid.solve.conjugate_gradients import ConjugateGradients
from wfluid.solve.multigrid import Level
from wfluid.solve.transfer import Transfer

SWEEP_LIMIT = 14
"""Chebyshev sweeps that cost about as much as two cycles."""

JUMP_LIMIT = 10.0
"""Jump of the coefficients within a few cells up to which cycles alone converge as for smooth ones."""

ITERATION_LIMIT = 60
"""Most iterations of conjugate gradients to `USUAL_TOLERANCE`: tens at contrasts of 1e4, so that more will
not help."""

USUAL_TOLERANCE = 5e-4
"""About what three cycles leave."""


@dataclass(frozen=True)
class SolveMethod:
    """A method that solves a system, and how often it is applied."""

    name: str
    """"multigrid", "chebyshev" or "jacobi", which are linear and symmetric; or "conjugate gradients"."""
    iterations: int
    """Cycles or sweeps, from zero; of conjugate gradients the most."""
    tolerance: float = 0.0
    """Of conjugate gradients: the part of the solution, in the norm of A, that may be missing."""


@dataclass(frozen=True)
class Residual:
    """What a solve left: the method, how many cycles or sweeps it ran, ||b - A x||, ||b||, ||A|| ||x||."""

    method: str
    iterations: int
    norm: float
    norm_b: float
    norm_ax: float = 0.0

    @property
    def relative(self) -> float:
        """||b - A x|| / ||b||, 0 for b = 0."""
        return self.norm / self.norm_b if self.norm_b > 0 else 0.0

    @property
    def backward(self) -> float:
        """||b - A x|| / (||b|| + ||A|| ||x||), which rounding keeps above about 1e-7 in float32."""
        whole = self.norm_b + self.norm_ax
        return self.norm / whole if whole > 0 else 0.0


def conjugate_gradients(tolerance: float) -> SolveMethod:
    """Conjugate gradients to a tolerance, with as many iterations at most as its digits ask for."""
    digits = max(1.0, math.log(tolerance) / math.log(USUAL_TOLERANCE))
    return SolveMethod("conjugate gradients", math.ceil(ITERATION_LIMIT * digits), tolerance)


class LinearSystem:
    """An equation on a hierarchy of grids.

    `interval` holds the eigenvalues of one cycle times A; the factors of several cycles damp it. An
    equation that leaves a constant free is `singular`: then the mean of b must be zero.
    """

    def __init__(
        self,
        levels: Sequence[Level],
        device: wp.Device,
        interval: tuple[float, float],
        singular: bool = False,
    ):
        self.device, self.levels, self.interval, self.singular = device, list(levels), interval, singular
        self.transfers = [Transfer(fine, coarse, device) for fine, coarse in pairwise(self.levels)]
        top, coarsest = self.levels[0], self.levels[-1].layout
        components = len(top.points)
        self.zero, self.residual, self.correction, self.spare = (
            vector(top.layout, device, components) for _ in range(4)
        )
        self.unknowns = coarsest.nx * coarsest.ny * components
        self._matrices = [zeros(self.unknowns**2, device) for _ in range(2)]
        self._dense = zeros(self.unknowns, device)
        self._factors: dict[int, list[wp.array]] = {}
        self._rates = zeros(SWEEP_LIMIT, device)
        self.inner = InnerProduct(top.layout, device, components)
        self._conjugate: ConjugateGradients | None = None

    def invert_coarsest(self) -> None:
        """Store the inverse of the coarsest level's operator: launches only; after its numbers change."""
        level, n = self.levels[-1], self.unknowns
        layout = level.layout
        cells, where = layout.nx * layout.ny, [layout.nx, layout.pitch]
        matrix, other = self._matrices
        # -1 1^T takes the place of the constant, which a singular operator does not see
        shift = float(np.prod([1 / h for h in level.h])) / cells if self.singular else 0.0
        zero = level.b
        alone(lambda: fill(0.0, *zero))
        for column in range(n):
            for component, f in enumerate(level.x):
                dense.unit.launch(cells, self.device, [column - component * cells, *where], [f])
            level.fill(level.x)
            level.residual(zero, level.x, level.r)
            level.fill(level.r)
            for component, f in enumerate(level.r):
                inputs = [f, column, component * cells, n, *where, shift]
                dense.store_column.launch(cells, self.device, inputs, [matrix])
        for pivot in range(n):
            dense.eliminate.launch(n, self.device, [matrix, pivot, n], [other])
            matrix, other = other, matrix
        self.inverse = matrix

    def plan_sweeps(self, low: float, high: float, scale: float, tolerance: float) -> SolveMethod | None:
        """The Chebyshev sweeps that leave at most `tolerance` of any b, or None where cycles cost less.

        `low` and `high` bound the eigenvalues of M^-1 A; `scale` is what the sweeps' rates carry of M.
        """
        sweeps = chebyshev_count(low, high, tolerance) if low > 0 else SWEEP_LIMIT + 1
        if sweeps > SWEEP_LIMIT:
            return None
        factors = chebyshev_factors(low, high, sweeps)
        factors = np.stack([factors, factors[::-1]], axis=1).ravel()[:sweeps]  # short and long in turn
        assign(np.pad(factors / scale, (0, SWEEP_LIMIT - sweeps)), self._rates)
        return SolveMethod("chebyshev", sweeps)

    def plan_cycles(self, tolerance: float) -> SolveMethod:
        """The fewest cycles that leave at most `tolerance` of any b."""
        return SolveMethod("multigrid", chebyshev_count(*self.interval, tolerance))

    def prepare(self, method: SolveMethod) -> None:
        """Make ready, before a graph is captured, what a solve keeps on the device."""
        cycles = method.iterations
        if method.name == "multigrid" and cycles not in self._factors:
            factors = chebyshev_factors(*self.interval, cycles) if cycles > 1 else np.ones(1)
            self._factors[cycles] = entries(upload(factors, self.device))
        if method.name == "conjugate gradients" and self._conjugate is None:
            self._conjugate = ConjugateGradients(self.levels[0], self.zero, self.cycle, self.device)

    def solve(self, method: SolveMethod, b: Vector, x: Vector, whole: Vector | None = None) -> None:
        """x = what the method makes of b. Fills the ghosts of b and x.

        Conjugate gradients stop when what x misses is `tolerance` of x, and of `whole` where given.
        """
        self.prepare(method)
        self.levels[0].fill(b)
        if method.name == "multigrid":
            self._cycles(b, x, method.iterations)
        elif method.name == "conjugate gradients":
            self._conjugate.solve(b, x, method.tolerance, method.iterations, whole)
        elif method.name == "chebyshev":
            rates = entries(self._rates, slice(method.iterations))
            self.levels[0].smooth_from_zero(b, rates, self.spare, x)
        else:
            rates = [self.levels[0].plain] * method.iterations
            self.levels[0].smooth_from_zero(b, rates, self.spare, x)

    def _cycles(self, b: Vector, x: Vector, cycles: int) -> None:
        """x = `cycles` V-cycles on b, from zero."""
        top = self.levels[0]
        factors = self._factors[cycles]
        at, other = (x, self.spare) if cycles % 2 else (self.spare, x)
        for cycle in range(cycles):
            residual = b
            if cycle:
                at, other = other, at
                top.residual(b, other, self.residual)
                top.fill(self.residual)
                residual = self.residual
            self.cycle(residual, self.correction)
            start, factor = other if cycle else self.zero, factors[cycle]
            with together():
                for f, e, out in zip(start, self.correction, at, strict=True):
                    algebra.add_scaled.launch(top.layout, self.device, [f, e, factor], [out])
            top.fill(at)

    def cycle(self, b: Vector, out: Vector, depth: int = 0) -> None:
        """out = one V-cycle on b (with ghosts), from zero; out has ghosts and may be the level's y."""
        level = self.levels[depth]
        if depth == len(self.levels) - 1:
            self._solve_coarsest(b, out)
            return
        coarse, between = self.levels[depth + 1], self.transfers[depth]
        level.smooth_from_zero(b, level.rates, level.r, level.x)
        level.residual(b, level.x, level.r)
        between.restrict(level.r, coarse.b)
        self.cycle(coarse.b, coarse.y, depth + 1)
        between.prolong_add(level.x, coarse.y, level.r)
        level.smooth(b, level.r, level.rates[::-1], level.x, out)

    def _solve_coarsest(self, b: Vector, out: Vector) -> None:
        level, n = self.levels[-1], self.unknowns
        layout = level.layout
        cells, where = layout.nx * layout.ny, [layout.nx, layout.pitch]
        for component, f in enumerate(b):
            dense.collect.launch(cells, self.device, [f, component * cells, *where], [self._dense])
        for component, f in enumerate(out):
            inputs = [self.inverse, self._dense, component * cells, n, *where]
            dense.multiply.launch(cells, self.device, inputs, [f])
        level.fill(out)

    def measure(self, method: SolveMethod, b: Vector, x: Vector, norm_a: float = 0.0) -> Residual:
        """The true residual of a solve; `norm_a` is a bound of ||A||."""
        top = self.levels[0]
        top.residual(b, x, self.residual)
        top.fill(self.residual)
        top.fill(b)
        ran = self._conjugate.ran() if method.name == "conjugate gradients" else method.iterations
        residual, right, answer = (self.inner.norm(f) for f in (self.residual, b, x))
        return Residual(method.name, ran, residual, right, norm_a * answer)
