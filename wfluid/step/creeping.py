"""One step of a creeping fluid: the velocity answers the forces at once, without inertia.

    alpha v - div (2 mu S) + c v + grad p = mean of the forces over the step,   div v = s
    c = mu_m / reach^2, mu_m the harmonic mean of mu

This velocity carries points, densities and map over the step, by the same stages as in a fluid with inertia.
Where forces end, the picture stops. The drag c limits the distance over which a force is felt: without it a
force would move the picture up to its edges, and on periodic axes without limit. Drag that freezes counts as
alpha / (1 + alpha / most), with `most` the largest that the grid shows, mu / (a quarter of a cell)^2.

The forces' impulses I over a step h give the right-hand side (dt / h) I of `StokesFlow`, dt = 1 / c.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.limits import CREEPING_REACH
from wfluid.fields.arrays import Scalars, Vector, assign, copy, field, fill, vector, zeros
from wfluid.fields.state import State
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.adjoint import viscosity as viscosity_adjoint
from wfluid.kernels.cell.strips import alone, together
from wfluid.kernels.solve import algebra
from wfluid.model.fluid import Fluid
from wfluid.solve.stokes import StokesFlow
from wfluid.solve.system import Residual, SolveMethod
from wfluid.step.coefficients import Coefficients
from wfluid.step.forcing import Forcing
from wfluid.step.step import Step
from wfluid.step.tape import attach_gradients, bars, record

LEAST_PART = 1e-6
"""Least viscosity that counts in the harmonic mean, as a part of the largest."""

STILL_WITHIN = 0.25
"""Cells over which a velocity falls by the factor e inside a frozen part, at least: a larger drag makes no
difference that shows, but more iterations. A push of 48 px in a hole of 50 px in a frozen picture of 512 px
moves the frozen parts 20 px away by 0.9 px at 128 cells, 0.3 px at 256."""


class CreepingStep(Step):
    """The stages of a step without inertia. The velocity of a state is the one that led to it."""

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        device: wp.Device,
        jump_tolerance: float = 1.0,
        fixed_tolerance: float = 1.0,
    ):
        super().__init__(grid, fluid, device, fixed_tolerance)
        media = self._media
        self.flow = StokesFlow(media.levels, (grid.width, grid.height), fluid.boundary, device)
        self._tolerance = min(fluid.pressure_tolerance, jump_tolerance)
        self._still, self._load, self._last = (vector(self.layout, device, 2) for _ in range(3))
        self._swelling, self._left = (vector(self.layout, device, 2) for _ in range(2))
        self._prescribed = field(self.layout, device)
        self._of_impulse = zeros(1, device)
        self._factor = 0.0
        numbers = Scalars(device, inverse_hx=1 / grid.hx, inverse_hy=1 / grid.hy)
        self._inverse_h = [numbers.inverse_hx, numbers.inverse_hy]
        self._inner = InnerProduct(self.layout, device, 2)
        self.keeps_pressure, self.transports_with_new_velocity = False, True
        self._solves: tuple = ()
        self._scale_drags()

    @property
    def _media(self) -> Coefficients:
        """The viscosity and drag of the fluid.

        Raises:
            TypeError: it has none.
        """
        if self.coefficients is None:
            raise TypeError("a creeping fluid without coefficients")
        return self.coefficients

    def _scale_drags(self) -> None:
        """Find the time 1 / c [s] and limit the drag, by the viscosity at time 0.

        Raises:
            ValueError: that viscosity is 0 everywhere.
        """
        mu = self._media.at(0.0).astype(np.float64)
        if not mu.max() > 0:
            raise ValueError("a creeping fluid without viscosity: expected one above 0")
        mu = np.maximum(mu, LEAST_PART * mu.max())
        self._time = CREEPING_REACH**2 * float(np.mean(1 / mu))
        if self.fluid.freeze:
            alpha = self.fluid.freeze.sample(self.grid)
            most = mu / (STILL_WITHIN * min(self.grid.hx, self.grid.hy)) ** 2
            self._media.set_drag(alpha / (1 + alpha / most))

    def advance(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Write the state after the step to `state_out`: launches only; a tape that records takes them."""
        if self.fluid.viscosity_moves:
            self.update_coefficients(state_in)
        velocity = state_out.u, state_out.v
        self.answer(state_in, forcing, velocity)
        self.transport(state_in, state_out, velocity, forcing)
        record(partial(self._clear_gradients, state_in), (), ())

    def answer(self, state: State, forcing: Forcing, velocity: Vector) -> None:
        """velocity = the flow under the forces of a step, with ghosts."""
        load = self._load
        forcing.push(self._still, state.rho, self.pushed)
        with together():
            for f, to in zip(self.pushed, load, strict=True):
                algebra.scale.launch(self.layout, self.device, [f, self._of_impulse], [to])
        self.flow.fill(load)
        record(partial(self._load_back), self.pushed, load)
        sources = forcing if forcing.prescribes_divergence else None
        if sources is None:
            self.flow.solve(load, velocity)
        else:
            alone(lambda: fill(0.0, self._prescribed))
            sources.prescribe(self._prescribed)
            self.flow.swell(self._prescribed, self._swelling)
            self.flow.apply(load, self._swelling, self._left)
            self.flow.solve(self._left, velocity)
            with together():
                for f, out in zip(self._swelling, velocity, strict=True):
                    algebra.add.launch(self.layout, self.device, [f], [out])
            self.flow.fill(velocity)
        alone(lambda: [copy(f, to) for f, to in zip(velocity, self._last, strict=True)])
        record(partial(self._answer_back, velocity, sources), load, velocity)

    def _load_back(self) -> None:
        """Write the gradient of the velocity after forces."""
        with together():
            for f, to in zip(bars(self._load), bars(self.pushed), strict=True):
                algebra.scale.launch(self.layout, self.device, [f, self._of_impulse], [to])

    def _answer_back(self, velocity: Vector, sources: Forcing | None) -> None:
        """Write the gradient of the load, lambda; add mu_bar -= dt (strain of v) (strain of lambda).

        The solve is its own transpose. A prescribed divergence has the gradient -div beta (v_bar - A lambda),
        through the inverse of div beta grad.
        """
        velocity_bar, lambda_ = bars(velocity), bars(self._load)
        self.flow.fill(velocity_bar)
        self.flow.solve(velocity_bar, lambda_)
        if sources:
            self.flow.apply(velocity_bar, lambda_, self._left)
            self.flow.swell_back(self._left, self._prescribed)
            sources.prescribe_adjoint(self._prescribed)
        if self.fluid.viscosity_moves:
            inputs = [*velocity, *lambda_, self._media.dt, *self._inverse_h, self.layout.pitch]
            outputs = [self._media.levels[0].mu.grad]
            viscosity_adjoint.take_dissipation.launch(self.layout, self.device, inputs, outputs)

    def recompute(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Compute again what the transposes of a step read besides the states: launches only.

        Nothing is solved: the velocity is that of the state after the step.
        """
        if self.fluid.viscosity_moves:
            self.update_coefficients(state_in)
        forcing.push(self._still, state_in.rho, self.pushed)
        self.feet.trace((state_out.u, state_out.v), forcing)

    @property
    def mu_bar(self) -> wp.array:
        """The gradient with respect to the painted viscosity, at centres; every backward step adds to it."""
        return self._media.painted_mu.grad

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate the arrays of the transposes, once, and load their kernels.

        Raises:
            ValueError: the gradient `of_viscosity`: the drag c depends on it, and has no transpose.
        """
        if of_viscosity:
            raise ValueError("a creeping fluid has no gradient with respect to its viscosity")
        attach_gradients([*self._still, *self._load], self.layout, self.device)
        super().allow_gradients()

    def _clear_gradients(self, state: State) -> None:
        """Set to 0 the gradients to which several stages add; the backward pass of a step begins with it."""
        alone(lambda: fill(0.0, *bars(self._still)))
        super()._clear_gradients(state)

    def take_fluid(self, fluid: Fluid) -> None:
        """Replace the fluid by one that differs in the values of its viscosity only, not in its type."""
        if fluid.viscosity is self.fluid.viscosity:
            return
        self.fluid = self._media.fluid = fluid
        self._media.invalidate()
        self._scale_drags()

    def plan(self, t: float, dt: float, prepare: Callable[[], None]) -> tuple:
        """Set the step up for a length dt and an end at t. Returns the methods of its solves.

        Calls `prepare`, which must launch `update_coefficients`, if the coefficients have changed.
        """
        media = self._media
        self._scale_impulses(dt)
        if media.set_time(t, self._time):
            try:
                self._solves = (self._plan_flow(),)
                if not self.fluid.viscosity_moves:
                    prepare()
            except BaseException:
                media.invalidate()  # half done
                raise
        return *self._solves, *(density.plan(dt) for density in self.densities)

    def expect(self, times: Sequence[float], dt: float) -> tuple:
        """Set up steps of dt that end at these times, in a viscosity that depends on time: as `Step`'s."""
        self._scale_impulses(dt)
        self._media.bound_over(times, self._time)
        return self._plan_flow(), *(density.plan(dt) for density in self.densities)

    def _scale_impulses(self, dt: float) -> None:
        """Set the factor that makes the impulses of a step of dt the load of the flow."""
        factor = self._time / dt if dt > 0 else 0.0
        if factor != self._factor:
            assign([factor], self._of_impulse)
            self._factor = factor

    def _plan_flow(self) -> SolveMethod:
        stiffness = self._media.stiffness(self._time)
        return self.flow.plan(
            self._time, stiffness.least, stiffness.jump, stiffness.least_row, self._tolerance
        )

    def pressure_part(self, dt: float, last_dt: float, divergence_prescribed: bool) -> float:
        """0: no pressure is kept from one step to the next."""
        return 0.0

    def update_coefficients(self, state: State | None = None) -> None:
        """Update the coefficients on all grids, then the solver: launches only."""
        if state:
            self._media.carry(state)
        self._media.coarsen()
        self.flow.update_coefficients()

    def measure(self) -> tuple[Residual, Residual, float]:
        """Of the last step: the divergence left, beside the velocity's slopes; the flow's error; the largest
        divergence left [1/s]. Without what growths prescribe.
        """
        velocity = self._last
        divergence = self.flow.divergence_of(velocity)
        slopes = self._inner.norm(velocity) / min(self.grid.hx, self.grid.hy)
        left = Residual("projection", 1, self._inner.norm((divergence,)), slopes)
        return left, self.flow.measure(), self._inner.largest(divergence)
