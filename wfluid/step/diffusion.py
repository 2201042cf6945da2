"""The diffusion of a step: implicit Euler. Constant viscosity: u and v separately; else both together.

Both solve A d = v - A v0 for the change d = v' - v0, where v0 = v / (1 + dt alpha) is the velocity after drag
alone. So uniform motion stays exact, and the solver's tolerance is relative to the change. With a symmetric
solver M the stage is v' = v0 + M (v - A v0), and its transpose has the same factors in opposite order.

The error of a solve stays with the flow, and that of the next step adds to it. So a step's error is limited
by what the errors of all steps make the map lose, `Fluid.diffusion_loss`. Beside stiff paint a relative
residual does not show that loss: forces within the paint are large, and the motion of a stiff patch as a body
changes the residual little.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.limits import DIFFUSION_LOSS
from wfluid.fields.arrays import Scalars, Vector, assign, copy, field, fill, vector, zeros
from wfluid.kernels.adjoint import viscosity as viscosity_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import alone, together
from wfluid.kernels.solve import algebra
from wfluid.model.fluid import Fluid
from wfluid.solve.multigrid import Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, STRESS_INTERVAL, FivePoint, ViscousStress
from wfluid.solve.system import (
    CONTRAST_LIMIT,
    JUMP_LIMIT,
    LinearSystem,
    Residual,
    SolveMethod,
    conjugate_gradients,
)
from wfluid.step.coefficients import Coefficients, Stiffness
from wfluid.step.tape import attach_gradients, bars, record

SURE_TOLERANCE = 1e-4
"""At this tolerance and below, the coupled equation is solved by conjugate gradients, which check their
residual. Above it, a number of multigrid cycles runs that was measured to suffice."""

ERROR_TIME = 0.5
"""Time for which an error of the velocity moves the map [s]: viscosity and walls end it. Where all errors
stay, it is the mean of a run of 1 s."""

MARGIN = 3.0
"""Factor within which the estimated loss of the map is right: conjugate gradients stop as far below
`Fluid.diffusion_loss`."""


def tolerance_of(fluid: Fluid, fixed_tolerance: float) -> float:
    """The relative tolerance of sweeps and cycles: in proportion to a lower `diffusion_loss`, and at most
    `fixed_tolerance`.
    """
    tolerance = fluid.diffusion_tolerance * min(1.0, fluid.diffusion_loss / DIFFUSION_LOSS)
    return max(1e-14, min(tolerance, fixed_tolerance))


class ScalarDiffusion:
    """(1 - dt mu Lap) f' = f for one field and constant mu.

    With `conserved`, for densities, the sum of f does not change, up to rounding, whatever the tolerance.
    Sweeps have one weight for all cells and so conserve it. Cycles on grids of odd sizes change it a little;
    the mean of their change is subtracted.
    """

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        points: Location,
        device: wp.Device,
        conserved: bool = False,
        fixed_tolerance: float = 1.0,
    ):
        self._fixed_tolerance = fixed_tolerance
        self.fluid, self.device, self.layout = fluid, device, Layout(grid.nx, grid.ny)
        self._conserved = conserved
        size = (grid.width, grid.height)
        self._levels = [
            FivePoint(nx, ny, size, points, device) for nx, ny in hierarchy(grid.nx, grid.ny, size)
        ]
        self.system = LinearSystem(self._levels, device, FIVE_POINT_INTERVAL, smooth_exact=conserved)
        self.method = SolveMethod("none", 0)
        self._b, self._x = (vector(self.layout, device, 1) for _ in range(2))
        self._numbers = Scalars(device, "mean", one=1.0)
        self._dt_mu = -1.0

    def plan(self, dt_mu: float) -> SolveMethod:
        """Set up steps with the product dt mu. Returns the method of the solve, "none" for dt mu = 0."""
        if dt_mu == self._dt_mu:
            return self.method
        self.method = SolveMethod("none", 0)
        if dt_mu > 0:
            for level in self._levels:
                level.set_coefficients(1.0, dt_mu)
            self.system.invert_coarsest()
            self.method = self._choose()
            self.system.prepare(self.method)
        self._dt_mu = dt_mu
        return self.method

    def _choose(self) -> SolveMethod:
        if self.fluid.solver == "jacobi":
            return SolveMethod("jacobi", self.fluid.sweeps)
        top, tolerance = self._levels[0], tolerance_of(self.fluid, self._fixed_tolerance)
        sweeps = self.system.plan_sweeps(top.least, 2 - top.least, top.centre, tolerance)
        return sweeps or self.system.plan_cycles(tolerance)

    def diffuse(self, f: wp.array, out: wp.array) -> None:
        """out = f (with ghosts) after diffusion, with ghosts."""
        top = self._levels[0]
        top.residual((f,), (f,), self._b)
        self.system.solve(self.method, self._b, self._x)
        if self._conserved and self.method.name == "multigrid":
            self._subtract_mean(*self._x)
        inputs = [f, *self._x, self._numbers.one]
        algebra.add_scaled.launch(self.layout, self.device, inputs, [out])
        top.fill((out,))

    def adjoint(self, out_bar: wp.array, f_bar: wp.array) -> wp.array:
        """The transpose of `diffuse`: f_bar = out_bar + (1 - A) M out_bar, without ghosts.

        Returns lambda = M out_bar, with ghosts, an array that the next solve overwrites.
        """
        b, x = self._b, self._x
        alone(lambda: copy(out_bar, *b))
        if self._conserved and self.method.name == "multigrid":
            self._subtract_mean(*b)
        self.system.solve(self.method, b, x)
        self._levels[0].residual(x, x, b)
        algebra.add_scaled.launch(self.layout, self.device, [out_bar, *b, self._numbers.one], [f_bar])
        return x[0]

    def _subtract_mean(self, f: wp.array) -> None:
        """Subtract from a field its mean, in place."""
        self.system.inner.mean(f, self._numbers.mean)
        algebra.subtract_number.launch(self.layout, self.device, [self._numbers.mean], [f])

    def measure(self) -> Residual:
        """The residual of the last `diffuse`, relative to the change it made, with the error."""
        if not self.method.iterations:
            return Residual("none", 0, 0.0, 0.0)
        residual = self.system.measure(self.method, self._b, self._x)
        return replace(residual, error=self.error())

    def error(self) -> float:
        """The estimated error of the last `diffuse`: root mean square over the cells."""
        return _mean_error(self.system, self.method, self._b, self._x) if self.method.iterations else 0.0


class SeparateDiffusion:
    """(1 - dt mu Lap) v' = v for constant mu, u and v solved separately.

    With periodic and free-slip walls the velocity after the projection is that of the coupled equation; with
    no-slip walls it is not.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device, fixed_tolerance: float = 1.0):
        self.fluid, walls = fluid, fluid.boundary
        points = (Location(walls.u_rules(), (True, False)), Location(walls.v_rules(), (False, True)))
        self.components = [
            ScalarDiffusion(grid, fluid, location, device, fixed_tolerance=fixed_tolerance)
            for location in points
        ]
        self.device, self.layout = device, Layout(grid.nx, grid.ny)
        self.out, self.mu_bar = vector(self.layout, device, 2), field(self.layout, device)
        self._numbers = Scalars(device, ax=grid.hx**-2, ay=grid.hy**-2)
        self._dt, self._planned_dt = zeros(1, device), 0.0

    out: Vector
    """The result of the last `diffuse`, with ghosts."""
    mu_bar: wp.array
    """The gradient with respect to the viscosity of each cell; every backward step adds to it."""

    @property
    def method(self) -> SolveMethod:
        """The method of both solves."""
        return self.components[0].method

    def plan(self, dt: float) -> SolveMethod:
        """Set up steps of dt. Returns the method of both solves, "none" for viscosity or dt 0."""
        mu = self.fluid.viscosity
        assert isinstance(mu, float)
        for component in self.components:
            component.plan(dt * mu)
        if dt != self._planned_dt:
            fill(dt, self._dt)
            self._planned_dt = dt
        return self.method

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate the arrays of the transpose. With `of_viscosity` it computes that gradient as well."""
        attach_gradients(self.out, self.layout, self.device)
        self._of_viscosity = of_viscosity

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity (with ghosts) after diffusion, with ghosts."""
        for component, f, out in zip(self.components, velocity, self.out, strict=True):
            component.diffuse(f, out)
        record(partial(self._diffuse_back, velocity), velocity, self.out)
        return self.out

    def _diffuse_back(self, velocity: Vector) -> None:
        """Write the velocity's gradient, with ghosts; add mu_bar += lambda dt Lap v' for each component."""
        for component, f, out in zip(self.components, velocity, self.out, strict=True):
            lambda_ = component.adjoint(out.grad, f.grad)
            component.system.levels[0].fill((f.grad,))
            if self._of_viscosity:
                inputs = [out, lambda_, self._dt, self._numbers.ax, self._numbers.ay, self.layout.pitch]
                viscosity_adjoint.add_diffused.launch(self.layout, self.device, inputs, [self.mu_bar])

    def measure(self) -> Residual:
        """The residual for u, relative to its change, or for v where u is at rest; the error of both."""
        of_u, of_v = self.components
        u, v = of_u.measure(), of_v.error()
        residual = u if u.norm_b else of_v.measure()
        return replace(residual, error=math.hypot(u.error, v))


