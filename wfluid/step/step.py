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
from wfluid.fields.arrays import Vector, vector, where
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.step import advection, projection, transport
from wfluid.model.fluid import Fluid
from wfluid.step.coefficients import Coefficients
from wfluid.step.densities import DensityTransport
from wfluid.step.diffusion import CoupledDiffusion, SeparateDiffusion
from wfluid.step.forcing import Forcing
from wfluid.step.projection import Projection
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
        self.medium = None if fluid.separable else Coefficients(grid, fluid, device)
        self.diffusion = (
            CoupledDiffusion(fluid, self.medium, device, jump_tolerance)
            if self.medium
            else SeparateDiffusion(grid, fluid, device)
        )
        resisting = self.medium if fluid.freeze else None
        self.projection = Projection(grid, fluid, resisting, device, jump_tolerance)
        self.densities = [DensityTransport(density, grid, fluid, device) for density in fluid.densities]
        self.foot = vector(self.layout, device, 2)
        self.pushed, self._carried = (vector(self.layout, device, 2) for _ in range(2))
        self._solves: tuple = ()

    foot: Vector
    """Of the last trace [cells], with ghosts."""
    pushed: Vector
    """The velocity after forces, with ghosts; later without the pressure so far."""

    def advance(self, state_in: State, state_out: State, impulses: Forcing) -> None:
        """The step: launches only."""
        if self.fluid.viscosity_moves:
            self.follow_medium(state_in)
        self.trace(state_in, impulses)
        self.carry_map(state_in, state_out)
        self.carry_densities(state_in, state_out, impulses)
        self.carry_points(state_in, state_out, impulses)
        velocity = self.push(state_in, impulses)
        velocity = self.advect(velocity)
        velocity = self.subtract_pressure(velocity, state_in, impulses)
        velocity = self.diffuse(velocity)
        self.project(velocity, (state_out.u, state_out.v), impulses.prescribe if impulses.swells else None)
        if self.medium:
            self.projection.add_pressure(state_in.q, impulses.kept, state_out.q)

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
        """Make ready for a step of dt that ends at t; how its solves will go.

        `prepare` is called where what `follow_medium` computes is out of date.
        """
        densities = tuple(density.plan(dt) for density in self.densities)
        medium = self.medium
        if not medium:
            return self.diffusion.plan(dt), self.projection.how, *densities
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

        Only how the solves go is known then: each step must take its viscosity, and `follow_medium`.
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

    def trace(self, state: State, impulses: Forcing) -> None:
        """Find the feet of all centres."""
        trace = advection.trace_euler if self.fluid.scheme == "paper" else advection.trace_midpoint
        inputs = [state.u, state.v, impulses.dt_hx, impulses.dt_hy, *self.where]
        trace.launch(self.layout, self.device, inputs, self.foot)
        with together():
            for f, ghosts in zip(self.foot, self.moved_ghosts, strict=True):
                ghosts.fill(f)

    def push(self, state: State, impulses: Forcing) -> Vector:
        """The velocity after forces, with ghosts."""
        if not impulses.pushes:
            return state.u, state.v
        impulses.push(state, self.pushed)
        self.fill(self.pushed)
        return self.pushed

    def carry_map(self, state_in: State, state_out: State) -> None:
        """The displacement a step later."""
        paper = self.fluid.scheme == "paper"
        carry = transport.carry_map_bilinear if paper else transport.carry_map_cubic
        inputs = [state_in.d_x, state_in.d_y, *self.foot, *self.where]
        carry.launch(self.layout, self.device, inputs, [state_out.d_x, state_out.d_y])
        with together():
            for d, ghosts in zip((state_out.d_x, state_out.d_y), self.moved_ghosts, strict=True):
                ghosts.fill(d)

    def carry_densities(self, state_in: State, state_out: State, impulses: Forcing) -> None:
        """The densities a step later, with what their sources pour."""
        for n, (density, rho) in enumerate(zip(self.densities, state_in.rho, strict=True)):
            density.advance(rho, self.foot, self.where, partial(impulses.pour, n), state_out.rho[n])

    def carry_points(self, state_in: State, state_out: State, impulses: Forcing) -> None:
        """The points a step later."""
        state = state_in
        inputs = [state.p_x, state.p_y, state.u, state.v, impulses.dt_hx, impulses.dt_hy, *self.where]
        out = [state_out.p_x, state_out.p_y]
        transport.carry_points.launch(len(state.p_x), self.device, inputs, out)

    def advect(self, velocity: Vector) -> Vector:
        """The velocity carried along the flow, with ghosts."""
        paper = self.fluid.scheme == "paper"
        advect = advection.advect_face_bilinear if paper else advection.advect_face_cubic
        with together():
            for f, before, carried in zip(velocity, (1, self.layout.pitch), self._carried, strict=True):
                inputs = [f, *self.foot, before, *self.where]
                advect.launch(self.layout, self.device, inputs, [carried])
        self.fill(self._carried)
        return self._carried

    def subtract_pressure(self, velocity: Vector, state: State, impulses: Forcing) -> Vector:
        """Without the gradient of the pressure so far, where diffusion and projection do not commute."""
        if not self.medium:
            return velocity
        axes = ((1, impulses.kept_hx), (self.layout.pitch, impulses.kept_hy))
        with together():
            for f, (before, kept_h), pushed in zip(velocity, axes, self.pushed, strict=True):
                projection.subtract_slope.launch(
                    self.layout, self.device, [f, state.q, kept_h, before], [pushed]
                )
        self.fill(self.pushed)
        return self.pushed

    def diffuse(self, velocity: Vector) -> Vector:
        """The velocity after viscosity and drag, with ghosts."""
        if not self.diffusion.how.iterations:
            return velocity
        self.diffusion.diffuse(velocity)
        return self.diffusion.out

    def project(
        self,
        velocity: Vector,
        out: Vector,
        prescribe: Callable[[wp.array], None] | None = None,
    ) -> None:
        """The velocity without its divergence, with ghosts; `prescribe` adds to it what is to stay."""
        self.projection.project(velocity, out, prescribe)
        self.fill(out)

    def fill(self, velocity: Vector) -> None:
        """Fill the ghosts of a velocity, and zero its faces on walls."""
        with together():
            for f, ghosts in zip(velocity, self.velocity_ghosts, strict=True):
                ghosts.fill(f)
