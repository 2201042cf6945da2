"""Steps fluids: plans each step, captures it as a graph, replays it, and reports its residuals."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import STEP_LIMIT
from wfluid.fields.arrays import assign, copy, fill, from_numpy
from wfluid.fields.device import load_kernels
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.kernels.cell.layout import Layout
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, flatten
from wfluid.solve.system import Residual
from wfluid.step.forcing import Forcing
from wfluid.step.inertial import InertialStep
from wfluid.step.kinds import step_for

REPLAYS_KEPT = 16
"""Number of captured steps that are kept; the one that was used least recently is dropped first."""


@dataclass(frozen=True)
class SolveReport:
    """The residuals of the last step's solves."""

    pressure: Residual
    """Of the projection: iterations, and norms of the remaining divergence."""
    diffusion: Residual
    """Of the diffusion, relative to the change it made; of u only, where u and v are solved separately."""
    divergence: float
    """Largest |div v - s| after the step, s the prescribed divergence [1/s]."""
    prescribed: float = 0.0
    """Sum of the largest divergences that growths prescribed [1/s]."""
    removed: float = 0.0
    """Mean of the prescribed divergence, subtracted everywhere: walls and seams let no volume out [1/s]."""
    map_loss: float = 0.0
    """An estimate of how far places of the map are off by the solves of the diffusion since the run began
    [longer side]; 0 for steps outside a run."""


