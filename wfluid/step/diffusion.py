"""The diffusion of a step: implicit Euler, constant viscosity apart for u and v, else both together.

Both solve for the change that the diffusion makes to what drag alone would leave, A d = v - A v0 with
v0 = v / (1 + dt alpha). That keeps uniform motion exact and the solver's tolerance one of the change;
with a symmetric solver M the adjoint is v0 -> v0 + (1 - A) M in opposite order.
"""

from __future__ import annotations

from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Scalars, Vector, copy, field, fill, vector, zeros
from wfluid.kernels.adjoint import viscosity as viscosity_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import alone, together
from wfluid.kernels.solve import algebra
from wfluid.model.fluid import Fluid
from wfluid.solve.multigrid import Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, STRESS_INTERVAL, FivePoint, ViscousStress
from wfluid.solve.system import JUMP_LIMIT, LinearSystem, Residual, SolveMethod, conjugate_gradients
from wfluid.step.coefficients import Coefficients
from wfluid.step.tape import attach_gradients, bars, record

SURE_TOLERANCE = 1e-4
"""Tolerance from which on the coupled equation is solved by conjugate gradients, which know when they are
there, instead of a number of cycles that was measured to do."""


class ScalarDiffusion:
    """(1 - dt mu Lap) f' = f for one field and constant mu.

    With `conserved`, for densities, the sum of f is kept to rounding however far the solve goes. The
    weights of its sweeps are one number, so they keep it; the little that cycles on grids of odd sizes
    change is taken off evenly.
    """

    def __init__(
        self, grid: Grid, fluid: Fluid, points: Location, device: wp.Device, conserved: bool = False
    ):
        self.fluid, self.device, self.layout = fluid, device, Layout(grid.nx, grid.ny)
        self._conserved = conserved
        size = (grid.width, grid.height)
        levels = [FivePoint(*n, size, points, device) for n in hierarchy(grid.nx, grid.ny, size)]
        self.system = LinearSystem(levels, device, FIVE_POINT_INTERVAL)
        self.method = SolveMethod("none", 0)
        self._change, self._answer = (vector(self.layout, device, 1) for _ in range(2))
        self._numbers = Scalars(device, "mean", one=1.0)
        self._dt_mu = -1.0

    def plan(self, dt_mu: float) -> SolveMethod:
        """Make ready for steps of dt times mu; what the solve will be, "none" where nothing diffuses."""
        if dt_mu == self._dt_mu:
            return self.method
        self.method = SolveMethod("none", 0)
        if dt_mu > 0:
            for level in self.system.levels:
                level.set_coefficients(1.0, dt_mu)
            self.system.invert_coarsest()
            self.method = self._choose()
            self.system.prepare(self.method)
        self._dt_mu = dt_mu
        return self.method

    def _choose(self) -> SolveMethod:
        if self.fluid.solver == "jacobi":
            return SolveMethod("jacobi", self.fluid.sweeps)
        top, tolerance = self.system.levels[0], self.fluid.diffusion_tolerance
        sweeps = self.system.plan_sweeps(top.least, 2 - top.least, top.centre, tolerance)
        return sweeps or self.system.plan_cycles(tolerance)

    def diffuse(self, f: wp.array, out: wp.array) -> None:
        """out = f (with ghosts) diffused, with ghosts."""
        top = self.system.levels[0]
        top.residual((f,), (f,), self._change)
        self.system.solve(self.method, self._change, self._answer)
        if self._conserved and self.method.name == "multigrid":
            self._balance(*self._answer)
        inputs = [f, *self._answer, self._numbers.one]
        algebra.add_scaled.launch(self.layout, self.device, inputs, [out])
        top.fill((out,))

    def adjoint(self, out_bar: wp.array, f_bar: wp.array) -> wp.array:
        """The transpose of `diffuse`: f_bar = out_bar + (1 - A) M out_bar, without ghosts.

        Returns lambda = M out_bar, with ghosts, which the next solve writes over.
        """
        top, b = self.system.levels[0], self._change
        alone(lambda: copy(out_bar, *b))
        if self._conserved and self.method.name == "multigrid":
            self._balance(*b)
        self.system.solve(self.method, b, self._answer)
        top.residual(self._answer, self._answer, b)
        algebra.add_scaled.launch(self.layout, self.device, [out_bar, *b, self._numbers.one], [f_bar])
        return self._answer[0]

    def _balance(self, change: wp.array) -> None:
        """Take its mean off a change."""
        self.system.inner.mean(change, self._numbers.mean)
        algebra.subtract_number.launch(self.layout, self.device, [self._numbers.mean], [change])

    def measure(self) -> Residual:
        """What the last solve left, relative to the change it made."""
        if not self.method.iterations:
            return Residual("none", 0, 0.0, 0.0)
        return self.system.measure(self.method, self._change, self._answer)


