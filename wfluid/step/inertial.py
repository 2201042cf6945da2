"""One step of the fluid: forces, advection, diffusion, projection (Bonilla & Velho, section II).

    v1 = v0 + dt f                           forces
    v2(x) = v1(foot of x)                    advection
    v3 - dt div (2 mu S) + dt alpha v3 = v2  diffusion and drag, implicit Euler, S the strain of v3
    v4 = v3 - beta grad q,  div beta grad q = div v3 - s,  beta = 1 / (1 + dt alpha)  projection

s is the divergence that growths prescribe; it is 0 without growths.

The foot is traced through v0, which is free of divergence; the map is carried from the same foot. v1 has
divergence and would compress the picture (Bridson, 2nd ed., section 3.1). With scheme "paper" v1 is traced,
and map, densities and points then move with v4. The two differ by O(dt^2) a step.

Advection followed by projection loses energy: it acts like a viscosity of about U^2 dt / 8 where streamlines
are curved, U the largest speed (measured on Taylor-Green vortices with mu = 0: 0.121 to 0.125 of U^2 dt); a
parallel shear flow loses none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector
from wfluid.fields.state import State
from wfluid.model.fluid import Fluid
from wfluid.solve.system import Residual
from wfluid.step.diffusion import CoupledDiffusion, SeparateDiffusion
from wfluid.step.forcing import Forcing
from wfluid.step.projection import Projection
from wfluid.step.step import Step
from wfluid.step.tape import record


class InertialStep(Step):
    """The stages of a step of a fluid that keeps its velocity.

    Conjugate gradients are their own transpose up to their tolerance: the fluid's own, or `jump_tolerance`
    where that is lower. Likewise the gradient with respect to viscosity, which changes a fixed number of
    sweeps or cycles too: the diffusion is solved by as many as `fixed_tolerance` needs, where that is lower
    than the fluid's own.
    """

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        device: wp.Device,
        jump_tolerance: float = 1.0,
        fixed_tolerance: float = 1.0,
    ):
        super().__init__(grid, fluid, device, fixed_tolerance)
        self.diffusion = (
            CoupledDiffusion(fluid, self.coefficients, device, jump_tolerance, fixed_tolerance)
            if self.coefficients
            else SeparateDiffusion(grid, fluid, device, fixed_tolerance)
        )
        drag = self.coefficients if fluid.freeze else None
        self.projection = Projection(grid, fluid, drag, device, self.velocity_ghosts, jump_tolerance)
        self.keeps_pressure = self.projection.accumulates_pressure
        self.transports_with_new_velocity = self.paper
        self._solves: tuple = ()

    def advance(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Write the state after the step to `state_out`: launches only; a tape that records takes them.

        The last record is the first to play: it sets gradients to 0 to which several stages add.
        """
        if self.fluid.viscosity_moves:
            self.update_coefficients(state_in)
        before, after = (state_in.u, state_in.v), (state_out.u, state_out.v)
        if not self.paper:
            self.transport(state_in, state_out, before, forcing)
        self.project(self.viscous(state_in, forcing), after, forcing)
        if self.keeps_pressure:
            self.projection.add_pressure(state_in.q, forcing, state_out.q)
        if self.paper:
            self.transport(state_in, state_out, after, forcing)
        record(partial(self._clear_gradients, state_in), (), ())

    def viscous(self, state: State, forcing: Forcing) -> Vector:
        """The velocity after forces, advection and diffusion, with ghosts.

        The feet are those of `transport`, but with scheme "paper" those of the velocity after forces.
        """
        velocity = self.push(state, forcing)
        if self.paper:
            self.feet.trace(velocity, forcing)
        velocity = self.advect(velocity, self.feet.foot)
        if self.keeps_pressure:
            velocity = self.projection.subtract_pressure(velocity, state.q, forcing)
        return self.diffuse(velocity)

    def recompute(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Compute again what the transposes of a step read besides the state before it: launches only.

        Of the state after it the velocity is read, and that only with scheme "paper". Nothing is solved,
        except for the gradient with respect to viscosity: it reads the diffused velocity.
        """
        if self.fluid.viscosity_moves:
            self.update_coefficients(state_in)
        transporting = state_out if self.paper else state_in
        self.map_feet.trace((transporting.u, transporting.v), forcing)
        if self._of_viscosity:
            self.viscous(state_in, forcing)
            return
        velocity = self.push(state_in, forcing)
        if self.paper:
            self.feet.trace(velocity, forcing)

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate the arrays of the transposes, once, and load their kernels.

        With `of_viscosity` the backward pass also computes the gradient with respect to viscosity. It is as
        accurate as the solve of the diffusion. A viscosity that moves needs it in any case.
        """
        self._of_viscosity = of_viscosity or self.fluid.viscosity_moves
        self.diffusion.allow_gradients(self._of_viscosity)
        if self.pushed[0].grad is None:  # captured graphs know the arrays by their addresses
            self.projection.allow_gradients()
        super().allow_gradients(of_viscosity)

    @property
    def mu_bar(self) -> wp.array:
        """The gradient with respect to the painted viscosity, at centres; every backward step adds to it."""
        if isinstance(self.diffusion, SeparateDiffusion):
            return self.diffusion.mu_bar
        return self.diffusion.coefficients.painted_mu.grad

    def take_fluid(self, fluid: Fluid) -> None:
        """Replace the fluid by one that differs in the values of its viscosity only, not in its type."""
        if fluid.viscosity is self.fluid.viscosity:
            return
        self.fluid = self.diffusion.fluid = fluid
        if self.coefficients:
            self.coefficients.fluid = fluid
            self.coefficients.invalidate()

    def measure(self) -> tuple[Residual, Residual, float]:
        """Of the last step: the residuals of projection and diffusion, and the largest |div v - s| [1/s]."""
        pressure, divergence = self.projection.measure()
        return pressure, self.diffusion.measure(), divergence

    def plan(self, t: float, dt: float, prepare: Callable[[], None]) -> tuple:
        """Set the step up for a length dt and an end at t. Returns the methods of its solves.

        Calls `prepare`, which must launch `update_coefficients`, if the coefficients have changed.
        """
        densities = tuple(density.plan(dt) for density in self.densities)
        coefficients = self.coefficients
        if not coefficients:
            return self.diffusion.plan(dt), self.projection.method, *densities
        if coefficients.set_time(t, dt):
            try:
                self._solves = self.diffusion.plan(dt), self.projection.plan(dt)
                if not self.fluid.viscosity_moves:
                    prepare()
            except BaseException:
                coefficients.invalidate()  # half done
                raise
        return *self._solves, *densities

    def pressure_part(self, dt: float, last_dt: float, divergence_prescribed: bool) -> float:
        """The fraction of the last step's pressure that a step of dt subtracts before its diffusion.

        It is 0 where viscosity changes or moves: that pressure belongs to the strain at the old places. It
        is also 0 where the last step had `divergence_prescribed`, whose pressure acts in that step only, and
        with scheme "paper", whose pressure starts anew in every step.
        """
        coefficients = self.coefficients
        if not coefficients or coefficients.changes or self.fluid.viscosity_moves or self.paper:
            return 0.0
        if last_dt == 0 or divergence_prescribed:
            return 0.0
        return min(1.0, dt / last_dt)

    def expect(self, times: Sequence[float], dt: float) -> tuple:
        """Set up steps of dt that end at these times, in a viscosity that depends on time.

        Returns the methods of their solves, which suit all of them. Before each step the caller must write
        its viscosity to `coefficients.painted_mu` and call `update_coefficients`.
        """
        coupled = self._coupled()
        coupled.coefficients.bound_over(times, dt)
        return coupled.plan(dt), self.projection.plan(dt), *(d.plan(dt) for d in self.densities)

    def update_coefficients(self, state: State | None = None) -> None:
        """Update the coefficients on all grids, then the solvers: launches only.

        With `state` the viscosity is first carried along with its map.
        """
        coupled = self._coupled()
        if state:
            coupled.coefficients.carry(state)
        coupled.coefficients.coarsen()
        coupled.update_coefficients()
        if self.fluid.freeze:
            self.projection.update_coefficients()

    def _coupled(self) -> CoupledDiffusion:
        """The diffusion of a fluid with coefficients.

        Raises:
            TypeError: one viscosity, and no drag, holds everywhere.
        """
        if not isinstance(self.diffusion, CoupledDiffusion):
            raise TypeError("a fluid with one viscosity and no drag has no coefficients")
        return self.diffusion

    def push(self, state: State, forcing: Forcing) -> Vector:
        """The velocity after forces, with ghosts: the state's own arrays if no force acts on it."""
        if not forcing.adds_velocity:
            return state.u, state.v
        forcing.push((state.u, state.v), state.rho, self.pushed)
        return self.pushed

    def advect(self, velocity: Vector, foot: Vector) -> Vector:
        """The velocity carried along the flow, with ghosts."""
        return self.advection.carry_velocity(velocity, foot)

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity after viscosity and drag, with ghosts: the same arrays if there is neither."""
        return self.diffusion.diffuse(velocity) if self.diffusion.method.iterations else velocity

    def project(self, velocity: Vector, out: Vector, forcing: Forcing | None = None) -> None:
        """out = the projected velocity, with ghosts; its divergence is what `forcing` prescribes, or 0."""
        self.projection.project(velocity, out, forcing if forcing and forcing.prescribes_divergence else None)
