"""A run of steps that can be repeated with other numbers, with its backward pass.

Forward, the run takes its steps in a captured loop (`step_loops`) and stores the state after each.
Backward, a second loop plays the tape of a step, from the last step to the first. Of each step it reads the
stored state and computes again what else the transposes read; only the solves need not be repeated.

If a memory cap leaves no room for all states, the run is cut into segments (`checkpoints`). Forward, the
state at the beginning of each segment is stored as a checkpoint. Backward, the steps of a segment are taken
again from its checkpoint, now with all states stored, and then played back. All segments use the rows of
the same tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

from wfluid.domain.timeline import Timeline
from wfluid.fields.arrays import assign, copy, fill, finite, from_numpy, to_numpy
from wfluid.fields.device import load_kernels
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.gradient.checkpoints import Advance, Restore, Reverse, Schedule, Store, even_segments, least_room
from wfluid.gradient.state_objectives import DeviceObjective
from wfluid.gradient.step_loops import WORKING_STATES, StepLoops, WorkingStates
from wfluid.gradient.step_tables import StepTable
from wfluid.gradient.variables import Setup
from wfluid.step.forcing import Forcing
from wfluid.step.step import Step

MEGABYTE = 2**20

Watch = Callable[[int, State], None]
"""Is called in the backward pass with each step and the gradient with respect to the state before it."""


@dataclass(frozen=True)
class RunGradients:
    """The gradients that the backward pass of a run computes."""

    velocity: np.ndarray
    """With respect to the velocity at the beginning, (2, ny, nx)."""
    viscosity: np.ndarray
    """With respect to the viscosity at centres, (ny, nx); 0 unless it was asked for."""
    forces: Mapping[int, np.ndarray]
    """With respect to the impulses of each force in every step (`Forcing.gradients`)."""
    sources: Sequence[Mapping[int, np.ndarray]]
    """The same for the sources of each density."""


@dataclass(frozen=True, eq=False)
class StepRange:
    """The steps of a timeline that a run consists of."""

    first: int
    """Number of the first step."""
    last: int
    """Number of the step before which the run ends."""
    begun: State | None
    """The state before the first step; None for fluid at rest, or with the velocity of the `Setup`."""
    points: np.ndarray
    """Positions of the particles at the beginning [longer side], (n, 2)."""


class Recording:
    """A run of a `StepRange` of a timeline, with its backward pass.

    `terms` are objectives of the state after some steps, counted from the run's beginning. With `effort` the
    squared velocity changes due to forces count too (`Effort`). The tables have rows for at least `room`
    steps, so that the recording can be `moved` to longer ranges.

    Raises:
        ValueError: a memory cap too small, with the least that works.
    """

    def __init__(
        self,
        step: Step,
        setup: Setup,
        timeline: Timeline,
        steps: StepRange,
        terms: Mapping[int, Sequence[DeviceObjective]],
        memory_mb: float | None = None,
        of_viscosity: bool = False,
        effort: bool = False,
        room: int = 0,
    ):
        self.step, self.timeline, self.device = step, timeline, step.device
        self._range, self._terms = steps, terms
        self._term_graphs: dict[Callable, CapturedGraph] = {}
        grid, device = step.grid, step.device
        self._effort = grid.hx * grid.hy / timeline.dt if effort else 0.0
        load_kernels(device)
        step.allow_gradients(of_viscosity)
        self._working = WorkingStates(step, len(steps.points))
        self.schedule = self._planned(memory_mb)
        longest = max(end - start for start, end in self.schedule.segments)
        self.room = max(self.steps, room) if self.schedule.keeps_all else longest
        checkpoints = 0 if self.schedule.keeps_all else len(self.schedule.segments)
        self._checkpoints = [StepTable(a, checkpoints) for a in self._stored_before]
        forcing = Forcing(setup.forces, setup.fluid, grid, device, gradients=True, effort=self._effort)
        self.loops = StepLoops(step, self._working, forcing, self.room, of_viscosity, effort)
        self.set(setup)

    schedule: Schedule
    """The segments of the run and their checkpoints."""
    room: int
    """Number of steps whose states are stored at once."""

    @property
    def steps(self) -> int:
        """Number of steps."""
        return self._range.last - self._range.first

    def moved(self, setup: Setup, steps: StepRange) -> None:
        """Run another range of steps with another setup, which it `suits`.

        Raises:
            ValueError: as `set`.
        """
        self._range = steps
        self.schedule = self._planned(None)
        self.set(setup)

    def suits(self, setup: Setup, steps: StepRange, effort: bool) -> bool:
        """Whether it can be `moved` to a range of steps and a setup: its graphs and tables fit them."""
        return (
            self.schedule.keeps_all
            and not self._terms
            and effort == bool(self._effort)
            and steps.last - steps.first <= self.room
            and len(steps.points) == len(self._range.points)
            and setup.fluid is self.step.fluid
            and Forcing.key(setup.forces) == Forcing.key(self._setup.forces)
        )

    @property
    def _stored_before(self) -> list[wp.array]:
        """The arrays of the current state that are stored for every step."""
        return self._working.stored(self._working.before)

    def _planned(self, memory_mb: float | None) -> Schedule:
        """The schedule with the longest segments that fit in the memory."""
        breaks = [step for step, terms in self._terms.items() if terms]
        if memory_mb is None:
            return even_segments(self.steps, breaks=breaks)
        coefficients, row = self.step.coefficients, sum(a.capacity for a in self._stored_before)
        if coefficients and coefficients.changes:
            row += self._working.before.u.capacity  # the viscosity of the step
        state_mb = row / MEGABYTE
        try:
            return even_segments(self.steps, int(memory_mb / state_mb) - WORKING_STATES, breaks)
        except ValueError:
            least = math.ceil(100 * (least_room(self.steps, breaks) + WORKING_STATES) * state_mb) / 100
            raise ValueError(
                f"memory_mb {memory_mb:g}: {self.steps} steps on {self.step.grid.nx} x "
                f"{self.step.grid.ny} cells need at least {least:g}"
            ) from None

    @property
    def memory(self) -> int:
        """Memory of all states and their gradients [bytes]."""
        viscosities = [self.loops.viscosities] if self.loops.viscosities else []
        tables = (*self.loops.states, *self._checkpoints, *viscosities)
        working = WORKING_STATES * sum(a.capacity for a in self._stored_before)
        return sum(table.array.capacity for table in tables) + working

    def time_of(self, step: int) -> float:
        """The time at which a step of the run begins [s]."""
        return self.timeline.time_of(self._range.first + step)

    def set(self, setup: Setup) -> None:
        """Set the numbers of the fluid and forces, whose types must be those of the first setup.

        Raises:
            ValueError: a force beyond the limit.
        """
        self._setup, dt = setup, self.timeline.dt
        rows, prescribed = [], False
        before = min(1, self._range.first)  # the pressure part of the first step depends on the step before
        for n in range(-before, self.steps):
            last_dt = dt if self._range.first + n else 0.0
            part = self.step.pressure_part(dt, last_dt, prescribed)
            t, until = self.time_of(n), self.time_of(n + 1)
            row = self.loops.forcing.row(setup.forces, setup.fluid, t, dt, until, part, act_at_zero=True)
            prescribed = row.prescribed > 0
            rows.append(row)
        self._numbers = np.stack([row.numbers for row in rows[before:]])
        self._boxes = np.stack([row.boxes for row in rows[before:]])
        self.step.take_fluid(setup.fluid)
        if self.loops.viscosities:
            methods = self.step.expect([self.time_of(n + 1) for n in range(self.steps)], dt)
        else:
            methods = self.step.plan(self.time_of(1), dt, self.loops.update_coefficients)
        self.loops.capture(methods)

    def forward(self, observed: Sequence[int] = ()) -> tuple[float, dict[int, np.ndarray]]:
        """Run all steps.

        Returns the value of the effort and the terms, and the particles' positions [longer side], (n, 2),
        after each of the `observed` steps.
        """
        self._begin()
        positions: dict[int, np.ndarray] = {}
        value = 0.0
        for action in self.schedule.forward():
            self._play(action)
            if not isinstance(action, Advance):
                continue
            base, length = self._base(action.start), action.end - action.start
            for step in observed:
                if action.start < step <= action.end:
                    positions[step] = self._positions_at(base + step - action.start)
            for squares in self.loops.squares.rows(base, base + length):  # in the same order for any segments
                value += 0.5 * self._effort * float(squares.sum(dtype=np.float64))
            for term in self._terms.get(action.end, ()):
                self._term_graph(term, term.measure).launch()
                value += term.value()
        return value, positions

    def end(self) -> State:
        """A copy of the state at the end of the last `forward`."""
        return self._working.before.copy()

    @property
    def finite(self) -> bool:
        """Whether the state at the end of the last `forward` is finite; what is not finite stays so."""
        return finite(self._stored_before)

    def _positions_at(self, row: int) -> np.ndarray:
        """The particles' positions [longer side], (n, 2), in a row of the tables."""
        columns = [table.rows(row, row + 1)[0].astype(np.float64) for table in self.loops.states[-2:]]
        return np.stack(columns, axis=1) * (self.step.grid.hx, self.step.grid.hy)

    def first_step_not_finite(self) -> int | None:
        """Repeat the run to find the first step after which the state is not finite; None if it always is."""
        self._begin()
        for action in self.schedule.forward():
            self._play(action)
            if isinstance(action, Advance):
                base = self._base(action.start)
                for n in range(action.end - action.start):
                    ends = [table.rows(base + n + 1, base + n + 2) for table in self.loops.states]
                    if not all(np.all(np.isfinite(end)) for end in ends):
                        return action.start + n
        return None

    def backward(self, particle_bars: Mapping[int, np.ndarray], watch: Watch | None = None) -> RunGradients:
        """The backward pass of the last `forward`.

        `particle_bars` are gradients (n, 2) with respect to the particles' positions [longer side], by the
        number of the step after which they are. With `watch` every step is launched without a graph.
        """
        fill(0.0, self.step.mu_bar)
        self._working.after_bar.zero_()
        bars = np.zeros((self.steps, self.loops.bars.size))
        for action in self.schedule.backward():
            if isinstance(action, Reverse):
                self._reverse(action, particle_bars, watch)
                base, length = self._base(action.start), action.end - action.start
                bars[action.start : action.end] = self.loops.bars.rows(base, base + length)
            else:
                self._play(action)
        layout, bar, forcing = self.step.layout, self._working.after_bar, self.loops.forcing
        velocity = [to_numpy(f, layout).astype(np.float64) for f in (bar.u, bar.v)]
        if self.step.coefficients:
            self.step.coefficients.fold_painted()
        return RunGradients(
            np.stack(velocity),
            to_numpy(self.step.mu_bar, layout).astype(np.float64),
            forcing.gradients(self._numbers, bars),
            forcing.source_gradients(self._numbers, bars),
        )

    def _reverse(self, action: Reverse, particle_bars: Mapping[int, np.ndarray], watch: Watch | None) -> None:
        """The backward pass of one segment, whose states are in the tables."""
        start, length, base = action.start, action.end - action.start, self._base(action.start)
        terms = self._terms.get(action.end, ())
        if terms:
            self._copy([table.row(base + length) for table in self.loops.states], self._stored_before)
        for term in terms:
            self._term_graph(term, term.adjoint).launch()
        scales = (self.step.grid.hx, self.step.grid.hy)
        for axis, (table, h) in enumerate(zip(self.loops.particle_bars, scales, strict=True)):
            rows = np.zeros((length, table.size))
            for n in range(length):
                if start + n + 1 in particle_bars:
                    rows[n] = particle_bars[start + n + 1][:, axis] * h
            table.put(base + 1, rows)
        if watch is None:
            self.loops.backward(base, base + length)
            return
        for n in reversed(range(length)):
            self.loops.backward_step(base + n)
            watch(start + n, self._working.bar)

    def _term_graph(self, term: DeviceObjective, work: Callable) -> CapturedGraph:
        """The launches of a term's method, captured when first used."""
        if work not in self._term_graphs:
            end, bar = self._working.end, self._working.after_bar
            arguments = [end, bar] if work == term.adjoint else [end]
            self._term_graphs[work] = CapturedGraph(self.device, partial(work, *arguments), None)
        return self._term_graphs[work]

    def _base(self, start: int) -> int:
        """The row of a segment's first state."""
        return start if self.schedule.keeps_all else 0

    def _begin(self) -> None:
        """Set the state at the beginning: the one given, or fluid at rest with the setup's velocity."""
        state, step, grid = self._working.before, self.step, self.step.grid
        for p, column, h in zip(state.particles, self._range.points.T, (grid.hx, grid.hy), strict=True):
            assign(column / h, p)
        if self._range.begun:
            self._copy(self._range.begun.fields, state.fields)
            return
        fill(0.0, *state.fields)
        for density, rho in zip(step.densities, state.rho, strict=True):
            density.begin(rho)
        components = zip(self._setup.velocity, (state.u, state.v), step.velocity_ghosts, strict=True)
        for values, f, ghosts in components:
            from_numpy(values, f, step.layout)
            ghosts.fill(f)

    def _play(self, action: Advance | Store | Restore | Reverse) -> None:
        """Take the steps of a segment, or copy the current state to or from a checkpoint."""
        if isinstance(action, Advance):
            base = self._base(action.start)
            self._upload(action.start, action.end)
            self.loops.forward(base, base + action.end - action.start)
        elif isinstance(action, Store | Restore):
            number = [start for start, _ in self.schedule.segments].index(action.step)
            checkpoint, current = [table.row(number) for table in self._checkpoints], self._stored_before
            self._copy(*((current, checkpoint) if isinstance(action, Store) else (checkpoint, current)))

    def _upload(self, start: int, end: int) -> None:
        """Write the numbers of a segment's steps, and the current state before them, to the tables."""
        base, coefficients, viscosities = self._base(start), self.step.coefficients, self.loops.viscosities
        self.loops.numbers.put(base, self._numbers[start:end])
        self.loops.boxes.put(base, self._boxes[start:end])
        if coefficients and viscosities:
            for step in range(start, end):
                mu, row = coefficients.at(self.time_of(step + 1)), viscosities.row(base + step - start)
                from_numpy(mu, row, self.step.layout)
        self._copy(self._stored_before, [table.row(base) for table in self.loops.states])

    def _copy(self, source: Sequence[wp.array], to: Sequence[wp.array]) -> None:
        """Copy arrays to others."""
        for a, b in zip(source, to, strict=True):
            copy(a, b)