class SeparateDiffusion:
    """(1 - dt mu Lap) v' = v for constant mu, one component apart from the other.

    After the projection that equals the coupled equation between periodic and free-slip walls; at a
    no-slip wall it does not.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.fluid, walls = fluid, fluid.walls
        points = (Location(walls.u_rules(), (True, False)), Location(walls.v_rules(), (False, True)))
        self.components = [ScalarDiffusion(grid, fluid, own, device) for own in points]
        self.device, self.layout = device, Layout(grid.nx, grid.ny)
        self.out, self.mu_bar = vector(self.layout, device, 2), field(self.layout, device)
        self._numbers = Scalars(device, ax=grid.hx**-2, ay=grid.hy**-2)
        self._dt, self._planned_dt = zeros(1, device), 0.0

    out: Vector
    """What `diffuse` found last."""
    mu_bar: wp.array
    """The gradient with respect to the viscosity of each cell, which every step back adds to."""

    @property
    def method(self) -> SolveMethod:
        """The method by which both are solved."""
        return self.components[0].method

    def plan(self, dt: float) -> SolveMethod:
        """Make ready for steps of dt; what the solve will be, "none" where nothing diffuses."""
        for component in self.components:
            component.plan(dt * self.fluid.viscosity)
        if dt != self._planned_dt:
            fill(dt, self._dt)
            self._planned_dt = dt
        return self.method

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate what the transpose needs; that it finds the gradient of the viscosity as well."""
        attach_gradients(self.out, self.layout)
        self._of_viscosity = of_viscosity

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity (with ghosts) diffused, with ghosts."""
        for component, f, out in zip(self.components, velocity, self.out, strict=True):
            component.diffuse(f, out)
        record(partial(self._diffuse_back, velocity), velocity, self.out)
        return self.out

    def _diffuse_back(self, velocity: Vector) -> None:
        """Write the velocity's gradient, with ghosts; add mu_bar += lambda dt Lap v' for each component."""
        for component, f, out in zip(self.components, velocity, self.out, strict=True):
            found = component.adjoint(out.grad, f.grad)
            component.system.levels[0].fill((f.grad,))
            if self._of_viscosity:
                inputs = [out, found, self._dt, self._numbers.ax, self._numbers.ay, self.layout.pitch]
                viscosity_adjoint.add_diffused.launch(self.layout, self.device, inputs, [self.mu_bar])

    def measure(self) -> Residual:
        """What the last solve for u left, relative to the change it made."""
        return self.components[0].measure()


class CoupledDiffusion:
    """(1 + dt alpha) v' - dt div (mu (grad v' + grad v'^T)) = v, u and v together."""

    def __init__(self, fluid: Fluid, medium: Coefficients, device: wp.Device, jump_tolerance: float = 1.0):
        self._jump_tolerance = jump_tolerance
        self.fluid, self.medium, self.device = fluid, medium, device
        self.layout = medium.levels[0].layout
        levels = [ViscousStress(level, medium.size, fluid.walls, device) for level in medium.levels]
        self.system = LinearSystem(levels, device, STRESS_INTERVAL)
        self.method = SolveMethod("none", 0)
        self.out, self._start, self._change, self._answer = (vector(self.layout, device, 2) for _ in range(4))
        numbers = {"inverse_hx": 1 / medium.grid.hx, "inverse_hy": 1 / medium.grid.hy}
        self._numbers = Scalars(device, one=1.0, **numbers)

    out: Vector
    """What `diffuse` found last."""

    def plan(self, dt: float) -> SolveMethod:
        """Take the step and the medium's bounds; what the solve will be. `prepare` must follow."""
        stiffness, tolerance = self.medium.stiffness(dt), self.fluid.diffusion_tolerance
        self._norm = stiffness.greatest
        for depth, level in enumerate(self.system.levels):
            level.set_step(dt, 0.0 if depth else stiffness.least)
        if self.fluid.solver == "jacobi":
            self.method = SolveMethod("jacobi", self.fluid.sweeps)
        elif sweeps := self.system.plan_sweeps(stiffness.least, 1.0, 1.0, tolerance):
            self.method = sweeps
        elif stiffness.jump > JUMP_LIMIT or tolerance <= SURE_TOLERANCE:
            self.method = conjugate_gradients(min(tolerance, self._jump_tolerance))
        else:
            self.method = self.system.plan_cycles(tolerance)
        self.system.prepare(self.method)
        return self.method

    def prepare(self) -> None:
        """Follow the medium: launches only."""
        for level in self.system.levels:
            level.weigh()
        self.system.invert_coarsest()

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate what the transpose needs; that it finds the gradient of the viscosity as well."""
        attach_gradients(self.out, self.layout)
        self._of_viscosity = of_viscosity

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity (with ghosts) diffused, with ghosts."""
        top = self.system.levels[0]
        with together():
            for f, beta, start in zip(velocity, self.medium.levels[0].beta, self._start, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, beta], [start])
        top.fill(self._start)
        top.residual(velocity, self._start, self._change)
        self.system.solve(self.method, self._change, self._answer, scale=velocity)
        with together():
            for f, change, out in zip(self._start, self._answer, self.out, strict=True):
                algebra.add_scaled.launch(self.layout, self.device, [f, change, self._numbers.one], [out])
        top.fill(self.out)
        record(partial(self._diffuse_back, velocity), velocity, self.out)
        return self.out

    def _diffuse_back(self, velocity: Vector) -> None:
        """Write the velocity's gradient, with ghosts; add mu_bar -= dt (strain of v') (strain of lambda)."""
        found = self.adjoint(bars(self.out), bars(velocity))
        self.system.levels[0].fill(bars(velocity))
        if self._of_viscosity:
            inverse_h = [self._numbers.inverse_hx, self._numbers.inverse_hy]
            inputs = [*self.out, *found, self.medium.dt, *inverse_h, self.layout.pitch]
            outputs = [self.medium.levels[0].mu.grad]
            viscosity_adjoint.take_dissipation.launch(self.layout, self.device, inputs, outputs)

    def adjoint(self, out_bar: Vector, f_bar: Vector) -> Vector:
        """The transpose of `diffuse`: f_bar = beta (out_bar - A lambda) + lambda, without ghosts.

        Returns lambda = M out_bar, with ghosts, which the next solve writes over.
        """
        top, beta = self.system.levels[0], self.medium.levels[0].beta
        answer = self._answer
        self.system.solve(self.method, out_bar, answer, scale=out_bar)
        top.residual(out_bar, answer, self._change)
        with together():
            for change, b, start in zip(self._change, beta, self._start, strict=True):
                algebra.multiply.launch(self.layout, self.device, [change, b], [start])
        with together():
            for start, f, to in zip(self._start, answer, f_bar, strict=True):
                algebra.add_scaled.launch(self.layout, self.device, [start, f, self._numbers.one], [to])
        return answer

    def measure(self) -> Residual:
        """What the last solve left, relative to the change it made."""
        if not self.method.iterations:
            return Residual("none", 0, 0.0, 0.0)
        return self.system.measure(self.method, self._change, self._answer, self._norm)
