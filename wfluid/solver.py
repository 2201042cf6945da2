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

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

from wfluid.controls import STEP_LIMIT, Controls
from wfluid.density_transport import DensityTransport
from wfluid.device import Replay, exclusive, free_cores, helpers, load_kernels
from wfluid.diffusion import CoupledDiffusion, SeparateDiffusion
from wfluid.fluid import Fluid
from wfluid.forces import Force, Group, flat
from wfluid.grid import Grid
from wfluid.kernels import advection, projection, transport
from wfluid.kernels.cells import Layout
from wfluid.kernels.strips import together
from wfluid.linear import Residual
from wfluid.medium import Medium
from wfluid.projection import Projection
from wfluid.state import State, Vector, from_numpy, vector, where
from wfluid.walls import Ghosts

REPLAYS_KEPT = 16
"""Pairs of states whose steps are kept captured; the oldest goes first."""

STRIPS = 2
"""Threads that share a step on a CPU: more wait for memory."""

SHARED_CELLS = 300 * 300
"""Cells from which on sharing a step gains more than the threads lose where other work runs beside it."""

COUPLED_WORK = 4
"""Times as much work that a coupled diffusion makes of a step."""


@dataclass(frozen=True)
class SolveReport:
    """What the last step's solves left."""

    pressure: Residual
    """Of the projection: the divergence left, as iterations and norms."""
    diffusion: Residual
    """Of the diffusion, relative to the change it made; of u alone where the components are apart."""
    divergence: float
    """Largest |div v| left, beside what is prescribed [1/s]."""
    prescribed: float = 0.0
    """Sum of the largest divergences that sources prescribed [1/s]."""
    removed: float = 0.0
    """The mean of what they prescribed, taken off everywhere: it has no place between walls [1/s]."""


