"""The projection of a step: v - beta grad q with div (beta grad q) = div v, beta = 1 where nothing drags."""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Scalars, Vector, field, vector
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import projection
from wfluid.model.fluid import Fluid
from wfluid.solve.multigrid import Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, FivePoint, VariablePoisson
from wfluid.solve.system import JUMP_LIMIT, LinearSystem, Residual, SolveMethod, conjugate_gradients
from wfluid.step.coefficients import Coefficients


class Projection:
    """Takes the divergence out of a velocity."""

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        medium: Coefficients | None,
        device: wp.Device,
        jump_tolerance: float = 1.0,
    ):
        self._jump_tolerance = jump_tolerance
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
        self.how = SolveMethod("multigrid", fluid.pressure_cycles)
        if fluid.solver == "jacobi":
            self.how = SolveMethod("jacobi", fluid.sweeps)
        if not medium:
            self.prepare()
        self.system.prepare(self.how)
        self._q, self._minus_div = ((field(self.layout, device),) for _ in range(2))
        numbers = Scalars(device, inverse_hx=1 / grid.hx, inverse_hy=1 / grid.hy)
        self._inverse_h = [numbers.inverse_hx, numbers.inverse_hy]
        self._resisted = vector(self.layout, device, 2) if medium else ()

    def plan(self, dt: float) -> SolveMethod:
        """Choose the solve for the medium's drag and steps of dt. `prepare` must follow."""
        if self.medium and self.fluid.solver != "jacobi":
            if self.medium.drag_jump(dt) > JUMP_LIMIT:
                self.how = conjugate_gradients(min(self.fluid.pressure_tolerance, self._jump_tolerance))
            else:
                self.how = SolveMethod("multigrid", self.fluid.pressure_cycles)
            self.system.prepare(self.how)
        return self.how

    def prepare(self) -> None:
        """Follow the medium: launches only."""
        self.system.invert_coarsest()

    def project(
        self, velocity: Vector, out: Vector, prescribe: Callable[[wp.array], None] | None = None
    ) -> None:
        """out = the velocity (with ghosts) without its divergence; out comes without ghosts.

        `prescribe` adds a divergence that is to stay to the field it is called with.
        """
        beta, pitch = self.medium.levels[0].beta if self.medium else (), self.layout.pitch
        inputs = [*velocity, *self._inverse_h, pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, self._minus_div)
        if prescribe:
            prescribe(*self._minus_div)
        self.system.solve(self.how, self._minus_div, self._q)
        subtract = projection.subtract_gradient_beta if beta else projection.subtract_gradient
        inputs = [*velocity, *self._q, *beta, *self._inverse_h, pitch]
        subtract.launch(self.layout, self.device, inputs, out)

    def adjoint(
        self,
        out_bar: Vector,
        velocity_bar: Vector,
        fill: Callable[[Vector], None],
        q_bar: wp.array | None = None,
    ) -> None:
        """The transpose of `project`: velocity_bar = out_bar - grad x, x = M (-div beta out_bar - q_bar).

        Without drag that is the projection itself. `out_bar` comes with ghosts, which `fill` fills; `q_bar`
        is the gradient with respect to the pressure found, -x that with respect to what `prescribe` added.
        """
        beta, pitch = self.medium.levels[0].beta if self.medium else (), self.layout.pitch
        resisted = out_bar
        if beta:
            resisted = self._resisted
            for f, b, to in zip(out_bar, beta, resisted, strict=True):
                algebra.multiply.launch(self.layout, self.device, [f, b], [to])
            fill(resisted)
        inputs = [*resisted, *self._inverse_h, pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, self._minus_div)
        if q_bar is not None:
            algebra.subtract.launch(self.layout, self.device, [q_bar], self._minus_div)
        self.system.solve(self.how, self._minus_div, self._q)
        inputs = [*out_bar, *self._q, *self._inverse_h, pitch]
        projection.subtract_gradient.launch(self.layout, self.device, inputs, velocity_bar)

    @property
    def adjoint_answer(self) -> wp.array:
        """x of the last `adjoint`."""
        return self._q[0]

    def kept_adjoint(self, velocity_bar: Vector, q_bar: wp.array, kept: wp.array, out: wp.array) -> None:
        """The transpose of taking the part `kept` of the last pressure off and adding it again.

        out = kept (q_bar + div velocity_bar); `velocity_bar` with ghosts.
        """
        inputs = [*velocity_bar, *self._inverse_h, self.layout.pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, self._minus_div)
        algebra.copy.launch(self.layout, self.device, [q_bar], [out])
        algebra.subtract.launch(self.layout, self.device, self._minus_div, [out])
        algebra.scale.launch(self.layout, self.device, [out, kept], [out])

    def add_pressure(self, q: wp.array, kept: wp.array, out: wp.array) -> None:
        """out = the impulse of the pressure: the part `kept` of q, taken off before, and the projected."""
        inputs = [*self._q, q, kept]
        algebra.add_scaled.launch(self.layout, self.device, inputs, [out])
        self.system.levels[0].fill((out,))

    def measure(self) -> tuple[Residual, float]:
        """What the last projection left of the divergence not prescribed: residual, largest value [1/s]."""
        residual = self.system.measure(self.how, self._minus_div, self._q)
        return residual, self.system.inner.largest(self.system.residual[0])
