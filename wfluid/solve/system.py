"""Linear solves: symmetric multigrid cycles, Chebyshev sweeps, conjugate gradients, plain Jacobi sweeps.

All solve A x = b for the equations in `operators`. A fixed number of V-cycles from zero is a symmetric linear
operator: it is its own adjoint, converged or not. A fixed number of sweeps is a polynomial of A, so the same
holds for it. Where coefficients jump, cycles converge slowly; there conjugate gradients, preconditioned by
the cycle, run to a tolerance instead. On the coarsest level a stored inverse solves exactly.
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
from wfluid.solve.chebyshev import (
    chebyshev_count,
    chebyshev_factors,
    count_with_root,
    interval_with_root,
)
from wfluid.solve.conjugate_gradients import ConjugateGradients
from wfluid.solve.multigrid import Level
from wfluid.solve.transfer import Transfer

SWEEP_LIMIT = 14
"""Most Chebyshev sweeps: they cost about as much as two cycles."""

JUMP_LIMIT = 10.0
"""Greatest ratio of coefficients within a few cells at which cycles converge as with smooth coefficients."""

CONTRAST_LIMIT = 300.0
"""Greatest ratio of all coefficients for cycles, however gently they change: coarse levels average a pattern.
With three stripes, two cycles a step lost 0.01 px of 512 in half a second at 300, and 0.15 px at 1000."""

ITERATION_LIMIT = 60
"""Most iterations of conjugate gradients to `USUAL_TOLERANCE`. A contrast of 1e4 takes tens; a solve that
does not converge in so many does not converge in more."""

USUAL_TOLERANCE = 5e-4
"""Relative residual of about three cycles."""


@dataclass(frozen=True)
class SolveMethod:
    """A method that solves a system, and how often it is applied."""

    name: str
    """"multigrid", "chebyshev" or "jacobi", which are linear and symmetric; or "conjugate gradients"."""
    iterations: int
    """Number of cycles or sweeps, from zero; of conjugate gradients the most iterations."""
    tolerance: float = 0.0
    """Of conjugate gradients: the error relative to the solution, both in the norm of A, at which to stop."""


@dataclass(frozen=True)
class Residual:
    """The residual of a solve, in Euclidean norms."""

    method: str
    """Name of the method, as of `SolveMethod`."""
    iterations: int
    """Number of cycles, sweeps or iterations."""
    norm: float
    """||b - A x||."""
    norm_b: float
    """||b||."""
    norm_ax: float = 0.0
    """||A|| ||x||, an upper bound of ||A x||."""
    error: float = 0.0
    """Of a diffusion, the estimated error of the velocity: root mean square over the cells [longer
    side/s]."""
    unfinished: bool = False
    """Whether conjugate gradients stopped at the most iterations."""

    @property
    def relative(self) -> float:
        """||b - A x|| / ||b||, 0 for b = 0."""
        return self.norm / self.norm_b if self.norm_b > 0 else 0.0

    @property
    def backward(self) -> float:
        """||b - A x|| / (||b|| + ||A|| ||x||), the backward error; in float32 it is at least about 1e-7."""
        scale = self.norm_b + self.norm_ax
        return self.norm / scale if scale > 0 else 0.0


def conjugate_gradients(tolerance: float) -> SolveMethod:
    """Conjugate gradients to a tolerance; the most iterations are in proportion to its digits."""
    digits = max(1.0, math.log(tolerance) / math.log(USUAL_TOLERANCE))
    return SolveMethod("conjugate gradients", math.ceil(ITERATION_LIMIT * digits), tolerance)


class LinearSystem:
    """An equation A x = b on a hierarchy of grids.

    `interval` contains the eigenvalues of one cycle times A; the factors of several cycles are chosen for it.
    `singular` tells that A maps constants to 0: then the mean of b must be 0. With `smooth_exact` sweeps and
    cycles leave no error in the smoothest change: an error there has one sign in every step, so it grows.
    """

    def __init__(
        self,
        levels: Sequence[Level],
        device: wp.Device,
        interval: tuple[float, float],
        singular: bool = False,
        smooth_exact: bool = False,
    ):
        self.device, self.levels, self.interval, self.singular = device, list(levels), interval, singular
        self._smooth_exact = smooth_exact
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
        """Store the inverse of the coarsest level's operator after its coefficients change: launches only."""
        level, n = self.levels[-1], self.unknowns
        layout = level.layout
        cells, place = layout.nx * layout.ny, [layout.nx, layout.pitch]
        matrix, other = self._matrices
        # a multiple of 1 1^T makes a singular operator invertible: it maps constants to 0
        shift = float(np.prod([1 / h for h in level.h])) / cells if self.singular else 0.0
        zero = level.b
        alone(lambda: fill(0.0, *zero))
        for column in range(n):
            for component, f in enumerate(level.x):
                dense.unit.launch(cells, self.device, [column - component * cells, *place], [f])
            level.fill(level.x)
            level.residual(zero, level.x, level.r)
            level.fill(level.r)
            for component, f in enumerate(level.r):
                inputs = [f, column, component * cells, n, *place, shift]
                dense.store_column.launch(cells, self.device, inputs, [matrix])
        for pivot in range(n):
            dense.eliminate.launch(n, self.device, [matrix, pivot, n], [other])
            matrix, other = other, matrix
        self.inverse = matrix

    def plan_sweeps(self, low: float, high: float, scale: float, tolerance: float) -> SolveMethod | None:
        """Chebyshev sweeps that reduce the residual to `tolerance` of b, or None where cycles cost less.

        `low` and `high` bound the eigenvalues of M^-1 A. The rates of the sweeps are divided by `scale`: the
        diagonal of A where the level's sweeps do not divide by it, else 1.
        """
        count = count_with_root if self._smooth_exact else chebyshev_count
        sweeps = count(low, high, tolerance) if low > 0 else SWEEP_LIMIT + 1
        if sweeps > SWEEP_LIMIT:
            return None
        if self._smooth_exact:
            low, high = interval_with_root(low, high, sweeps)
        factors = chebyshev_factors(low, high, sweeps)
        # the largest, the smallest, the second largest, …
        factors = np.stack([factors, factors[::-1]], axis=1).ravel()[:sweeps]
        assign(np.pad(factors / scale, (0, SWEEP_LIMIT - sweeps)), self._rates)
        return SolveMethod("chebyshev", sweeps)

    def plan_cycles(self, tolerance: float) -> SolveMethod:
        """The fewest cycles that reduce the residual to `tolerance` of b."""
        low, high = self.interval
        count = count_with_root(high, low, tolerance) if self._smooth_exact else None
        return SolveMethod("multigrid", count or chebyshev_count(low, high, tolerance))

    def prepare(self, method: SolveMethod) -> None:
        """Make the arrays of a method in device memory, before a graph is captured."""
        cycles = method.iterations
        if method.name == "multigrid" and cycles not in self._factors:
            low, high = self.interval
            if self._smooth_exact:
                low, high = interval_with_root(high, low, cycles)
            factors = chebyshev_factors(low, high, cycles) if cycles > 1 else np.ones(1)
            self._factors[cycles] = entries(upload(factors, self.device))
        if method.name == "conjugate gradients":
            self._conjugate_gradients()

    def _conjugate_gradients(self) -> ConjugateGradients:
        if self._conjugate is None:
            self._conjugate = ConjugateGradients(self.levels[0], self.zero, self.cycle, self.device)
        return self._conjugate

    def solve(
        self,
        method: SolveMethod,
        b: Vector,
        x: Vector,
        scale: Vector | None = None,
        error: wp.array | None = None,
    ) -> None:
        """Solve A x = b by a method, from zero. Fills the ghosts of b and x.

        Conjugate gradients stop when the error of x is `tolerance` of x, and of `scale` where it is given;
        and <e, A e> is below `error`, an array of one number, where that is given.
        """
        self.prepare(method)
        self.levels[0].fill(b)
        if method.name == "multigrid":
            self._cycles(b, x, method.iterations)
        elif method.name == "conjugate gradients":
            self._conjugate_gradients().solve(b, x, method.tolerance, method.iterations, scale, error)
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
        new, old = (x, self.spare) if cycles % 2 else (self.spare, x)
        for cycle in range(cycles):
            residual = b
            if cycle:
                new, old = old, new
                top.residual(b, old, self.residual)
                top.fill(self.residual)
                residual = self.residual
            self.cycle(residual, self.correction)
            start, factor = old if cycle else self.zero, factors[cycle]
            with together():
                for f, e, out in zip(start, self.correction, new, strict=True):
                    algebra.add_scaled.launch(top.layout, self.device, [f, e, factor], [out])
            top.fill(new)

    def cycle(self, b: Vector, out: Vector, depth: int = 0) -> None:
        """out = one V-cycle on b, from zero.

        Reads the ghosts of b, fills those of out, which may be the level's y.
        """
        level = self.levels[depth]
        if depth == len(self.levels) - 1:
            self._solve_coarsest(b, out)
            return
        coarse, transfer = self.levels[depth + 1], self.transfers[depth]
        level.smooth_from_zero(b, level.rates, level.r, level.x)
        level.residual(b, level.x, level.r)
        transfer.restrict(level.r, coarse.b)
        self.cycle(coarse.b, coarse.y, depth + 1)
        transfer.prolong_add(level.x, coarse.y, level.r)
        level.smooth(b, level.r, level.rates[::-1], level.x, out)

    def _solve_coarsest(self, b: Vector, out: Vector) -> None:
        level, n = self.levels[-1], self.unknowns
        layout = level.layout
        cells, place = layout.nx * layout.ny, [layout.nx, layout.pitch]
        for component, f in enumerate(b):
            dense.collect.launch(cells, self.device, [f, component * cells, *place], [self._dense])
        for component, f in enumerate(out):
            inputs = [self.inverse, self._dense, component * cells, n, *place]
            dense.multiply.launch(cells, self.device, inputs, [f])
        level.fill(out)

    def measure(self, method: SolveMethod, b: Vector, x: Vector, norm_a: float = 0.0) -> Residual:
        """The true residual of a solve, b - A x; `norm_a` is an upper bound of ||A||."""
        self.levels[0].fill(b)
        self._find_residual(b, x)
        iterations, unfinished = method.iterations, False
        if method.name == "conjugate gradients":
            iterations = self._conjugate_gradients().iterations_run()
            unfinished = iterations == method.iterations
        norm, norm_b, norm_x = (self.inner.norm(f) for f in (self.residual, b, x))
        return Residual(method.name, iterations, norm, norm_b, norm_a * norm_x, unfinished=unfinished)

    def _find_residual(self, b: Vector, x: Vector) -> None:
        """`residual` = b - A x, with ghosts."""
        self.levels[0].residual(b, x, self.residual)
        self.levels[0].fill(self.residual)

    def error(self, method: SolveMethod, b: Vector, x: Vector) -> float:
        """An estimate of sqrt(<e, A e>), e the error of the last solve.

        Of few sweeps it is the residual's norm, a bound of e where no eigenvalue of A is below 1.
        """
        if method.name == "conjugate gradients":
            return self._conjugate_gradients().error()
        self._find_residual(b, x)
        if method.name == "chebyshev":
            return self.inner.norm(self.residual)
        self.cycle(self.residual, self.correction)
        self.inner.along_rows(self.residual, self.correction)
        return math.sqrt(max(0.0, self.inner.total()))