class Solver:
    """Steps fluids of one grid and one kind on one device.

    Building one loads the kernels. For each pair of states stepped between, the step is captured as
    a graph and replayed from then on; the time, the step and the forces' numbers are read from device
    memory. On a CPU with free cores two threads share the rows of every stage, with the same bits as one. A
    solver is for one thread at a time; several may each have their own.
    """

    @exclusive
    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.compile_seconds = load_kernels(device)
        self.layout = Layout(grid.nx, grid.ny)
        walls = fluid.walls
        self._velocity_ghosts = [
            Ghosts(self.layout, rules, device) for rules in (walls.u_rules(), walls.v_rules())
        ]
        self._d_x_ghosts = Ghosts(self.layout, walls.moved_x_rules(), device)
        self._d_y_ghosts = Ghosts(self.layout, walls.moved_y_rules(), device)
        self._medium = None if fluid.separable else Medium(grid, fluid, device)
        self._diffusion = (
            CoupledDiffusion(fluid, self._medium, device)
            if self._medium
            else SeparateDiffusion(grid, fluid, device)
        )
        self._projection = Projection(grid, fluid, self._medium if fluid.freeze else None, device)
        self._densities = [DensityTransport(density, grid, fluid, device) for density in fluid.densities]
        self._foot_x, self._foot_y = vector(self.layout, device, 2)
        self._pushed, self._carried = (vector(self.layout, device, 2) for _ in range(2))
        self._last_dt = 0.0
        self._preparation: Replay | None = None
        self._controls: dict[tuple, Controls] = {}
        self._last_controls: Controls | None = None
        self._replays: dict[tuple, tuple[Replay, State, State, Controls]] = {}
        work = grid.nx * grid.ny * (COUPLED_WORK if self._medium else 1)
        shared = not device.is_cuda and free_cores() >= STRIPS and work >= SHARED_CELLS
        self._pool = helpers(STRIPS if shared else 1)

    @exclusive
    def rest(self, points: np.ndarray | Sequence[tuple[float, float]] = ()) -> State:
        """A new state: a still fluid under an untouched picture, with its densities as they begin.

        `points` (n, 2) are places x, y of the picture [longer side] that are followed.

        Raises:
            ValueError: points that are not (n, 2) finite numbers within the picture.
        """
        points, extent = np.asarray(points, dtype=np.float64), (self.grid.width, self.grid.height)
        if points.size and (
            points.ndim != 2 or points.shape[1] != 2 or not np.all((points >= 0) & (points <= extent))
        ):
            raise ValueError("points: expected x, y within the picture for each")
        state = State.at_rest(self.grid, self.device, len(self._densities), len(points))
        for density, rho in zip(self._densities, state.rho, strict=True):
            density.begin(rho)
        if points.size:
            state.p_x.assign(points[:, 0] / self.grid.hx)
            state.p_y.assign(points[:, 1] / self.grid.hy)
        return state

    @exclusive
    def set_velocity(self, state: State, u: np.ndarray, v: np.ndarray) -> None:
        """Give `state` the face velocities u (ny, nx + 1), v (ny + 1, nx) [longer side/s]."""
        self._check(state)
        for values, f, ghosts in zip((u, v), (state.u, state.v), self._velocity_ghosts, strict=True):
            from_numpy(values, f, self.layout)
            ghosts.fill(f)
        state.q.zero_()

    def step(
        self,
        state_in: State,
        state_out: State,
        forces: Sequence[Force | Group],
        t: float,
        dt: float,
        *,
        until: float | None = None,
    ) -> None:
        """Advance `state_in` at time t by dt into `state_out`, another state.

        Forces act from t to `until`: t + dt unless the very number is given at which the next step
        begins, so that rounding lets no instant fall between two steps.

        Raises:
            ValueError: dt negative, not finite or above 10 s; the two states are one, or of another grid
                or device; a force whose impulse is not finite or beyond the limit.
        """
        if not (math.isfinite(dt) and 0 <= dt <= STEP_LIMIT):
            raise ValueError(f"step of {dt} s: expected 0 … {STEP_LIMIT:g}")
        if state_in is state_out:
            raise ValueError("a step cannot write the state it reads")
        self._check(state_in, state_out)
        until = t + dt if until is None else until
        self._replay_for(state_in, state_out, flat(forces), t, dt, until).launch()

    @exclusive
    def _replay_for(
        self,
        state_in: State,
        state_out: State,
        forces: Sequence[Force],
        t: float,
        dt: float,
        until: float,
    ) -> Replay:
        """The step, captured at first, with its numbers put where it reads them."""
        controls = self._controls_for(forces)
        swelled = self._last_controls is not None and self._last_controls.prescribed > 0
        kept = self._kept(dt)
        controls.set(forces, t, dt, until, 0.0 if swelled else kept)
        self._last_controls = controls
        for density in self._densities:
            density.set(t, until)
        plan = self._plan(until, dt) + tuple(density.plan(dt) for density in self._densities)
        key = (id(state_in), id(state_out), id(controls), plan)
        if key not in self._replays:
            work = partial(self._advance, state_in, state_out, controls)
            replay = Replay(self.device, work, self._pool, STRIPS)
            self._replays[key] = (replay, state_in, state_out, controls)
            if len(self._replays) > REPLAYS_KEPT:
                del self._replays[next(iter(self._replays))]
        self._replays[key] = self._replays.pop(key)  # the newest last
        return self._replays[key][0]

    def _kept(self, dt: float) -> float:
        """The part of the last step's pressure that a step of dt takes off before its diffusion.

        None where viscosity changes or moves: the strain that belonged to it would be elsewhere. Nor where
        divergence is prescribed, whose pressure is of this step alone.
        """
        medium, last, self._last_dt = self._medium, self._last_dt, dt
        if not medium or medium.changes or self.fluid.viscosity_moves or last == 0:
            return 0.0
        return min(1.0, dt / last)

    def _plan(self, t: float, dt: float) -> tuple:
        """Make diffusion and projection ready for a step of dt that ends at t; how they will solve."""
        medium = self._medium
        if not medium:
            return self._diffusion.plan(dt), self._projection.how
        if medium.follow(t, dt):
            try:
                self._solves = self._diffusion.plan(dt), self._projection.plan(dt)
                if not self.fluid.viscosity_moves:
                    self._prepare()
            except BaseException:
                medium.forget()  # half done
                raise
        return self._solves

    def _prepare(self) -> None:
        """Bring what depends on the medium up to date."""
        if self._preparation is None:
            self._preparation = Replay(self.device, self._follow_medium, self._pool, STRIPS)
        self._preparation.launch()

    def _follow_medium(self, state: State | None = None) -> None:
        """Medium, then solves: launches only. A viscosity that moves is taken along with `state`'s map."""
        if state:
            self._medium.carry(state)
        self._medium.spread()
        self._diffusion.prepare()
        if self.fluid.freeze:
            self._projection.prepare()

    @exclusive
    def report(self) -> SolveReport:
        """Measure what the last step's solves left: true residuals and the divergence."""
        pressure, divergence = self._projection.measure()
        prescribed, removed = 0.0, 0.0
        if self._last_controls:
            prescribed, removed = self._last_controls.prescribed, self._last_controls.removed
        return SolveReport(pressure, self._diffusion.measure(), divergence, prescribed, removed)

    @exclusive
    def carry(self, state_in: State, state_out: State, dt: float) -> None:
        """Only carry the map along `state_in`'s velocity for dt; the velocity of `state_out` is untouched."""
        self._check(state_in, state_out)
        controls = self._controls_for(())
        controls.set((), 0.0, dt, dt)
        self._trace(state_in, controls)
        self._carry_map(state_in, state_out)

    @exclusive
    def diffuse(self, state_in: State, state_out: State, dt: float, *, t: float = 0.0) -> None:
        """Only diffuse the velocity for dt, from time t on; the map of `state_out` is untouched."""
        self._check(state_in, state_out)
        self._plan(t + dt, dt)
        if self.fluid.viscosity_moves:
            self._follow_medium(state_in)
        for f, out in zip(self._diffuse((state_in.u, state_in.v)), (state_out.u, state_out.v), strict=True):
            wp.copy(out, f)

    @exclusive
    def project(self, state_in: State, state_out: State, dt: float = 0.0) -> None:
        """Only project the velocity, as in a step of dt; the map of `state_out` is untouched."""
        self._check(state_in, state_out)
        self._plan(0.0, dt)
        if self.fluid.viscosity_moves:
            self._follow_medium(state_in)
        self._project((state_in.u, state_in.v), state_out)

    def _check(self, *states: State) -> None:
        """Refuse states whose arrays are not this solver's size, or not on its device."""
        for state in states:
            if state.grid != self.grid or state.u.device != self.device:
                raise ValueError(f"a state of {state.grid} on {state.u.device} in a solver of {self.grid}")
            if len(state.rho) != len(self._densities) or len(state.p_x) != len(states[0].p_x):
                raise ValueError(
                    f"a state with {len(state.rho)} densities and {len(state.p_x)} points: expected "
                    f"{len(self._densities)} and {len(states[0].p_x)}"
                )

    def _controls_for(self, forces: Sequence[Force]) -> Controls:
        key = Controls.key(forces)
        if key not in self._controls:
            if len(self._controls) >= REPLAYS_KEPT:
                del self._controls[next(iter(self._controls))]
            self._controls[key] = Controls(
                forces, self.fluid.density_names, self.grid, self.fluid.walls, self.device
            )
        return self._controls[key]

    def _advance(self, state_in: State, state_out: State, controls: Controls) -> None:
        """The step: launches only."""
        if self.fluid.viscosity_moves:
            self._follow_medium(state_in)
        self._trace(state_in, controls)
        self._carry_map(state_in, state_out)
        self._carry_densities(state_in, state_out)
        self._carry_points(state_in, state_out, controls)
        velocity = self._push(state_in, controls)
        velocity = self._advect(velocity)
        velocity = self._subtract_pressure(velocity, state_in, controls)
        velocity = self._diffuse(velocity)
        self._project(velocity, state_out, controls.prescribe if controls.swells else None)
        if self._medium:
            self._projection.add_pressure(state_in.q, controls.kept, state_out.q)

    def _where(self) -> list[int]:
        return where(self.grid, self.fluid.walls, self.layout)

    def _trace(self, state: State, controls: Controls) -> None:
        trace = advection.trace_euler if self.fluid.scheme == "paper" else advection.trace_midpoint
        inputs = [state.u, state.v, controls.dt_hx, controls.dt_hy, *self._where()]
        trace.launch(self.layout, self.device, inputs, [self._foot_x, self._foot_y])
        with together():
            self._d_x_ghosts.fill(self._foot_x)
            self._d_y_ghosts.fill(self._foot_y)

    def _push(self, state: State, controls: Controls) -> Vector:
        if not controls.pushes:
            return state.u, state.v
        controls.push(state, self._pushed)
        self._fill(self._pushed)
        return self._pushed

    def _carry_map(self, state_in: State, state_out: State) -> None:
        paper = self.fluid.scheme == "paper"
        carry = transport.carry_map_bilinear if paper else transport.carry_map_cubic
        inputs = [state_in.d_x, state_in.d_y, self._foot_x, self._foot_y, *self._where()]
        carry.launch(self.layout, self.device, inputs, [state_out.d_x, state_out.d_y])
        with together():
            self._d_x_ghosts.fill(state_out.d_x)
            self._d_y_ghosts.fill(state_out.d_y)

    def _carry_densities(self, state_in: State, state_out: State) -> None:
        foot, place = (self._foot_x, self._foot_y), self._where()
        for density, rho, out in zip(self._densities, state_in.rho, state_out.rho, strict=True):
            density.advance(rho, foot, place, out)

    def _carry_points(self, state_in: State, state_out: State, controls: Controls) -> None:
        state = state_in
        inputs = [state.p_x, state.p_y, state.u, state.v, controls.dt_hx, controls.dt_hy, *self._where()]
        out = [state_out.p_x, state_out.p_y]
        transport.carry_points.launch(len(state.p_x), self.device, inputs, out)

    def _advect(self, velocity: Vector) -> Vector:
        paper = self.fluid.scheme == "paper"
        advect = advection.advect_face_bilinear if paper else advection.advect_face_cubic
        with together():
            for f, before, carried in zip(velocity, (1, self.layout.pitch), self._carried, strict=True):
                inputs = [f, self._foot_x, self._foot_y, before, *self._where()]
                advect.launch(self.layout, self.device, inputs, [carried])
        self._fill(self._carried)
        return self._carried

    def _subtract_pressure(self, velocity: Vector, state: State, controls: Controls) -> Vector:
        """Without the gradient of the pressure so far, where diffusion and projection do not commute."""
        if not self._medium:
            return velocity
        axes = ((1, controls.kept_hx), (self.layout.pitch, controls.kept_hy))
        with together():
            for f, (before, kept_h), pushed in zip(velocity, axes, self._pushed, strict=True):
                projection.subtract_slope.launch(
                    self.layout, self.device, [f, state.q, kept_h, before], [pushed]
                )
        self._fill(self._pushed)
        return self._pushed

    def _diffuse(self, velocity: Vector) -> Vector:
        if not self._diffusion.how.iterations:
            return velocity
        self._diffusion.diffuse(velocity)
        return self._diffusion.out

    def _project(
        self,
        velocity: Vector,
        state_out: State,
        prescribe: Callable[[wp.array], None] | None = None,
    ) -> None:
        out = (state_out.u, state_out.v)
        self._projection.project(velocity, out, prescribe)
        self._fill(out)

    def _fill(self, velocity: Vector) -> None:
        with together():
            for f, ghosts in zip(velocity, self._velocity_ghosts, strict=True):
                ghosts.fill(f)
