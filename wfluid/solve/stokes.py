"""Stokes-Brinkman flow: the velocity without divergence that answers forces at once, without inertia.

    v + dt alpha v - dt div (2 mu S) + grad q = b,   div v = s,   S the strain of v

The operator A is that of the coupled diffusion (`operators.ViscousStress`), for a step dt that is long
beside the time that viscosity takes; the 1 in it is a drag 1/dt. For s = 0, v is the minimum of
<v, A v> / 2 - <b, v> among all fields without divergence, and conjugate gradients stay within these: P^T
removes the gradient part of a residual, and the preconditioner is P V, with V one V-cycle of A and

    P w = w - beta grad q,   div beta grad q = div w,   beta = c / the row sums of |A|.

The weights beta matter. With equal ones the eigenvalues of P V P^T A spread from 1 to 500 where viscosity
rises by 1e4 within a few cells, with these from 1 to 8: V and P then nearly commute, whatever viscosity and
drag (J. Rudi, G. Stadler, O. Ghattas, SIAM J. Sci. Comput. 39, 2017, S272, on the choice of such weights).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import warp as wp

from wfluid.domain.walls import Walls
from wfluid.fields.arrays import Scalars, Vector, field, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import projection
from wfluid.solve.conjugate_gradients import ConjugateGradients
from wfluid.solve.multigrid import Level
from wfluid.solve.operators import (
    STRESS_INTERVAL,
    CoefficientLevel,
    VariablePoisson,
    ViscousStress,
)
from wfluid.solve.system import JUMP_LIMIT, LinearSystem, Residual, SolveMethod, conjugate_gradients
from wfluid.solve.transfer import Averaging

OF_TOLERANCE = 0.02
"""Tolerance of each projection, as a part of the flow's: less accurate ones let the iterates wander off the
fields without divergence."""

ITERATIONS = 200
"""Most iterations. Constant viscosity takes 3 to 1e-3, with a no-slip wall 10, a painted contrast 20."""


class FaceWeights:
    """The weights beta of a projection on the faces of one grid."""

    def __init__(self, layout: Layout, walls: Walls, device: wp.Device):
        self.layout = layout
        self.beta = vector(layout, device, 2)
        """On x-faces and on y-faces, ghosts filled."""
        self._ghosts = Ghosts(layout, walls.centre_rules(), device)

    def fill(self) -> None:
        """Fill the ghosts."""
        for beta in self.beta:
            self._ghosts.fill(beta)


class StokesFlow:
    """Solves for Stokes-Brinkman flows in media of any viscosity and drag. The solve is symmetric."""

    def __init__(
        self, media: Sequence[CoefficientLevel], size: tuple[float, float], walls: Walls, device: wp.Device
    ):
        """`media` are the viscosity and drag on every grid of a picture of `size` [longer side]."""
        self.device, self.layout = device, media[0].layout
        self._stress = [ViscousStress(medium, size, walls, device) for medium in media]
        self._viscous = LinearSystem(self._stress, device, STRESS_INTERVAL)
        self._weights = [FaceWeights(medium.layout, walls, device) for medium in media]
        self._means = [
            [
                Averaging(fine.layout, coarse.layout, device, faces, walls.periodic)
                for faces in ((True, False), (False, True))
            ]
            for fine, coarse in pairwise(self._weights)
        ]
        poisson: list[Level] = [VariablePoisson(weights, size, walls, device) for weights in self._weights]
        self._poisson = LinearSystem(poisson, device, STRESS_INTERVAL, singular=True)
        top = self._stress[0]
        inverse = Scalars(device, inverse_hx=1 / top.h[0], inverse_hy=1 / top.h[1])
        self._inverse_h = [inverse.inverse_hx, inverse.inverse_hy]
        self._unit = Scalars(device, weight=1.0)
        self._minus_div, self._q = (field(self.layout, device) for _ in range(2))
        self._b, self._work = (vector(self.layout, device, 2) for _ in range(2))
        self.points, self.fill = top.points, top.fill
        self._krylov = ConjugateGradients(self, self._viscous.zero, self._precondition, device)
        self.method = self._pressure = SolveMethod("none", 0)

    method: SolveMethod
    """The method and tolerance of `solve`."""

    def plan(self, dt: float, least: float, jump: float, least_row: float, tolerance: float) -> SolveMethod:
        """Set up for a step dt [s] and an error of `tolerance` relative to the flow, in the norm of A.

        `least`, `jump` and `least_row` are those of the medium's `Stiffness`. `update_coefficients` must run
        before the next solve.
        """
        for depth, level in enumerate(self._stress):
            level.set_step(dt, 0.0 if depth else least)
        self._unit.set(weight=least_row)  # so that the largest weight is about 1
        part = OF_TOLERANCE * tolerance
        jumps = jump > JUMP_LIMIT
        self._pressure = conjugate_gradients(part) if jumps else self._poisson.plan_cycles(part)
        self._poisson.prepare(self._pressure)
        self.method = SolveMethod("conjugate gradients", ITERATIONS, tolerance)
        return replace(self._pressure, name=f"conjugate gradients, projected by {self._pressure.name}")

    def update_coefficients(self) -> None:
        """Bring the solver up to date with the medium: launches only."""
        for level in self._stress:
            level.weigh()
        self._viscous.invert_coarsest()
        top = self._weights[0]
        for weights, to in zip(self._stress[0].weights, top.beta, strict=True):
            algebra.scale.launch(self.layout, self.device, [weights, self._unit.weight], [to])
        top.fill()
        for means, (fine, coarse) in zip(self._means, pairwise(self._weights), strict=True):
            for faces, beta, to in zip(means, fine.beta, coarse.beta, strict=True):
                faces.average(beta, to)
            coarse.fill()
        self._poisson.invert_coarsest()

    def solve(self, b: Vector, v: Vector) -> None:
        """v = the flow without divergence under b, with ghosts; reads the ghosts of b: launches only."""
        self.remove_gradient(b, self._b)
        self._krylov.solve(self._b, v, self.method.tolerance, self.method.iterations, None)

    def apply(self, b: Vector, v: Vector, out: Vector) -> None:
        """out = b - A v, with ghosts."""
        self._stress[0].residual(b, v, out)
        self.fill(out)

    def residual(self, b: Vector, v: Vector, out: Vector) -> None:
        """out = P^T (b - A v): the operator as conjugate gradients see it."""
        self.apply(b, v, self._work)
        self.remove_gradient(self._work, out)

    def swell(self, divergence: wp.array, v: Vector) -> None:
        """v = -beta grad q, div v = `divergence`, a field with mean 0; with ghosts."""
        self._poisson.solve(self._pressure, (divergence,), (self._q,))
        self._subtract_weighted_gradient(self._viscous.zero, v)

    def swell_back(self, v_bar: Vector, minus_divergence_bar: wp.array) -> None:
        """The transpose of `swell`, times -1."""
        self._find_weighted_divergence(v_bar)
        self._poisson.solve(self._pressure, (self._minus_div,), (minus_divergence_bar,))

    def _precondition(self, r: Vector, z: Vector) -> None:
        """z = P V r."""
        self._viscous.cycle(r, self._work)
        self.find_minus_divergence(self._work, self._minus_div)
        self._poisson.solve(self._pressure, (self._minus_div,), (self._q,))
        self._subtract_weighted_gradient(self._work, z)

    def _subtract_weighted_gradient(self, w: Vector, out: Vector) -> None:
        """out = w - beta grad q, with ghosts."""
        inputs = [*w, self._q, *self._weights[0].beta, *self._inverse_h, self.layout.pitch]
        projection.subtract_gradient_beta.launch(self.layout, self.device, inputs, out)
        self.fill(out)

    def remove_gradient(self, r: Vector, out: Vector) -> None:
        """out = P^T r = r - grad q, div beta grad q = div beta r; with ghosts."""
        self._find_weighted_divergence(r)
        self._poisson.solve(self._pressure, (self._minus_div,), (self._q,))
        inputs = [*r, self._q, *self._inverse_h, self.layout.pitch]
        projection.subtract_gradient.launch(self.layout, self.device, inputs, out)
        self.fill(out)

    def _find_weighted_divergence(self, r: Vector) -> None:
        """`_minus_div` = -div beta r."""
        scaled = self._viscous.spare
        with together():
            for f, beta, to in zip(r, self._weights[0].beta, scaled, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, beta], [to])
        self.fill(scaled)
        self.find_minus_divergence(scaled, self._minus_div)

    def find_minus_divergence(self, velocity: Vector, out: wp.array) -> None:
        """out = -div of a velocity with ghosts."""
        inputs = [*velocity, *self._inverse_h, self.layout.pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, [out])

    def divergence_of(self, velocity: Vector) -> wp.array:
        """-div of a velocity with ghosts, in an array that the next solve overwrites."""
        self.find_minus_divergence(velocity, self._minus_div)
        return self._minus_div

    def measure(self) -> Residual:
        """The error of the last solve, relative to the flow, in the norm of A."""
        method, krylov = self.method, self._krylov
        return Residual(method.name, krylov.iterations_run(), krylov.error_left(method.tolerance), 1.0)
