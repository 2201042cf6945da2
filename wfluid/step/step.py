"""One step of the fluid: forces, advection, diffusion, projection (Bonilla & Velho, section II).

    v1 = v0 + dt f                           forces
    v2(x) = v1(foot of x)                    advection
    v3 - dt div (2 mu S) + dt alpha v3 = v2  diffusion and drag, implicit Euler, S the strain of v3
    v4 = v3 - beta grad q,  div beta grad q = div v3 - s,  beta = 1 / (1 + dt alpha)  projection

s is the divergence that sources prescribe, as a rule 0.

The foot is traced through v0, which is free of divergence, and carries the map along: v1 is not, and
would compress the picture (Bridson, 2nd ed., section 3.1). The paper traces v1; the two differ by
O(dt^2) a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector, fill, vector, where
from wfluid.fields.device import load_kernels
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.program import ADJOINT
from wfluid.kernels.cell.strips import alone
from wfluid.model.fluid import Fluid
from wfluid.step.advection import Advection
from wfluid.step.coefficients import Coefficients
from wfluid.step.densities import DensityTransport
from wfluid.step.diffusion import CoupledDiffusion, SeparateDiffusion
from wfluid.step.feet import Feet
from wfluid.step.forcing import Forcing
from wfluid.step.projection import Projection
from wfluid.step.tape import attach_gradients, bars, record
from wfluid.system.threads import ThreadTeam, free_cores, helpers

STEP_THREADS = 2
"""Threads that share a step on a CPU: more wait for memory."""

SHARED_CELLS = 300 * 300
"""Cells from which on sharing a step gains more than the threads lose where other work runs beside it."""

SHARED_ALONE = 160 * 160
"""The same where no other work does: in the evaluations of an optimisation."""

COUPLED_WORK = 4
"""Times as much work that a coupled diffusion makes of a step."""


class Step:
    """A step's stages and what they work with. They only launch, so that a graph may capture them.

    On the tape that is recording each stage leaves its transpose (`tape`). A step so recorded may be gone
    back through later, after others: `recompute` finds again what the transposes read, and
    `tape.backward()` goes from the gradients of the state after it to those of the state before it, of the
    forces and of the viscosity. A linear solve with a symmetric solver is its own transpose, so that none
    of its sweeps or iterates is recorded; conjugate gradients are so only up to their tolerance.

    Conjugate gradients go to the fluid's tolerances, or to `jump_tolerance` where that is lower.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device, jump_tolerance: float = 1.0):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.layout = Layout(grid.nx, grid.ny)
        walls = fluid.walls
        self.velocity_ghosts = [
            Ghosts(self.layout, rules, device) for rules in (walls.u_rules(), walls.v_rules())
        ]
        self.moved_ghosts = [
            Ghosts(self.layout, rules, device)
            for rules in (walls.displacement_x_rules(), walls.displacement_y_rules())
        ]
        self.where = where(grid, walls, self.layout)
        self.feet, self.advection = (
            kind(grid, fluid, device, self.velocity_ghosts, self.moved_ghosts) for kind in (Feet, Advection)
        )
        self.medium = None if fluid.separable else Coefficients(grid, fluid, device)
        self.diffusion = (
            CoupledDiffusion(fluid, self.medium, device, jump_tolerance)
            if self.medium
            else SeparateDiffusion(grid, fluid, device)
        )
        resisting = self.medium if fluid.freeze else None
        self.projection = Projection(grid, fluid, resisting, device, self.velocity_ghosts, jump_tolerance)
        self.densities = [DensityTransport(density, grid, fluid, device) for density in fluid.densities]
        self.pushed = vector(self.layout, device, 2)
        self._solves: tuple = ()

    pushed: Vector
    """The velocity after the forces of the last step that had any, with ghosts."""

    def advance(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """The step: launches only, recorded on the tape that is recording."""
        if self.fluid.viscosity_moves:
            self.follow_medium(state_in)
        self.carry_points(state_in, state_out, forcing)
        foot = self.trace(state_in, forcing)
        self.carry_densities(state_in, foot, forcing, state_out)
        self.carry_map(state_in, foot, state_out)
        velocity = self.viscous(state_in, foot, forcing)
        self.project(velocity, (state_out.u, state_out.v), forcing)
        if self.medium:
            self.projection.add_pressure(state_in.q, forcing, state_out.q)
        record(partial(self._clear_gradients, state_in), (), ())

    def viscous(self, state: State, foot: Vector, forcing: Forcing) -> Vector:
        """The velocity after forces, advection and diffusion, with ghosts."""
        velocity = self.push(state, forcing)
        velocity = self.advect(velocity, foot)
        if self.medium:
            velocity = self.projection.subtract_pressure(velocity, state.q, forcing)
        return self.diffuse(velocity)

    def recompute(self, state: State, forcing: Forcing) -> None:
        """Find again what the transposes of the step from `state` read, beside `state`: launches only.

        No solve, unless the gradient with respect to viscosity is wanted, which reads the velocity diffused.
        """
        if self.fluid.viscosity_moves:
            self.follow_medium(state)
        foot = self.trace(state, forcing)
        if self._of_viscosity:
            self.viscous(state, foot, forcing)
        else:
            self.push(state, forcing)

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate what the transposes need, unless it is there, and load their kernels.

        With `of_viscosity` the gradient with respect to viscosity is found as well, which is right only as
        far as the diffusion is solved. A viscosity that moves needs it in any case.
        """
        load_kernels(self.device, ADJOINT)
        self._of_viscosity = of_viscosity or self.fluid.viscosity_moves
        self.diffusion.allow_gradients(self._of_viscosity)
        if self.pushed[0].grad is not None:
            return  # captured graphs know the arrays by their addresses
        attach_gradients(self.pushed, self.layout)
        if self.medium:
            self.medium.allow_gradients()
        for stage in (self.feet, self.advection, self.projection, *self.densities):
            stage.allow_gradients()

    def _clear_gradients(self, state: State) -> None:
        """Let the gradients that several stages add to begin at 0; the first thing on the way back."""
        added = [*state.arrays, *self.pushed, *self.feet.foot]
        if self.fluid.viscosity_moves:
            added.append(self.medium.levels[0].mu)
        alone(lambda: fill(0.0, *bars(added)))

    @property
    def mu_bar(self) -> wp.array:
        """The gradient with respect to the painted viscosity, at centres, which every step adds to."""
        return self.medium.painted_mu.grad if self.medium else self.diffusion.mu_bar

    def take_fluid(self, fluid: Fluid) -> None:
        """Go on with a fluid that differs in the values of its viscosity, not in their kind."""
        if fluid.viscosity is self.fluid.viscosity:
            return
        self.fluid = self.diffusion.fluid = fluid
        if self.medium:
            self.medium.fluid = fluid
            self.medium.invalidate()

    def helpers(self, alone: bool = False) -> ThreadTeam | None:
        """The threads that share the launches of a step beside the calling one, where that gains.

        It gains earlier where the process is `alone`, has no other work to do meanwhile.
        """
        work = self.grid.nx * self.grid.ny * (COUPLED_WORK if self.medium else 1)
        least = SHARED_ALONE if alone else SHARED_CELLS
        shared = not self.device.is_cuda and free_cores() >= STEP_THREADS and work >= least
        return helpers(STEP_THREADS if shared else 1)

    def plan(self, t: float, dt: float, prepare: Callable[[], None]) -> tuple:
        """Make ready for a step of dt that ends at t; the methods of its solves.

        `prepare` is called where what `follow_medium` computes is out of date.
        """
        densities = tuple(density.plan(dt) for density in self.densities)
        medium = self.medium
        if not medium:
            return self.diffusion.plan(dt), self.projection.method, *densities
        if medium.set_time(t, dt):
            try:
                self._solves = self.diffusion.plan(dt), self.projection.plan(dt)
                if not self.fluid.viscosity_moves:
                    prepare()
            except BaseException:
                medium.invalidate()  # half done
                raise
        return *self._solves, *densities

    def kept(self, dt: float, last_dt: float, swelled: bool) -> float:
        """The part of the last step's pressure that a step of dt takes off before its diffusion.

        None where viscosity changes or moves: the strain that belonged to it would be elsewhere. Nor where
        the last step `swelled`, prescribed divergence: its pressure was of that step alone.
        """
        medium = self.medium
        if not medium or medium.changes or self.fluid.viscosity_moves or last_dt == 0 or swelled:
            return 0.0
        return min(1.0, dt / last_dt)

    def expect(self, times: Sequence[float], dt: float) -> tuple:
        """Make ready for steps of dt that end at these times, in a viscosity that depends on them.

        Only the methods of the solves are known then: each step must take its viscosity, and `follow_medium`.
        """
        self.medium.bound_over(times, dt)
        return self.diffusion.plan(dt), self.projection.plan(dt), *(d.plan(dt) for d in self.densities)

    def follow_medium(self, state: State | None = None) -> None:
        """Medium, then solves: launches only. A viscosity that moves is taken along with `state`'s map."""
        if state:
            self.medium.carry(state)
        self.medium.coarsen()
        self.diffusion.prepare()
        if self.fluid.freeze:
            self.projection.prepare()

    def trace(self, state: State, forcing: Forcing) -> Vector:
        """The feet of all centres [cells], with ghosts."""
        return self.feet.trace((state.u, state.v), forcing)

    def carry_points(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """The points a step later."""
        points, out = (state_in.p_x, state_in.p_y), (state_out.p_x, state_out.p_y)
        self.feet.carry_points(points, (state_in.u, state_in.v), forcing, out)

    def carry_map(self, state_in: State, foot: Vector, state_out: State) -> None:
        """The displacement a step later."""
        d, out = (state_in.d_x, state_in.d_y), (state_out.d_x, state_out.d_y)
        self.advection.carry_map(d, foot, out)

    def carry_densities(self, state_in: State, foot: Vector, forcing: Forcing, state_out: State) -> None:
        """The densities a step later, with what their sources pour."""
        stages = zip(self.densities, state_in.rho, forcing.sources, state_out.rho, strict=True)
        for density, rho, sources, out in stages:
            density.advance(rho, foot, self.where, sources, out)

    def push(self, state: State, forcing: Forcing) -> Vector:
        """The velocity after forces, with ghosts: the state's own where there are none."""
        if not forcing.pushes:
            return state.u, state.v
        forcing.push(state, self.pushed)
        return self.pushed

    def advect(self, velocity: Vector, foot: Vector) -> Vector:
        """The velocity carried along the flow, with ghosts."""
        return self.advection.carry_velocity(velocity, foot)

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity after viscosity and drag, with ghosts; the same where there is neither."""
        return self.diffusion.diffuse(velocity) if self.diffusion.method.iterations else velocity

    def project(self, velocity: Vector, out: Vector, forcing: Forcing | None = None) -> None:
        """The velocity without its divergence but for what is prescribed, with ghosts."""
        self.projection.project(velocity, out, forcing if forcing and forcing.swells else None)
