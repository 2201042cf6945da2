"""A run that can be gone back through.

A step, whose stages a `wp.Tape` records, is captured in two graphs: a loop of steps forward, and a loop of
the tape played back. Of each step only its state is kept: what else the tape reads is computed again, but
for the solves. Both loops find in device memory which step they are at (`kernels/adjoint/step_table.py`):
the state it begins with, the numbers of what acts, where to leave what they find. So they are captured
once, in the time of one step, for runs of any length and whatever their numbers. Only a solve by another
method (more cycles for a stiffer fluid) has them captured anew.

With a cap on memory, segments of the run take turns in the same tables (`checkpoints`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

from wfluid.domain.timeline import Timeline
from wfluid.fields.arrays import assign, copy, fill, finite, from_numpy, to_numpy, zeros
from wfluid.fields.device import load_kernels
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.gradient.checkpoints import Advance, Restore, Reverse, Schedule, Store, even_segments, least_room
from wfluid.gradient.state_objectives import DeviceObjective
from wfluid.gradient.step_tables import StepCounter, StepTable
from wfluid.gradient.variables import Setup
from wfluid.kernels.adjoint import misfit
from wfluid.kernels.cell.strips import STRIP, repeat_while
from wfluid.step.forcing import Forcing
from wfluid.step.step import Step
from wfluid.step.tape import recording

MEGABYTE = 2**20

WORKING_STATES = 4
"""Before and after a step, and the gradients with respect to both."""


@dataclass(frozen=True)
class RunGradients:
    """The gradients that going back through a run found."""

    velocity: np.ndarray
    """With respect to the velocity at the beginning, (2, ny, nx)."""
    viscosity: np.ndarray
    """With respect to the viscosity at centres, (ny, nx); 0 unless it was asked for."""
    forces: Mapping[int, np.ndarray]
    """With respect to what each force does in every step (`Forcing.gradients`)."""
    sources: list[Mapping[int, np.ndarray]]
    """The same for the sources of each density."""


@dataclass(frozen=True, eq=False)
class StepRange:
    """Steps of a timeline that are run."""

    first: int
    """The first of them."""
    last: int
    """The step before which they end."""
    begun: State | None
    """The fluid at the first; None at rest."""
    points: np.ndarray
    """Where particles begin [longer side], (n, 2)."""


class Recording:
    """A run of a timeline's steps, ready to be repeated with other numbers and gone back through.

    It runs over a `StepRange` of the timeline. `terms` are objectives of the state after some steps. With
    `effort` half the squares of what forces add count too. With `room` for more steps than it has it can be
    `moved` to other stretches.

    Raises:
        ValueError: a memory cap too small, with the least that works.
    """

    def __init__(
        self,
        step: Step,
        setup: Setup,
        timeline: Timeline,
        stretch: StepRange,
        terms: Mapping[int, Sequence[DeviceObjective]],
        memory_mb: float | None = None,
        of_viscosity: bool = False,
        effort: bool = False,
        room: int = 0,
    ):
        self.step, self.timeline, self.device = step, timeline, step.device
        self._stretch, self._terms = stretch, terms
        self._term_replays: dict[Callable, CapturedGraph] = {}
        grid, device = step.grid, step.device
        self._effort = grid.hx * grid.hy / timeline.dt if effort else 0.0
        load_kernels(device)
        self._of_viscosity = of_viscosity
        step.allow_gradients(of_viscosity)
        self._before, self._after, self._bar, self._after_bar = (
            State.at_rest(grid, device, len(step.densities), len(stretch.points))
            for _ in range(WORKING_STATES)
        )
        self._before.take_gradient(self._bar)
        self._after.take_gradient(self._after_bar)
        self._end = self._before.view()  # the same arrays for objectives, which add to what comes after
        self._end.take_gradient(self._after_bar)
        self.schedule = self._planned(memory_mb)
        longest = max(end - start for start, end in self.schedule.segments)
        rows = max(self.steps, room) if self.schedule.keeps_all else longest
        stored = 0 if self.schedule.keeps_all else len(self.schedule.segments)
        self.room = rows
        self._states = [StepTable(a, rows + 1) for a in self._kept(self._before)]
        self._stored = [StepTable(a, stored) for a in self._kept(self._before)]
        self._forcing = Forcing(setup.forces, setup.fluid, grid, device, gradients=True, effort=self._effort)
        self._numbers, self._boxes, self._bars = (
            StepTable(a, rows) for a in (self._forcing.numbers, self._forcing.boxes, self._forcing.bars)
        )
        self._pulls = [StepTable(p, rows + 1) for p in self._before.particles]
        changes = step.coefficients and step.coefficients.changes
        self._viscosities = StepTable(step.coefficients.painted_mu, rows) if changes else None
        self._squares = zeros(2 * grid.ny if effort else 0, device)
        self._square_rows = StepTable(self._squares, rows)
        self._counter, self._pool = StepCounter(device), step.helpers(alone=True)
        self._preparation: CapturedGraph | None = None
        self._tape = wp.Tape()
        self._plan: tuple = ()
        self.set(setup)

    schedule: Schedule
    """How its segments are kept and stored."""
    room: int
    """Steps that are kept at once."""

    @property
    def steps(self) -> int:
        """How many steps it has."""
        return self._stretch.last - self._stretch.first

    def moved(self, setup: Setup, stretch: StepRange) -> None:
        """Run over another stretch, for which there is room, with as many points, and with another setup.

        Raises:
            ValueError: as `set`.
        """
        self._stretch = stretch
        self.schedule = self._planned(None)
        self.set(setup)

    def suits(self, setup: Setup, stretch: StepRange, effort: bool) -> bool:
        """Whether it may be `moved` to a stretch and a setup of the same fluid."""
        return (
            self.schedule.keeps_all
            and not self._terms
            and effort == bool(self._effort)
            and stretch.last - stretch.first <= self.room
            and len(stretch.points) == len(self._stretch.points)
            and setup.fluid is self.step.fluid
            and Forcing.key(setup.forces) == Forcing.key(self._setup.forces)
        )

    def _kept(self, state: State) -> list[wp.array]:
        """What of a state is kept for every step: all, but for a pressure that the next step does not use."""
        fields = state.fields if self.step.coefficients else [f for f in state.fields if f is not state.q]
        return [*fields, *state.particles]

    def _planned(self, memory_mb: float | None) -> Schedule:
        breaks = [step for step, terms in self._terms.items() if terms]
        if memory_mb is None:
            return even_segments(self.steps, breaks=breaks)
        coefficients, row = self.step.coefficients, sum(a.capacity for a in self._kept(self._before))
        if coefficients and coefficients.changes:
            row += self._before.u.capacity  # each step's own viscosity
        each = row / MEGABYTE
        try:
            return even_segments(self.steps, int(memory_mb / each) - WORKING_STATES, breaks)
        except ValueError:
            least = math.ceil(100 * (least_room(self.steps, breaks) + WORKING_STATES) * each) / 100
            raise ValueError(
                f"memory_mb {memory_mb:g}: {self.steps} steps on {self.step.grid.nx} x "
                f"{self.step.grid.ny} cells need at least {least:g}"
            ) from None

    @property
    def memory(self) -> int:
        """Bytes of all states and gradients."""
        viscosities = [self._viscosities] if self._viscosities else []
        tables = sum(table.array.capacity for table in (*self._states, *self._stored, *viscosities))
        return tables + WORKING_STATES * sum(a.capacity for a in self._kept(self._before))

    def time_of(self, step: int) -> float:
        """When a step begins [s]."""
        return self.timeline.time_of(self._stretch.first + step)

    def set(self, setup: Setup) -> None:
        """Take a setup whose fluid and forces differ from the first in numbers only.

        Raises:
            ValueError: a force beyond the limit.
        """
        self._setup, dt = setup, self.timeline.dt
        rows, swelled = [], False
        before = min(1, self._stretch.first)  # the step before decides what of its pressure is kept
        for n in range(-before, self.steps):
            kept = self.step.kept(dt, dt if self._stretch.first + n else 0.0, swelled)
            t, until = self.time_of(n), self.time_of(n + 1)
            rows.append(self._forcing.row(setup.forces, setup.fluid, t, dt, until, kept, act_at_zero=True))
            swelled = rows[-1].prescribed > 0
        self._all_numbers = np.stack([row.numbers for row in rows[before:]])
        self._all_boxes = np.stack([row.boxes for row in rows[before:]])
        self.step.take_fluid(setup.fluid)
        if self._viscosities:
            plan = self.step.expect([self.time_of(n + 1) for n in range(self.steps)], dt)
        else:
            plan = self.step.plan(self.time_of(1), dt, self._prepare)
        if plan != self._plan:
            self._plan = ()  # should the captures be interrupted
            self.step.allow_gradients(self._of_viscosity)
            forward = CapturedGraph(self.device, self._record, self._pool)
            backward = CapturedGraph(self.device, self._play_back, self._pool)
            self._forward, self._backward, self._plan = forward, backward, plan

    def _prepare(self) -> None:
        if self._preparation is None:
            self._preparation = CapturedGraph(self.device, self.step.update_coefficients, self._pool)
        self._preparation.launch()

    def _record(self) -> None:
        """Steps in a loop; the tape records one of them; launches only."""
        counter, forcing, before, after = self._counter, self._forcing, self._before, self._after

        def work() -> None:
            self._numbers.take(counter, forcing.numbers)
            self._boxes.take(counter, forcing.boxes)
            self._take_viscosity()
            if _first_strip():  # what the others launch is the same
                with recording() as self._tape:
                    self.step.advance(before, after, forcing)
            else:
                self.step.advance(before, after, forcing)
            if self._squares.size:
                self._measure_effort()
                self._square_rows.give(counter, self._squares)
            for table, f, to in zip(self._states, self._kept(after), self._kept(before), strict=True):
                table.give(counter, f, ahead=1)
                table.copy(f, to)
            counter.count(1)

        repeat_while(counter.going, work)

    def _take_viscosity(self) -> None:
        """Take the step's own viscosity, where it depends on the time; launches only."""
        if not self._viscosities:
            return
        coefficients = self.step.coefficients
        self._viscosities.take(self._counter, coefficients.painted_mu)
        coefficients.fill_painted()
        if not self.step.fluid.viscosity_moves:  # else it is taken along in the step
            self.step.update_coefficients()

    def _measure_effort(self) -> None:
        """Squares of what forces add to the velocity, summed along rows; launches only."""
        state, layout = self._before, self.step.layout
        pushed = self.step.pushed if self._forcing.adds_velocity else (state.u, state.v)
        for n, (f, before) in enumerate(zip(pushed, (state.u, state.v), strict=True)):
            inputs = [f, before, layout.nx, layout.pitch, n * layout.ny]
            misfit.row_squares.launch(layout.ny, self.device, inputs, [self._squares])

    def _play_back(self) -> None:
        """The tape in a loop; launches only."""
        repeat_while(self._counter.going, self._step_back)

    def _step_back(self) -> None:
        counter, forcing, before = self._counter, self._forcing, self._before
        counter.count(-1)
        self._numbers.take(counter, forcing.numbers)
        self._boxes.take(counter, forcing.boxes)
        self._take_viscosity()
        for table, f in zip(self._states, self._kept(before), strict=True):
            table.take(counter, f)
        for pulls, bar in zip(self._pulls, self._after_bar.particles, strict=True):
            pulls.add_to(counter, bar, ahead=1)
        self.step.recompute(before, forcing)
        self._tape.backward()
        self._bars.give(counter, forcing.bars)
        bars = zip(self._states, self._kept(self._bar), self._kept(self._after_bar), strict=True)
        for table, f, to in bars:
            table.copy(f, to)

    def forward(self, looked_at: Sequence[int] = ()) -> dict[int, np.ndarray]:
        """Run it; where the particles are [longer side], (n, 2), after each of the steps `looked_at`."""
        self._begin()
        places: dict[int, np.ndarray] = {}
        self._value = 0.0
        for action in self.schedule.forward():
            self._do(action)
            if not isinstance(action, Advance):
                continue
            base = self._base(action.start)
            length = action.end - action.start
            for step in looked_at:
                if action.start < step <= action.end:
                    places[step] = self._places_at(base + step - action.start)
            for squares in self._square_rows.rows(base, base + length):  # in an order that no cap changes
                self._value += 0.5 * self._effort * float(squares.sum(dtype=np.float64))
            for term in self._terms.get(action.end, ()):
                self._replay(term, term.measure).launch()
                self._value += term.value()
        return places

    @property
    def value(self) -> float:
        """What the last `forward` found of effort and of the terms."""
        return self._value

    def end(self) -> State:
        """A copy of the state at the end of the last `forward`."""
        return self._before.copy()

    @property
    def finite(self) -> bool:
        """Whether the fluid was at the end of the last `forward`; what is not finite spreads, and stays."""
        return finite(self._kept(self._before))

    def _places_at(self, row: int) -> np.ndarray:
        columns = [table.rows(row, row + 1)[0].astype(np.float64) for table in self._states[-2:]]
        return np.stack(columns, axis=1) * (self.step.grid.hx, self.step.grid.hy)

    def first_step_not_finite(self) -> int | None:
        """The first step after which the fluid is not finite, run again; None where it stays so."""
        self._begin()
        for action in self.schedule.forward():
            self._do(action)
            if isinstance(action, Advance):
                base = self._base(action.start)
                for n in range(action.end - action.start):
                    ends = [table.rows(base + n + 1, base + n + 2) for table in self._states]
                    if not all(np.all(np.isfinite(end)) for end in ends):
                        return action.start + n
        return None

    def backward(
        self, pulls: Mapping[int, np.ndarray], watch: Callable[[int, State], None] | None = None
    ) -> RunGradients:
        """Go back through the last `forward`.

        `pulls` are gradients (n, 2) with respect to the particles' places [longer side] after some steps.
        With `watch`, which is told each step and the gradient before it, all is done singly, not replayed.
        """
        self._clear()
        bars = np.zeros((self.steps, self._bars.size))
        for action in self.schedule.backward():
            if isinstance(action, Reverse):
                self._reverse(action, pulls, watch)
                base, length = self._base(action.start), action.end - action.start
                bars[action.start : action.end] = self._bars.rows(base, base + length)
            else:
                self._do(action)
        layout, numbers = self.step.layout, self._all_numbers
        velocity = [to_numpy(f, layout).astype(np.float64) for f in (self._after_bar.u, self._after_bar.v)]
        if self.step.coefficients:
            self.step.coefficients.fold_painted()
        return RunGradients(
            np.stack(velocity),
            to_numpy(self.step.mu_bar, layout).astype(np.float64),
            self._forcing.gradients(numbers, bars),
            self._forcing.source_gradients(numbers, bars),
        )

    def _clear(self) -> None:
        """Begin with no gradients."""
        fill(0.0, self.step.mu_bar)
        self._after_bar.zero_()

    def _reverse(
        self, action: Reverse, pulls: Mapping[int, np.ndarray], watch: Callable[[int, State], None] | None
    ) -> None:
        """Go back through one segment."""
        start, length, base = action.start, action.end - action.start, self._base(action.start)
        terms = self._terms.get(action.end, ())
        if terms:
            self._copy([table.row(base + length) for table in self._states], self._kept(self._before))
        for term in terms:
            self._replay(term, term.adjoint).launch()
        scales = (self.step.grid.hx, self.step.grid.hy)
        for axis, (table, h) in enumerate(zip(self._pulls, scales, strict=True)):
            rows = np.zeros((length, table.size))
            for n in range(length):
                if start + n + 1 in pulls:
                    rows[n] = pulls[start + n + 1][:, axis] * h
            table.put(base + 1, rows)
        if watch is None:
            self._counter.set(base + length, base)
            self._backward.launch()
            return
        for n in reversed(range(length)):
            self._counter.set(base + n + 1, base + n)
            self._step_back()
            watch(start + n, self._bar)

    def _replay(self, term: DeviceObjective, work: Callable) -> CapturedGraph:
        """Launches of a term, captured when first used."""
        if work not in self._term_replays:
            arguments = [self._end, self._after_bar] if work == term.adjoint else [self._end]
            self._term_replays[work] = CapturedGraph(self.device, partial(work, *arguments), None)
        return self._term_replays[work]

    def _base(self, start: int) -> int:
        """The row of a segment's first state."""
        return start if self.schedule.keeps_all else 0

    def _begin(self) -> None:
        """The state at the beginning: what was given, or at rest but for the velocity."""
        state, step, grid = self._before, self.step, self.step.grid
        for p, column, h in zip(state.particles, self._stretch.points.T, (grid.hx, grid.hy), strict=True):
            assign(column / h, p)
        if self._stretch.begun:
            for a, b in zip(self._stretch.begun.fields, state.fields, strict=True):
                copy(a, b)
            return
        fill(0.0, *state.fields)
        for density, rho in zip(step.densities, state.rho, strict=True):
            density.begin(rho)
        pairs = zip(self._setup.velocity, (state.u, state.v), step.velocity_ghosts, strict=True)
        for values, f, ghosts in pairs:
            from_numpy(values, f, step.layout)
            ghosts.fill(f)

    def _do(self, action: Advance | Store | Restore) -> None:
        if isinstance(action, Advance):
            start, end, base = action.start, action.end, self._base(action.start)
            self._put(start, end)
            self._counter.set(base, base + end - start)
            self._forward.launch()
            return
        number = [start for start, _ in self.schedule.segments].index(action.step)
        stored = [table.row(number) for table in self._stored]
        now = self._kept(self._before)
        self._copy(*((now, stored) if isinstance(action, Store) else (stored, now)))

    def _put(self, start: int, end: int) -> None:
        """Put the numbers of some steps, and the state they begin with, on the device."""
        base = self._base(start)
        self._numbers.put(base, self._all_numbers[start:end])
        self._boxes.put(base, self._all_boxes[start:end])
        for step in range(start, end) if self._viscosities else ():
            row = self._viscosities.row(base + step - start)
            from_numpy(self.step.coefficients.at(self.time_of(step + 1)), row, self.step.layout)
        self._copy(self._kept(self._before), [table.row(base) for table in self._states])

    def _copy(self, source: Sequence[wp.array], to: Sequence[wp.array]) -> None:
        for a, b in zip(source, to, strict=True):
            copy(a, b)


def _first_strip() -> bool:
    """Whether the first strip, or the only one, is being captured."""
    strip = STRIP.get()
    return strip is None or strip.index == 0
