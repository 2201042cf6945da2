"""The projection of a step: v - beta grad q with div (beta grad q) = div v - s, beta = 1 without drag.

s is the divergence that growths prescribe. Where diffusion and projection do not commute, a fraction
`pressure_part` of the last step's pressure is subtracted before the diffusion, and added to the pressure
that the projection then finds. The transpose of each stage follows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Scalars, Vector, field, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import projection
from wfluid.model.fluid import Fluid
from wfluid.solve.multigrid import Level, Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, FivePoint, VariablePoisson
from wfluid.solve.system import JUMP_LIMIT, LinearSystem, Residual, SolveMethod, conjugate_gradients
from wfluid.step.coefficients import Coefficients
from wfluid.step.forcing import Forcing
from wfluid.step.tape import attach_gradients, bars, record


class Projection:
    """Removes the divergence of a velocity."""

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        coefficients: Coefficients | None,
        device: wp.Device,
        ghosts: Sequence[Ghosts],
        jump_tolerance: float = 1.0,
    ):
        """`coefficients` hold the drag, None without drag; `ghosts` are those of a velocity."""
        self._ghosts, self._jump_tolerance = ghosts, jump_tolerance
        self.fluid, self.coefficients, self.device, self.layout = (
            fluid,
            coefficients,
            device,
            Layout(grid.nx, grid.ny),
        )
        size, walls = (grid.width, grid.height), fluid.boundary
        levels: list[Level] = []
        if coefficients:
            levels += [VariablePoisson(level, size, walls, device) for level in coefficients.levels]
        else:
            points = Location(walls.centre_rules())
            for nx, ny in hierarchy(grid.nx, grid.ny, size):
                poisson = FivePoint(nx, ny, size, points, device)
                poisson.set_coefficients(0.0, 1.0)
                levels.append(poisson)
        self.system = LinearSystem(levels, device, FIVE_POINT_INTERVAL, singular=True)
        self.method = SolveMethod("multigrid", fluid.pressure_cycles)
        if fluid.solver == "jacobi":
            self.method = SolveMethod("jacobi", fluid.sweeps)
        if not coefficients:
            self.update_coefficients()
        self.system.prepare(self.method)
        self.q, self._minus_div = (field(self.layout, device) for _ in range(2))
        self.without_pressure = vector(self.layout, device, 2)
        numbers = Scalars(device, inverse_hx=1 / grid.hx, inverse_hy=1 / grid.hy)
        self._inverse_h = [numbers.inverse_hx, numbers.inverse_hy]
        self.accumulates_pressure = not fluid.separable and fluid.scheme != "paper"

    q: wp.array
    """The pressure of the last projection, with ghosts [longer side^2/s]."""
    accumulates_pressure: bool
    """Whether a step adds q to a part of the pressure before it, so that q has a gradient."""
    without_pressure: Vector
    """The velocity after `subtract_pressure`, with ghosts."""

    def allow_gradients(self) -> None:
        """Allocate the arrays of the transposes."""
        attach_gradients([self.q, *self.without_pressure], self.layout, self.device)
        self._answer, self._scaled_bar = vector(self.layout, self.device, 2)
        self._beta_out_bar = vector(self.layout, self.device, 2) if self.coefficients else ()

    def plan(self, dt: float) -> SolveMethod:
        """Choose the method of the solve for steps of dt. `update_coefficients` must run before it."""
        if self.coefficients and self.fluid.solver != "jacobi":
            if self.coefficients.drag_jump(dt) > JUMP_LIMIT:
                self.method = conjugate_gradients(min(self.fluid.pressure_tolerance, self._jump_tolerance))
            else:
                self.method = SolveMethod("multigrid", self.fluid.pressure_cycles)
            self.system.prepare(self.method)
        return self.method

    def update_coefficients(self) -> None:
        """Bring the solver up to date with the coefficients: launches only."""
        self.system.invert_coarsest()

    @property
    def _beta(self) -> Vector:
        """beta = 1 / (1 + dt alpha) on each face; empty without drag."""
        return self.coefficients.levels[0].beta if self.coefficients else ()

    def subtract_pressure(self, velocity: Vector, q: wp.array, forcing: Forcing) -> Vector:
        """velocity - pressure_part grad q, with ghosts; q with ghosts."""
        axes = ((1, forcing.pressure_part_hx), (self.layout.pitch, forcing.pressure_part_hy))
        with together():
            for f, (stride, part_h), out in zip(velocity, axes, self.without_pressure, strict=True):
                inputs = [f, q, part_h, stride]
                projection.subtract_slope.launch(self.layout, self.device, inputs, [out])
        self._fill(self.without_pressure)
        record(
            partial(self._subtract_pressure_back, velocity, q, forcing), [*velocity, q], self.without_pressure
        )
        return self.without_pressure

    def _subtract_pressure_back(self, velocity: Vector, q: wp.array, forcing: Forcing) -> None:
        """velocity_bar = out_bar, with ghosts; q_bar += pressure_part div out_bar."""
        out_bar, velocity_bar = bars(self.without_pressure), bars(velocity)
        with together():
            for f, to in zip(out_bar, velocity_bar, strict=True):
                algebra.copy.launch(self.layout, self.device, [f], [to])
        self._fill(velocity_bar)
        self._find_minus_divergence(out_bar)
        inputs = [self._minus_div, forcing.pressure_part]
        algebra.scale.launch(self.layout, self.device, inputs, [self._scaled_bar])
        algebra.subtract.launch(self.layout, self.device, [self._scaled_bar], [q.grad])

    def project(self, velocity: Vector, out: Vector, sources: Forcing | None = None) -> None:
        """out = the projected velocity; its divergence is what `sources` prescribe, or 0. With ghosts."""
        beta, pitch = self._beta, self.layout.pitch
        self._find_minus_divergence(velocity)
        if sources:
            sources.prescribe(self._minus_div)
        self.system.solve(self.method, (self._minus_div,), (self.q,))
        subtract = projection.subtract_gradient_beta if beta else projection.subtract_gradient
        inputs = [*velocity, self.q, *beta, *self._inverse_h, pitch]
        subtract.launch(self.layout, self.device, inputs, out)
        self._fill(out)
        written = [*out, self.q] if self.accumulates_pressure else out
        record(partial(self._project_back, velocity, out, sources), velocity, written)

    def _project_back(self, velocity: Vector, out: Vector, sources: Forcing | None) -> None:
        """velocity_bar = out_bar - grad x, x = M (-div beta out_bar - q_bar), M the solve; with ghosts.

        Without drag and q_bar that is the projection itself. The gradient of the prescribed divergence is -x.
        Also fills the ghosts of out_bar.
        """
        out_bar, velocity_bar, beta = bars(out), bars(velocity), self._beta
        self._fill(out_bar)
        beta_out_bar = out_bar
        if beta:
            beta_out_bar = self._beta_out_bar
            for f, b, to in zip(out_bar, beta, beta_out_bar, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, b], [to])
            self._fill(beta_out_bar)
        self._find_minus_divergence(beta_out_bar)
        if self.accumulates_pressure:
            algebra.subtract.launch(self.layout, self.device, [self.q.grad], [self._minus_div])
        self.system.solve(self.method, (self._minus_div,), (self._answer,))
        inputs = [*out_bar, self._answer, *self._inverse_h, self.layout.pitch]
        projection.subtract_gradient.launch(self.layout, self.device, inputs, velocity_bar)
        if sources:
            sources.prescribe_adjoint(self._answer)
        self._fill(velocity_bar)

    def add_pressure(self, q: wp.array, forcing: Forcing, out: wp.array) -> None:
        """out = self.q + pressure_part q, with ghosts."""
        inputs = [self.q, q, forcing.pressure_part]
        algebra.add_scaled.launch(self.layout, self.device, inputs, [out])
        self.system.levels[0].fill((out,))
        record(partial(self._add_pressure_back, q, forcing, out), [self.q, q], [out])

    def _add_pressure_back(self, q: wp.array, forcing: Forcing, out: wp.array) -> None:
        """The gradient of self.q = out_bar; q_bar += pressure_part out_bar."""
        algebra.copy.launch(self.layout, self.device, [out.grad], [self.q.grad])
        algebra.scale.launch(self.layout, self.device, [out.grad, forcing.pressure_part], [self._scaled_bar])
        algebra.add.launch(self.layout, self.device, [self._scaled_bar], [q.grad])

    def _find_minus_divergence(self, velocity: Vector) -> None:
        """`_minus_div` = -div of a velocity with ghosts."""
        inputs = [*velocity, *self._inverse_h, self.layout.pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, [self._minus_div])

    def _fill(self, velocity: Vector) -> None:
        """Fill the ghosts of a velocity."""
        with together():
            for f, ghosts in zip(velocity, self._ghosts, strict=True):
                ghosts.fill(f)

    def measure(self) -> tuple[Residual, float]:
        """What the last projection left of div v - s: the solve's residual, and the largest value [1/s]."""
        residual = self.system.measure(self.method, (self._minus_div,), (self.q,))
        return residual, self.system.inner.largest(self.system.residual[0])
