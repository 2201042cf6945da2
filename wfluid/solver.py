"""One step of the fluid: forces, advection, diffusion, projection (Bonilla & Velho, section II).

    v1 = v0 + dt f                           forces
    v2(x) = v1(foot of x)                    advection
    (1 - dt mu Lap) v3 = v2                  diffusion, implicit Euler
    v4 = v3 - grad q,  Lap q = div v3        projection

The foot is traced through v0, which is free of divergence, and carries the map along: v1 is not, and
would compress the picture (Bridson, 2nd ed., section 3.1). The paper traces v1; the two differ by
O(dt^2) a step.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

from wfluid.device import capture, exclusive, load_kernels
from wfluid.fluid import Fluid
from wfluid.forces import FORCE_LIMIT, GaussianForce
from wfluid.grid import Grid
from wfluid.kernels import advection, projection, relaxation, transport
from wfluid.kernels import forces as force_kernels
from wfluid.kernels.cells import Layout, Real
from wfluid.linear import LinearSystem, Residual, Solve, norm
from wfluid.multigrid import Points
from wfluid.state import State, field, from_numpy
from wfluid.walls import Ghosts

STEP_LIMIT = 10.0
"""Longest step the solver is tested with [s]."""

GRAPHS_KEPT = 16
"""Pairs of states whose graphs are kept; the oldest goes first."""

SIDE_BY_SIDE = 300 * 300
"""Cells from which on a second thread saves more than it costs to wake it: 1.0x at 256^2, 1.4x at 512^2."""

_PER_FORCE = 5
"""Numbers of a force on the device: center, radius and impulse."""


@dataclass(frozen=True)
class SolveReport:
    """What the last step's solves left."""

    pressure: Residual
    """Of the projection: the divergence left, as iterations and norms."""
    diffusion: Residual
    """Of the diffusion of u, relative to the change it made."""
    divergence: float
    """Largest |div v| left [1/s]."""