class Solver:
    """Steps one fluid on one grid and device.

    The constructor loads the kernels. For each pair of states, the first step from one to the other is
    captured as a graph, which later steps replay: they read the step's length and the forces' numbers from
    device memory. On a CPU with free cores two threads share the rows of every stage; the results have the
    same bits as with one. Several runs may take steps in turn, in threads of their own too: a step waits for
    the one before it, and takes what it needs of a run's last step from the state. A `report` is of the last
    step of all.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.compile_seconds = load_kernels(device)
        self.layout = Layout(grid.nx, grid.ny)
        self._step = step_for(grid, fluid, device)
        self._last_step, self._prescribed = (0.0, 0.0), 0.0
        self._written: WeakKeyDictionary[State, tuple[float, float]] = WeakKeyDictionary()
        self._stepping = threading.Lock()
        self._preparation: CapturedGraph | None = None
        self._forcings: dict[tuple, Forcing] = {}
        self._last_forcing: Forcing | None = None
        self._replays: dict[tuple, tuple[CapturedGraph, State, State, Forcing]] = {}
        self._pool = self._step.helpers()

    @property
    def transports_with_new_velocity(self) -> bool:
        """Whether a step moves the picture along the velocity after it; else along the one before it."""
        return self._step.transports_with_new_velocity

    def rest(self, points: np.ndarray | Sequence[tuple[float, float]] = ()) -> State:
        """A new state: fluid at rest, undistorted picture, initial densities.

        `points` (n, 2) are positions x, y in the picture [longer side] that the flow moves along.

        Raises:
            ValueError: points that are not (n, 2) finite numbers within the picture.
        """
        points, extent = np.asarray(points, dtype=np.float64), (self.grid.width, self.grid.height)
        if points.size and (
            points.ndim != 2 or points.shape[1] != 2 or not np.all((points >= 0) & (points <= extent))
        ):
            raise ValueError("points: expected x, y within the picture for each")
        state = State.at_rest(self.grid, self.device, len(self._step.densities), len(points))
        for density, rho in zip(self._step.densities, state.rho, strict=True):
            density.begin(rho)
        if points.size:
            assign(points[:, 0] / self.grid.hx, state.p_x)
            assign(points[:, 1] / self.grid.hy, state.p_y)
        return state

    def set_velocity(self, state: State, u: np.ndarray, v: np.ndarray) -> None:
        """Set the face velocities of `state`: u (ny, nx + 1), v (ny + 1, nx) [longer side/s]."""
        self._check(state)
        for values, f, ghosts in zip((u, v), (state.u, state.v), self._step.velocity_ghosts, strict=True):
            from_numpy(values, f, self.layout)
            ghosts.fill(f)
        fill(0.0, state.q)

    def add_velocity(self, state: State, u: np.ndarray, v: np.ndarray) -> None:
        """Add to the face velocities of `state`: u (ny, nx + 1), v (ny + 1, nx) [longer side/s]."""
        self._check(state)
        for values, old, f, ghosts in zip(
            (u, v), state.velocity, (state.u, state.v), self._step.velocity_ghosts, strict=True
        ):
            from_numpy(old + values, f, self.layout)
            ghosts.fill(f)

    def set_map(self, state: State, displacement: np.ndarray) -> None:
        """Set the map of `state` from its displacement (ny, nx, 2) [longer side]."""
        self._check(state)
        cells = displacement / (self.grid.hx, self.grid.hy)
        for n, (f, ghosts) in enumerate(zip((state.d_x, state.d_y), self._step.moved_ghosts, strict=True)):
            from_numpy(cells[..., n], f, self.layout)
            ghosts.fill(f)

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

        Forces act from t to `until`, by default t + dt. Give the exact number at which the next step begins:
        then rounding leaves no gap between two steps.

        Raises:
            ValueError: dt negative, not finite or above 10 s; the two states are the same, or of another
                grid or device; a force whose impulse is not finite or beyond the limit.
        """
        if not (math.isfinite(dt) and 0 <= dt <= STEP_LIMIT):
            raise ValueError(f"step of {dt} s: expected 0 … {STEP_LIMIT:g}")
        if state_in is state_out:
            raise ValueError("a step cannot write the state it reads")
        self._check(state_in, state_out)
        until = t + dt if until is None else until
        with self._stepping:
            self._graph_for(state_in, state_out, flatten(forces), t, dt, until).launch()

    def _graph_for(
        self,
        state_in: State,
        state_out: State,
        forces: Sequence[Force],
        t: float,
        dt: float,
        until: float,
    ) -> CapturedGraph:
        """The captured step, its numbers uploaded to device memory."""
        step, forcing = self._step, self._forcing_for(forces)
        last_dt, last_prescribed = self._written.get(state_in, self._last_step)
        pressure_part = step.pressure_part(dt, last_dt, last_prescribed > 0)
        self._prescribed = forcing.set(forces, self.fluid, t, dt, until, pressure_part)
        self._last_forcing, self._last_step = forcing, (dt, self._prescribed)
        self._written[state_out] = self._last_step
        plan = step.plan(until, dt, self._prepare)
        key = (id(state_in), id(state_out), id(forcing), plan)
        if key not in self._replays:
            work = partial(step.advance, state_in, state_out, forcing)
            replay = CapturedGraph(self.device, work, self._pool)
            self._replays[key] = (replay, state_in, state_out, forcing)
            if len(self._replays) > REPLAYS_KEPT:
                del self._replays[next(iter(self._replays))]
        self._replays[key] = self._replays.pop(key)  # the newest last
        return self._replays[key][0]

    def _prepare(self) -> None:
        """Replay `Step.update_coefficients`."""
        if self._preparation is None:
            self._preparation = CapturedGraph(self.device, self._step.update_coefficients, self._pool)
        self._preparation.launch()

    def report(self) -> SolveReport:
        """Measure the true residuals and the divergence of the last step."""
        pressure, diffusion, divergence = self._step.measure()
        removed = self._last_forcing.removed if self._last_forcing else 0.0
        return SolveReport(pressure, diffusion, divergence, self._prescribed, removed)

    def carry(self, state_in: State, state_out: State, dt: float) -> None:
        """Only carry the map along `state_in`'s velocity for dt, which may be negative.

        The velocity of `state_out` does not change.
        """
        self._check(state_in, state_out)
        forcing = self._forcing_for(())
        forcing.set((), self.fluid, 0.0, dt, dt)
        foot = self._step.trace(state_in, forcing)
        self._step.carry_map(state_in, foot, state_out)

    def compose(self, outer: State, inner: State, out: State) -> None:
        """Only compose maps: `out` has at each place the source that `outer` has at the source of `inner`."""
        self._check(outer, inner, out)
        self._step.carry_map(outer, (inner.d_x, inner.d_y), out)

    def diffuse(self, state_in: State, state_out: State, dt: float, *, t: float = 0.0) -> None:
        """Only diffuse the velocity for dt, from time t on. The map of `state_out` does not change."""
        self._check(state_in, state_out)
        step = self._ready(state_in, t + dt, dt)
        for f, out in zip(step.diffuse((state_in.u, state_in.v)), (state_out.u, state_out.v), strict=True):
            copy(f, out)

    def project(self, state_in: State, state_out: State, dt: float = 0.0) -> None:
        """Only project the velocity, as in a step of dt. The map of `state_out` does not change."""
        self._check(state_in, state_out)
        step = self._ready(state_in, 0.0, dt)
        step.project((state_in.u, state_in.v), (state_out.u, state_out.v))

    def _ready(self, state: State, t: float, dt: float) -> InertialStep:
        """The step, set up so that a single stage can run.

        Raises:
            TypeError: the fluid creeps, so that its step has no such stages.
        """
        if not isinstance(self._step, InertialStep):
            raise TypeError("a creeping fluid neither diffuses nor projects a velocity; give it inertia")
        self._step.plan(t, dt, self._prepare)
        if self.fluid.viscosity_moves:
            self._step.update_coefficients(state)
        return self._step

    def _check(self, *states: State) -> None:
        """Refuse states of another grid or device, or with other numbers of densities or points."""
        for state in states:
            if state.grid != self.grid or state.u.device != self.device:
                raise ValueError(f"a state of {state.grid} on {state.u.device} in a solver of {self.grid}")
            if len(state.rho) != len(self._step.densities) or len(state.p_x) != len(states[0].p_x):
                raise ValueError(
                    f"a state with {len(state.rho)} densities and {len(state.p_x)} points: expected "
                    f"{len(self._step.densities)} and {len(states[0].p_x)}"
                )

    def _forcing_for(self, forces: Sequence[Force]) -> Forcing:
        key = Forcing.key(forces)
        if key not in self._forcings:
            if len(self._forcings) >= REPLAYS_KEPT:
                del self._forcings[next(iter(self._forcings))]
            self._forcings[key] = Forcing(forces, self.fluid, self.grid, self.device)
        return self._forcings[key]