class CoupledDiffusion:
    """(1 + dt alpha) v' - dt div (mu (grad v' + grad v'^T)) = v, u and v together.

    With scheme "paper" it is (1 + dt alpha) f' - dt div (mu grad f') = f for each component f, which for
    constant mu is the equation of `SeparateDiffusion`.
    """

    def __init__(
        self,
        fluid: Fluid,
        coefficients: Coefficients,
        device: wp.Device,
        jump_tolerance: float = 1.0,
        fixed_tolerance: float = 1.0,
    ):
        self._jump_tolerance, self._fixed_tolerance = jump_tolerance, fixed_tolerance
        self.fluid, self.coefficients, self.device = fluid, coefficients, device
        self.layout = coefficients.levels[0].layout
        size, walls = coefficients.size, fluid.boundary
        paper = fluid.scheme == "paper"
        self._levels = [
            ViscousStress(level, size, walls, device, coupled=not paper) for level in coefficients.levels
        ]
        self.system = LinearSystem(self._levels, device, STRESS_INTERVAL)
        self.method = SolveMethod("none", 0)
        self.out, self._scaled, self._b, self._x = (vector(self.layout, device, 2) for _ in range(4))
        numbers = {"inverse_hx": 1 / coefficients.grid.hx, "inverse_hy": 1 / coefficients.grid.hy}
        self._numbers = Scalars(device, one=1.0, **numbers)
        self._error = zeros(1, device)

    out: Vector
    """The result of the last `diffuse`, with ghosts."""

    def plan(self, dt: float) -> SolveMethod:
        """Choose the method of the solve for steps of dt, and return it.

        `update_coefficients` must run before the next `diffuse`: `Step.plan` sees to that.
        """
        stiffness, tolerance = self.coefficients.stiffness(dt), self.fluid.diffusion_tolerance
        fixed = tolerance_of(self.fluid, self._fixed_tolerance)
        self._allow(dt)
        self._norm = stiffness.greatest
        paper, jacobi = self.fluid.scheme == "paper", self.fluid.solver == "jacobi"
        for depth, level in enumerate(self._levels):
            level.set_step(dt, 0.0 if depth else stiffness.least, plain=paper and jacobi)
        if jacobi:
            self.method = SolveMethod("jacobi", self.fluid.sweeps)
        elif sweeps := self.system.plan_sweeps(stiffness.least, 1.0, 1.0, fixed):
            self.method = sweeps
        elif _stiff(stiffness) or fixed <= SURE_TOLERANCE:
            self.method = conjugate_gradients(min(tolerance, self._jump_tolerance))
        else:
            self.method = self.system.plan_cycles(fixed)
        self.system.prepare(self.method)
        return self.method

    def _allow(self, dt: float) -> None:
        """Set the error of a step of dt that costs the map at most `Fluid.diffusion_loss` in a second."""
        cells = self.layout.nx * self.layout.ny
        error = self.fluid.diffusion_loss * dt / (ERROR_TIME * MARGIN)
        assign([cells * error**2], self._error)

    def update_coefficients(self) -> None:
        """Bring the solver up to date with the coefficients and the step: launches only."""
        for level in self._levels:
            level.weigh()
        self.system.invert_coarsest()

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate the arrays of the transpose. With `of_viscosity` it computes that gradient as well."""
        attach_gradients(self.out, self.layout, self.device)
        self._of_viscosity = of_viscosity

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity (with ghosts) after diffusion and drag, with ghosts."""
        top, dragged = self._levels[0], self._scaled
        with together():
            for f, beta, to in zip(velocity, self.coefficients.levels[0].beta, dragged, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, beta], [to])
        top.fill(dragged)
        top.residual(velocity, dragged, self._b)
        self.system.solve(self.method, self._b, self._x, scale=velocity, error=self._error)
        with together():
            for f, change, out in zip(dragged, self._x, self.out, strict=True):
                algebra.add_scaled.launch(self.layout, self.device, [f, change, self._numbers.one], [out])
        top.fill(self.out)
        record(partial(self._diffuse_back, velocity), velocity, self.out)
        return self.out

    def _diffuse_back(self, velocity: Vector) -> None:
        """Write the velocity's gradient, with ghosts; add mu_bar -= dt (strain of v') (strain of lambda)."""
        lambda_ = self.adjoint(bars(self.out), bars(velocity))
        self._levels[0].fill(bars(velocity))
        if self._of_viscosity:
            inverse_h = [self._numbers.inverse_hx, self._numbers.inverse_hy]
            inputs = [*self.out, *lambda_, self.coefficients.dt, *inverse_h, self.layout.pitch]
            outputs = [self.coefficients.levels[0].mu.grad]
            viscosity_adjoint.take_dissipation.launch(self.layout, self.device, inputs, outputs)

    def adjoint(self, out_bar: Vector, f_bar: Vector) -> Vector:
        """The transpose of `diffuse`: f_bar = beta (out_bar - A lambda) + lambda, without ghosts.

        Returns lambda = M out_bar, with ghosts, arrays that the next solve overwrites.
        """
        beta, residual, scaled, lambda_ = self.coefficients.levels[0].beta, self._b, self._scaled, self._x
        self.system.solve(self.method, out_bar, lambda_, scale=out_bar)
        self._levels[0].residual(out_bar, lambda_, residual)
        with together():
            for f, b, to in zip(residual, beta, scaled, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, b], [to])
        with together():
            for f, x, to in zip(scaled, lambda_, f_bar, strict=True):
                algebra.add_scaled.launch(self.layout, self.device, [f, x, self._numbers.one], [to])
        return lambda_

    def measure(self) -> Residual:
        """The residual of the last `diffuse`, relative to the change it made."""
        if not self.method.iterations:
            return Residual("none", 0, 0.0, 0.0)
        residual = self.system.measure(self.method, self._b, self._x, self._norm)
        return replace(residual, error=_mean_error(self.system, self.method, self._b, self._x))


def _stiff(stiffness: Stiffness) -> bool:
    """Whether the coefficients differ by more than cycles can solve for."""
    return stiffness.jump > JUMP_LIMIT or stiffness.contrast > CONTRAST_LIMIT


def _mean_error(system: LinearSystem, method: SolveMethod, b: Vector, x: Vector) -> float:
    """The estimated error of a solve: root mean square over the cells."""
    layout = system.levels[0].layout
    return system.error(method, b, x) / math.sqrt(layout.nx * layout.ny)
