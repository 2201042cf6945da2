"""The projection of a step: v - beta grad q with div (beta grad q) = div v - s, beta = 1 where nothing drags.

s is the divergence that sources prescribe. Where diffusion and projection do not commute, the part `kept`
of the last step's pressure is taken off before the diffusion and added again to what the projection finds.
Every stage has its transpose below it.
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
from wfluid.solve.multigrid import Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, FivePoint, VariablePoisson
from wfluid.solve.system import JUMP_LIMIT, LinearSystem, Residual, SolveMethod, conjugate_gradients
from wfluid.step.coefficients import Coefficients
from wfluid.step.forcing import Forcing
from wfluid.step.tape import attach_gradients, bars, record


class Projection:
    """Takes the divergence out of a velocity."""

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        medium: Coefficients | None,
        device: wp.Device,
        ghosts: Sequence[Ghosts],
        jump_tolerance: float = 1.0,
    ):
        """`medium` is what drags, or None; `ghosts` are those of a velocity."""
        self._ghosts, self._jump_tolerance = ghosts, jump_tolerance
        self.fluid, self.medium, self.device, self.layout = fluid, medium, device, Layout(grid.nx, grid.ny)
        size, walls = (grid.width, grid.height), fluid.walls
        if medium:
            levels = [VariablePoisson(level, size, walls, device) for level in medium.levels]
        else:
            points = Location(walls.centre_rules())
            levels = [FivePoint(*n, size, points, device) for n in hierarchy(grid.nx, grid.ny, size)]
            for level in levels:
                level.set_coefficients(0.0, 1.0)
        self.system = LinearSystem(levels, device, FIVE_POINT_INTERVAL, singular=True)
        self.method = SolveMethod("multigrid", fluid.pressure_cycles)
        if fluid.solver == "jacobi":
            self.method = SolveMethod("jacobi", fluid.sweeps)
        if not medium:
            self.prepare()
        self.system.prepare(self.method)
        self.q, self._minus_div = (field(self.layout, device) for _ in range(2))
        self.pressed = vector(self.layout, device, 2)
        numbers = Scalars(device, inverse_hx=1 / grid.hx, inverse_hy=1 / grid.hy)
        self._inverse_h = [numbers.inverse_hx, numbers.inverse_hy]
        self.keeps_pressure = not fluid.separable

    q: wp.array
    """The pressure that the last projection found, with ghosts [longer side^2/s]."""
    keeps_pressure: bool
    """Whether a step adds what is found to the pressure kept, so that its gradient counts."""
    pressed: Vector
    """The velocity without the pressure kept, with ghosts."""

    def allow_gradients(self) -> None:
        """Allocate what the transposes need."""
        attach_gradients([self.q, *self.pressed], self.layout)
        self._answer, self._kept_bar = vector(self.layout, self.device, 2)
        self._resisted = vector(self.layout, self.device, 2) if self.medium else ()

    def plan(self, dt: float) -> SolveMethod:
        """Choose the solve for the medium's drag and steps of dt. `prepare` must follow."""
        if self.medium and self.fluid.solver != "jacobi":
            if self.medium.drag_jump(dt) > JUMP_LIMIT:
                self.method = conjugate_gradients(min(self.fluid.pressure_tolerance, self._jump_tolerance))
            else:
                self.method = SolveMethod("multigrid", self.fluid.pressure_cycles)
            self.system.prepare(self.method)
        return self.method

    def prepare(self) -> None:
        """Follow the medium: launches only."""
        self.system.invert_coarsest()

    @property
    def _beta(self) -> Vector:
        """The part of the velocity that a step's drag leaves on each face; empty where nothing drags."""
        return self.medium.levels[0].beta if self.medium else ()

    def subtract_pressure(self, velocity: Vector, q: wp.array, forcing: Forcing) -> Vector:
        """velocity - kept grad q, with ghosts; q with ghosts."""
        axes = ((1, forcing.kept_hx), (self.layout.pitch, forcing.kept_hy))
        with together():
            for f, (before, kept_h), out in zip(velocity, axes, self.pressed, strict=True):
                inputs = [f, q, kept_h, before]
                projection.subtract_slope.launch(self.layout, self.device, inputs, [out])
        self._fill(self.pressed)
        record(partial(self._subtract_pressure_back, velocity, q, forcing), [*velocity, q], self.pressed)
        return self.pressed

    def _subtract_pressure_back(self, velocity: Vector, q: wp.array, forcing: Forcing) -> None:
        """velocity_bar = pressed_bar, with ghosts; q_bar += kept div pressed_bar."""
        pressed_bar, velocity_bar = bars(self.pressed), bars(velocity)
        with together():
            for f, to in zip(pressed_bar, velocity_bar, strict=True):
                algebra.copy.launch(self.layout, self.device, [f], [to])
        self._fill(velocity_bar)
        self._find_minus_divergence(pressed_bar)
        inputs = [self._minus_div, forcing.kept]
        algebra.scale.launch(self.layout, self.device, inputs, [self._kept_bar])
        algebra.subtract.launch(self.layout, self.device, [self._kept_bar], [q.grad])

    def project(self, velocity: Vector, out: Vector, sources: Forcing | None = None) -> None:
        """out = the velocity with the divergence that `sources` prescribe, or none; both with ghosts."""
        beta, pitch = self._beta, self.layout.pitch
        self._find_minus_divergence(velocity)
        if sources:
            sources.prescribe(self._minus_div)
        self.system.solve(self.method, (self._minus_div,), (self.q,))
        subtract = projection.subtract_gradient_beta if beta else projection.subtract_gradient
        inputs = [*velocity, self.q, *beta, *self._inverse_h, pitch]
        subtract.launch(self.layout, self.device, inputs, out)
        self._fill(out)
        written = [*out, self.q] if self.keeps_pressure else out
        record(partial(self._project_back, velocity, out, sources), velocity, written)

    def _project_back(self, velocity: Vector, out: Vector, sources: Forcing | None) -> None:
        """velocity_bar = out_bar - grad x, x = M (-div beta out_bar - q_bar), M the solve; with ghosts.

        Without drag that is the projection itself. -x is the gradient of the divergence prescribed.
        """
        out_bar, velocity_bar, beta = bars(out), bars(velocity), self._beta
        self._fill(out_bar)
        resisted = out_bar
        if beta:
            resisted = self._resisted
            for f, b, to in zip(out_bar, beta, resisted, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, b], [to])
            self._fill(resisted)
        self._find_minus_divergence(resisted)
        if self.keeps_pressure:
            algebra.subtract.launch(self.layout, self.device, [self.q.grad], [self._minus_div])
        self.system.solve(self.method, (self._minus_div,), (self._answer,))
        inputs = [*out_bar, self._answer, *self._inverse_h, self.layout.pitch]
        projection.subtract_gradient.launch(self.layout, self.device, inputs, velocity_bar)
        if sources:
            sources.prescribe_adjoint(self._answer)
        self._fill(velocity_bar)

    def add_pressure(self, q: wp.array, forcing: Forcing, out: wp.array) -> None:
        """out = the pressure found and the part `kept` of q, with ghosts."""
        inputs = [self.q, q, forcing.kept]
        algebra.add_scaled.launch(self.layout, self.device, inputs, [out])
        self.system.levels[0].fill((out,))
        record(partial(self._add_pressure_back, q, forcing, out), [self.q, q], [out])

    def _add_pressure_back(self, q: wp.array, forcing: Forcing, out: wp.array) -> None:
        """Write the gradient of the pressure found; q_bar += kept out_bar."""
        algebra.copy.launch(self.layout, self.device, [out.grad], [self.q.grad])
        algebra.scale.launch(self.layout, self.device, [out.grad, forcing.kept], [self._kept_bar])
        algebra.add.launch(self.layout, self.device, [self._kept_bar], [q.grad])

    def _find_minus_divergence(self, velocity: Vector) -> None:
        """`_minus_div` = -div of a velocity with ghosts."""
        inputs = [*velocity, *self._inverse_h, self.layout.pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, [self._minus_div])

    def _fill(self, velocity: Vector) -> None:
        with together():
            for f, ghosts in zip(velocity, self._ghosts, strict=True):
                ghosts.fill(f)

    def measure(self) -> tuple[Residual, float]:
        """What the last projection left of the divergence not prescribed: residual, largest value [1/s]."""
        residual = self.system.measure(self.method, (self._minus_div,), (self.q,))
        return residual, self.system.inner.largest(self.system.residual[0])