class Solver:
    """Steps fluids of one grid and one kind on one device.

    Building one loads the kernels. For each pair of states stepped between, the stages are captured as
    graphs and replayed from then on; the time, the step and the forces' numbers are read from device
    memory. On a CPU, stages that do not need each other run side by side: u beside v, then the map
    beside the projection. A solver is for one thread at a time; several may each have their own.
    """

    @exclusive
    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.compile_seconds = load_kernels(device)
        self.layout = Layout(grid.nx, grid.ny)
        walls, size, shape = fluid.walls, (grid.width, grid.height), (grid.nx, grid.ny)
        self._velocity_ghosts = [
            Ghosts(self.layout, rules, device) for rules in (walls.u_rules(), walls.v_rules())
        ]
        self._d_x_ghosts = Ghosts(self.layout, walls.moved_x_rules(), device)
        self._d_y_ghosts = Ghosts(self.layout, walls.moved_y_rules(), device)
        self._pressure = LinearSystem(*shape, Points(size, walls.centre_rules()), device)
        self._pressure.set_coefficients(0.0, 1.0)
        self._solve_pressure = self._how(Solve("multigrid", fluid.pressure_cycles))
        self._pressure.prepare(self._solve_pressure)
        self._solve_diffusion = Solve("none", 0)
        self._diffusion = (
            LinearSystem(*shape, Points(size, walls.u_rules(), (True, False)), device),
            LinearSystem(*shape, Points(size, walls.v_rules(), (False, True)), device),
        )
        self._foot_x, self._foot_y, self._q, self._minus_div = (field(self.layout, device) for _ in range(4))
        self._pushed, self._carried, self._diffused, self._change, self._answer = (
            (field(self.layout, device), field(self.layout, device)) for _ in range(5)
        )
        self._inverse_h = wp.array([1 / grid.hx, 1 / grid.hy], dtype=Real, device=device)
        self._one = wp.array([1.0], dtype=Real, device=device)
        self._controls: dict[int, _Controls] = {}
        self._graphs: dict[tuple, tuple[list[list[wp.Graph]], State, State]] = {}
        threads = not device.is_cuda and (os.cpu_count() or 1) > 1 and grid.nx * grid.ny >= SIDE_BY_SIDE
        self._pool = ThreadPoolExecutor(2) if threads else None

    @exclusive
    def rest(self) -> State:
        """A new state: a still fluid under an untouched picture."""
        return State.at_rest(self.grid, self.device)

    @exclusive
    def set_velocity(self, state: State, u: np.ndarray, v: np.ndarray) -> None:
        """Give `state` the face velocities u (ny, nx + 1), v (ny + 1, nx) [longer side/s]."""
        self._check(state)
        for values, f, ghosts in zip((u, v), (state.u, state.v), self._velocity_ghosts, strict=True):
            from_numpy(values, f, self.layout)
            ghosts.fill(f)

    def step(
        self,
        state_in: State,
        state_out: State,
        forces: Sequence[GaussianForce],
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
        for stage in self._graphs_for(state_in, state_out, forces, t, dt, t + dt if until is None else until):
            if self._pool and len(stage) > 1:
                list(self._pool.map(wp.capture_launch, stage))
            else:
                for graph in stage:
                    wp.capture_launch(graph)

    @exclusive
    def _graphs_for(
        self,
        state_in: State,
        state_out: State,
        forces: Sequence[GaussianForce],
        t: float,
        dt: float,
        until: float,
    ) -> list[list[wp.Graph]]:
        """The step's graphs, captured at first, with its numbers put where they read them."""
        diffuses = self.fluid.viscosity * dt > 0
        controls = self._controls_for(len(forces))
        controls.set(self.grid, forces, t, dt, until)
        if diffuses:
            self._plan_diffusion(dt)
        key = (id(state_in), id(state_out), len(forces), diffuses and self._solve_diffusion)
        if key not in self._graphs:
            stages = self._stages(state_in, state_out, controls, diffuses)
            graphs = [[capture(self.device, work) for work in stage] for stage in stages]
            self._graphs[key] = (graphs, state_in, state_out)
            if len(self._graphs) > GRAPHS_KEPT:
                del self._graphs[next(iter(self._graphs))]
        return self._graphs[key][0]

    @exclusive
    def report(self) -> SolveReport:
        """Measure what the last step's solves left: true residuals and the divergence."""
        pressure = self._pressure.measure(self._solve_pressure, self._minus_div, self._q)
        divergence = norm(self._pressure.left, self.layout)[1]
        if self._solve_diffusion.iterations:
            diffusion = self._diffusion[0].measure(self._solve_diffusion, self._change[0], self._answer[0])
        else:
            diffusion = Residual("none", 0, 0.0, 0.0)
        return SolveReport(pressure, diffusion, divergence)

    @exclusive
    def carry(self, state_in: State, state_out: State, dt: float) -> None:
        """Only carry the map along `state_in`'s velocity for dt; the velocity of `state_out` is untouched."""
        self._check(state_in, state_out)
        controls = self._controls_for(0)
        controls.set(self.grid, (), 0.0, dt, dt)
        self._trace(state_in, controls)
        self._carry_map(state_in, state_out)

    @exclusive
    def diffuse(self, state_in: State, state_out: State, dt: float) -> None:
        """Only diffuse the velocity for dt; the map of `state_out` is untouched."""
        self._check(state_in, state_out)
        self._plan_diffusion(dt)
        for axis, (f, out) in enumerate(((state_in.u, state_out.u), (state_in.v, state_out.v))):
            self._diffuse(axis, f)
            wp.copy(out, self._diffused[axis])

    @exclusive
    def project(self, state_in: State, state_out: State) -> None:
        """Only project the velocity; the map of `state_out` is untouched."""
        self._check(state_in, state_out)
        self._project((state_in.u, state_in.v), state_out)

    def _check(self, *states: State) -> None:
        """Refuse states whose arrays are not this solver's size, or not on its device."""
        for state in states:
            if state.grid != self.grid or state.u.device != self.device:
                raise ValueError(f"a state of {state.grid} on {state.u.device} in a solver of {self.grid}")

    def _controls_for(self, forces: int) -> _Controls:
        if forces not in self._controls:
            self._controls[forces] = _Controls(forces, self.device)
        return self._controls[forces]

    def _how(self, wanted: Solve) -> Solve:
        """The solve wanted, or the paper's."""
        return wanted if self.fluid.solver == "multigrid" else Solve("jacobi", self.fluid.sweeps)

    def _plan_diffusion(self, dt: float) -> None:
        for system in self._diffusion:
            system.set_coefficients(1.0, dt * self.fluid.viscosity)
            self._solve_diffusion = self._how(system.plan(self.fluid.diffusion_tolerance))
            system.prepare(self._solve_diffusion)

    def _stages(
        self, state_in: State, state_out: State, controls: _Controls, diffuses: bool
    ) -> list[list[Callable[[], None]]]:
        """The step as stages, one after the other, of works that may run side by side."""
        v1 = self._pushed if controls.count else (state_in.u, state_in.v)
        v2 = self._carried
        v3 = self._diffused if diffuses else v2

        def begin() -> None:
            self._trace(state_in, controls)
            self._push(state_in, controls)

        def component(axis: int) -> None:
            self._advect(axis, v1[axis])
            if diffuses:
                self._diffuse(axis, v2[axis])

        return [
            [begin],
            [partial(component, 0), partial(component, 1)],
            [partial(self._project, v3, state_out), partial(self._carry_map, state_in, state_out)],
        ]

    def _where(self) -> list[int]:
        periodic_x, periodic_y = self.fluid.walls.periodic
        return [self.grid.nx, self.grid.ny, int(periodic_x), int(periodic_y), self.layout.pitch]

    def _trace(self, state: State, controls: _Controls) -> None:
        trace = advection.trace_euler if self.fluid.scheme == "paper" else advection.trace_midpoint
        inputs = [state.u, state.v, controls.dt_hx, controls.dt_hy, *self._where()]
        trace.launch(self.layout, self.device, inputs, [self._foot_x, self._foot_y])
        self._d_x_ghosts.fill(self._foot_x)
        self._d_y_ghosts.fill(self._foot_y)

    def _push(self, state: State, controls: _Controls) -> None:
        if controls.count:
            for f, pushed in zip((state.u, state.v), self._pushed, strict=True):
                wp.copy(pushed, f)
            controls.push(self.grid, self.fluid, self.layout, *self._pushed)
            for pushed, ghosts in zip(self._pushed, self._velocity_ghosts, strict=True):
                ghosts.fill(pushed)

    def _carry_map(self, state_in: State, state_out: State) -> None:
        paper = self.fluid.scheme == "paper"
        carry = transport.carry_map_bilinear if paper else transport.carry_map_cubic
        inputs = [state_in.d_x, state_in.d_y, self._foot_x, self._foot_y, *self._where()]
        carry.launch(self.layout, self.device, inputs, [state_out.d_x, state_out.d_y])
        self._d_x_ghosts.fill(state_out.d_x)
        self._d_y_ghosts.fill(state_out.d_y)

    def _advect(self, axis: int, f: wp.array) -> None:
        paper = self.fluid.scheme == "paper"
        advect = advection.advect_face_bilinear if paper else advection.advect_face_cubic
        before = (1, self.layout.pitch)[axis]
        inputs = [f, self._foot_x, self._foot_y, before, *self._where()]
        advect.launch(self.layout, self.device, inputs, [self._carried[axis]])
        self._velocity_ghosts[axis].fill(self._carried[axis])

    def _diffuse(self, axis: int, f: wp.array) -> None:
        """Diffused = f + the solution of A change = f - A f, for one component.

        Solving for the change keeps uniform motion exact and makes the solver's residual one of the
        change, not of the velocity; with a symmetric solver M the adjoint is 1 + (1 - A) M.
        """
        system, change, answer = self._diffusion[axis], self._change[axis], self._answer[axis]
        system.levels[0].residual(f, f, change)
        system.solve(self._solve_diffusion, change, answer)
        inputs, out = [f, answer, self._one], self._diffused[axis]
        relaxation.add_scaled.launch(self.layout, self.device, inputs, [out])
        self._velocity_ghosts[axis].fill(out)

    def _project(self, velocity: tuple[wp.array, wp.array], state_out: State) -> None:
        x, y = self._inverse_h[0:1], self._inverse_h[1:2]
        pitch = self.layout.pitch
        inputs = [*velocity, x, y, pitch]
        projection.minus_divergence.launch(self.layout, self.device, inputs, [self._minus_div])
        self._pressure.solve(self._solve_pressure, self._minus_div, self._q)
        inputs = [*velocity, self._q, x, y, pitch]
        projection.subtract_gradient.launch(self.layout, self.device, inputs, [state_out.u, state_out.v])
        for f, ghosts in zip((state_out.u, state_out.v), self._velocity_ghosts, strict=True):
            ghosts.fill(f)


class _Controls:
    """What changes from step to step, in one device array: dt / h and the forces' numbers."""

    def __init__(self, count: int, device: wp.Device):
        self.count = count
        self.device = device
        self.numbers = wp.zeros(2 + _PER_FORCE * max(count, 1), dtype=Real, device=device)
        self.dt_hx, self.dt_hy = self.numbers[0:1], self.numbers[1:2]
        self.center_x, self.center_y, self.radius, self.impulse_x, self.impulse_y = (
            self.numbers[2 + n * count : 2 + (n + 1) * count] if count else None for n in range(_PER_FORCE)
        )
        self._profiles: tuple[wp.array, ...] | None = None

    def set(self, grid: Grid, forces: Sequence[GaussianForce], t: float, dt: float, until: float) -> None:
        """Put a step of dt, in which forces act from t to `until`, on the device."""
        impulses = [force.envelope.integral(t, until) for force in forces]
        for force, impulse in zip(forces, impulses, strict=True):
            gained = math.hypot(*force.vector) * abs(impulse)
            if not gained <= FORCE_LIMIT * STEP_LIMIT:
                raise ValueError(
                    f"the force at {force.center} would add a velocity of {gained:g} between {t:g} s and "
                    f"{until:g} s; the limit is {FORCE_LIMIT * STEP_LIMIT:g}"
                )
        numbers = [dt / grid.hx, dt / grid.hy]
        numbers += [force.center[0] for force in forces]
        numbers += [force.center[1] for force in forces]
        numbers += [force.radius for force in forces]
        numbers += [force.vector[0] * impulse for force, impulse in zip(forces, impulses, strict=True)]
        numbers += [force.vector[1] * impulse for force, impulse in zip(forces, impulses, strict=True)]
        self.numbers[: len(numbers)].assign(np.array(numbers))

    def push(self, grid: Grid, fluid: Fluid, layout: Layout, u: wp.array, v: wp.array) -> None:
        """Add the forces' impulses to u and v, in place."""
        if self._profiles is None:
            self._profiles = tuple(
                wp.zeros(self.count * n, dtype=Real, device=self.device)
                for n in (grid.nx, grid.nx, grid.ny, grid.ny)
            )
        periodic_x, periodic_y = fluid.walls.periodic
        axes = (
            (self.center_x, grid.nx, 0.0, grid.hx, grid.width * periodic_x),
            (self.center_x, grid.nx, 0.5, grid.hx, grid.width * periodic_x),
            (self.center_y, grid.ny, 0.5, grid.hy, grid.height * periodic_y),
            (self.center_y, grid.ny, 0.0, grid.hy, grid.height * periodic_y),
        )
        for (center, points, start, h, period), profile in zip(axes, self._profiles, strict=True):
            inputs = [center, self.radius, points, start, h, period]
            force_kernels.profile.launch(self.count * points, self.device, inputs, [profile])
        inputs = [self.impulse_x, self.impulse_y, *self._profiles, grid.nx, grid.ny]
        force_kernels.push.launch(layout, self.device, inputs, [u, v], layers=self.count)
