"""A run that can be gone back through: its states, a tape for each segment of its steps, graphs of both ways.

A segment's steps are recorded once on a `wp.Tape`, one entry a step (`adjoint.StepAdjoint`), and the
launches of both directions captured as a graph each; afterwards graphs are replayed, whatever numbers the
run has, for time, envelopes and forces' numbers are read from device memory. Only a solve that would go
otherwise (more cycles for a stiffer fluid) records anew. With a cap on memory all segments take turns in
the same states (`schedule`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import warp as wp

from wfluid.adjoint import StepAdjoint
from wfluid.control.objectives import Term
from wfluid.control.schedule import Advance, Restore, Schedule, Store, even_segments, least_room
from wfluid.control.variables import Setup
from wfluid.device import Replay, exclusive, load_kernels
from wfluid.impulses import Bar, Impulses
from wfluid.kernels import misfit
from wfluid.kernels.cells import Real
from wfluid.kernels.strips import STRIP
from wfluid.stages import Stages
from wfluid.state import State, field, from_numpy, to_numpy
from wfluid.timeline import Timeline

MEGABYTE = 2**20


@dataclass(frozen=True)
class Reversed:
    """The gradients that going back through a run found."""

    velocity: np.ndarray
    """With respect to the velocity at the beginning, (2, ny, nx)."""
    viscosity: np.ndarray
    """With respect to the viscosity at centres, (ny, nx); 0 unless it was asked for."""
    forces: list[Mapping[int, Bar]]
    """For each step the gradients with respect to what each force does in it."""
    sources: list[list[Mapping[int, Bar]]]
    """The same for the sources of each density."""


class Recording:
    """A run of a timeline's steps from rest or a given velocity, ready to be replayed with other numbers.

    Raises:
        ValueError: a memory cap too small, with the least that works; a viscosity that depends on the time.
    """

    @exclusive
    def __init__(
        self,
        stages: Stages,
        setup: Setup,
        timeline: Timeline,
        points: np.ndarray,
        terms: Mapping[int, Sequence[Term]],
        memory_mb: float | None = None,
        of_viscosity: bool = False,
        effort: float = 0.0,
    ):
        if stages.medium and stages.medium.changes:
            raise ValueError(
                "a viscosity that depends on the time has no gradients: give a number or a painting"
            )
        self.stages, self.timeline, self.device = stages, timeline, stages.device
        self.steps = (timeline.frames - 1) * timeline.steps_per_frame
        self._terms, self._points, self._effort = terms, points, effort
        grid, layout = stages.grid, stages.layout
        self.compile_seconds = load_kernels(self.device)
        self._adjoint = StepAdjoint(stages, of_viscosity, effort * grid.hx * grid.hy / timeline.dt)
        self._adjoint.set_step(timeline.dt)
        self.compile_seconds += self._adjoint.compile_seconds
        self._pressure = None if stages.medium else field(layout, self.device)
        self.schedule = self._planned(memory_mb)
        slots = self.steps if self.schedule.keeps_all else max(e - s for s, e in self.schedule.segments)
        self.states = [self._state() for _ in range(slots + 1)]
        self._bars = [replace(self._state(), q=field(layout, self.device)) for _ in range(2)]
        for slot, state in enumerate(self.states):
            state.take_gradient(self._bars[slot % 2])
        self._stored = (
            {} if self.schedule.keeps_all else {s: self._state() for s, _ in self.schedule.segments}
        )
        first = Impulses(setup.forces, setup.fluid, grid, self.device, gradients=True)
        self._impulses = [first, *(first.another() for _ in range(slots - 1))]
        rows = 2 * grid.ny if effort else 0
        self._efforts = [wp.zeros(rows, dtype=Real, device=self.device) for _ in range(slots)]
        self._pull = [
            tuple(wp.zeros(len(points), dtype=Real, device=self.device) for _ in range(2))
            for _ in range(slots + 1)
        ]
        self._segments: dict[tuple, _Segment] = {}
        self._pool = stages.helpers()
        self._preparation: Replay | None = None
        self._swelled = [False] * self.steps
        self.set(setup)

    schedule: Schedule
    """How its segments are kept and stored."""

    def _state(self) -> State:
        """A state of zeros; where no pressure is kept from step to step, all share one."""
        stages = self.stages
        state = State.at_rest(stages.grid, self.device, len(stages.densities), len(self._points))
        return state if self._pressure is None else replace(state, q=self._pressure)

    def _planned(self, memory_mb: float | None) -> Schedule:
        breaks = [step for step, terms in self._terms.items() if terms]
        if memory_mb is None:
            return even_segments(self.steps, breaks=breaks)
        fields = 4 + len(self.stages.densities) + (self._pressure is None)
        each = (fields * self.stages.layout.size + 2 * len(self._points)) * wp.types.type_size_in_bytes(Real)
        spare = 2  # the gradients
        room = int(memory_mb * MEGABYTE / each) - spare
        try:
            return even_segments(self.steps, room, breaks)
        except ValueError:
            least = math.ceil(100 * (least_room(self.steps, breaks) + spare) * each / MEGABYTE) / 100
            raise ValueError(
                f"memory_mb {memory_mb:g}: {self.steps} steps on {self.stages.grid.nx} x "
                f"{self.stages.grid.ny} cells need at least {least:g}"
            ) from None

    @property
    def memory(self) -> int:
        """Bytes of all states and gradients."""
        arrays = {
            a.ptr: a.capacity
            for state in (*self.states, *self._bars, *self._stored.values())
            for a in state.arrays
        }
        return sum(arrays.values())

    def time_of(self, step: int) -> float:
        """When a step begins [s]."""
        return self.timeline.time_of(step)

    @exclusive
    def set(self, setup: Setup) -> None:
        """Take a setup whose fluid and forces differ from the first in numbers only.

        Raises:
            ValueError: a force beyond the limit.
        """
        self._setup = setup
        stages = self.stages
        stages.take_fluid(setup.fluid)
        self._plan = stages.plan(self.time_of(1), self.timeline.dt, self._prepare)

    def _prepare(self) -> None:
        if self._preparation is None:
            self._preparation = Replay(self.device, self.stages.follow_medium, self._pool)
        self._preparation.launch()

    def forward(self, looked_at: Sequence[int] = ()) -> dict[int, np.ndarray]:
        """Run it; where the particles are [longer side], (n, 2), after each of the steps `looked_at`."""
        self._begin()
        places: dict[int, np.ndarray] = {}
        self._effort_value, self._term_value = 0.0, 0.0
        for action in self.schedule.forward():
            self._do(action)
            if isinstance(action, Advance):
                base = self._base(action.start)
                for step in looked_at:
                    if action.start < step <= action.end:
                        places[step] = self.states[base + step - action.start].points
                for slot in range(base, base + action.end - action.start):
                    self._effort_value += float(self._efforts[slot].numpy().sum(dtype=np.float64))
                self._term_value += sum(term.value() for term in self._terms.get(action.end, ()))
        return places

    @property
    def value(self) -> float:
        """What the last `forward` found of effort and of the terms."""
        grid = self.stages.grid
        return (
            self._effort_value * self._effort * grid.hx * grid.hy / (2 * self.timeline.dt) + self._term_value
        )

    def backward(
        self, pulls: Mapping[int, np.ndarray], watch: Callable[[int, State], None] | None = None
    ) -> Reversed:
        """Go back through the last `forward`.

        `pulls` are gradients (n, 2) with respect to the particles' places [longer side] after some steps.
        With `watch`, which is told each step and the gradient before it, all is done singly, not replayed.
        """
        self._adjoint.mu_bar.zero_()
        forces: list = [{}] * self.steps
        sources: list = [[]] * self.steps
        end_bar: State | None = None
        for action in self.schedule.backward():
            if isinstance(action, Store | Restore | Advance):
                self._do(action)
                continue
            start, end = action.start, action.end
            base = self._base(start)
            bar = self.states[base + end - start].gradient
            if end_bar is None:
                for a in bar.arrays:
                    a.zero_()
            elif end_bar.u is not bar.u:
                _copy(end_bar, bar)
            for slot in range(base, base + end - start + 1):
                self._set_pull(slot, pulls.get(start + slot - base) if slot > base else None)
            told = watch and (lambda step, bar, base=start: watch(base + step, bar))
            self._segment(start, end).reverse(told)
            for slot in range(base, base + end - start):
                forces[start + slot - base] = self._impulses[slot].gradients()
                sources[start + slot - base] = self._impulses[slot].source_gradients()
            end_bar = self.states[base].gradient
        layout = self.stages.layout
        velocity = np.stack([to_numpy(f, layout).astype(np.float64) for f in (end_bar.u, end_bar.v)])
        self._adjoint.fold_viscosity()
        return Reversed(velocity, to_numpy(self._adjoint.mu_bar, layout).astype(np.float64), forces, sources)

    def first_step_not_finite(self) -> int | None:
        """The first step after which the fluid is not finite, run again; None where it stays so."""
        self._begin()
        for action in self.schedule.forward():
            self._do(action)
            if isinstance(action, Advance):
                base = self._base(action.start)
                for slot in range(1, action.end - action.start + 1):
                    arrays = self.states[base + slot].arrays
                    if not all(np.all(np.isfinite(a.numpy())) for a in arrays):
                        return action.start + slot - 1
        return None

    def _base(self, start: int) -> int:
        """The slot of a segment's first state."""
        return start if self.schedule.keeps_all else 0

    @exclusive
    def _begin(self) -> None:
        """The state at the beginning: at rest but for the velocity."""
        state, stages, grid = self.states[0], self.stages, self.stages.grid
        for a in state.arrays:
            a.zero_()
        for density, rho in zip(stages.densities, state.rho, strict=True):
            density.begin(rho)
        for p, column, h in zip((state.p_x, state.p_y), self._points.T, (grid.hx, grid.hy), strict=True):
            p.assign(column / h)
        pairs = zip(self._setup.velocity, (state.u, state.v), stages.velocity_ghosts, strict=True)
        for values, f, ghosts in pairs:
            from_numpy(values, f, stages.layout)
            ghosts.fill(f)

    def _do(self, action: Advance | Store | Restore) -> None:
        if isinstance(action, Advance):
            self._put(action.start, action.end)
            self._segment(action.start, action.end).advance()
        elif isinstance(action, Store):
            last = max((s for s in self._stored if s < action.step), default=None)
            slot = 0 if last is None else action.step - last
            _copy(self.states[slot], self._stored[action.step])
            if slot:
                _copy(self.states[slot], self.states[0])
        else:
            _copy(self._stored[action.step], self.states[0])

    @exclusive
    def _put(self, start: int, end: int) -> None:
        """Put the numbers of some steps on the device."""
        setup, dt, base = self._setup, self.timeline.dt, self._base(start)
        for step in range(start, end):
            impulses = self._impulses[base + step - start]
            kept = self.stages.kept(dt, dt if step else 0.0, step > 0 and self._swelled[step - 1])
            t, until = self.time_of(step), self.time_of(step + 1)
            impulses.set(setup.forces, setup.fluid, t, dt, until, kept, live=True)
            self._swelled[step] = impulses.prescribed > 0

    def _set_pull(self, slot: int, pull: np.ndarray | None) -> None:
        for axis, (array, h) in enumerate(
            zip(self._pull[slot], (self.stages.grid.hx, self.stages.grid.hy), strict=True)
        ):
            if pull is None:
                array.zero_()
            else:
                array.assign(pull[:, axis] * h)

    def _segment(self, start: int, end: int) -> _Segment:
        base = self._base(start)
        terms = tuple(self._terms.get(end, ()))
        key = (base, end - start, *map(id, terms))
        found = self._segments.get(key)
        if found is None or found.plan != self._plan:
            slots = slice(base, base + end - start)
            found = _Segment(
                self.stages,
                self._adjoint,
                self.states[base : base + end - start + 1],
                self._impulses[slots],
                self._pull[base : base + end - start + 1],
                self._efforts[slots],
                terms,
                self._plan,
                self._pool,
            )
            self._segments[key] = found
        return found


class _Segment:
    """Steps on a tape, with the objectives that look at their end; captured when first used."""

    def __init__(self, stages, adjoint, states, impulses, pulls, efforts, terms, plan, pool):
        self.stages, self.adjoint, self.states, self.plan = stages, adjoint, states, plan
        self.impulses, self.pulls, self.efforts, self.terms = impulses, pulls, efforts, terms
        self._tapes: dict[int, wp.Tape] = {}
        self._pool, self._forward, self._backward = pool, None, None

    def advance(self) -> None:
        """Take the steps."""
        if self._forward is None:
            self._forward = Replay(self.stages.device, self._record, self._pool)
        self._forward.launch()

    def reverse(self, watch: Callable[[int, State], None] | None = None) -> None:
        """Go back through them."""
        if watch:
            self._play_back(watch)
            return
        if self._backward is None:
            self._backward = Replay(self.stages.device, self._play_back, self._pool)
        self._backward.launch()

    def _record(self) -> None:
        """Take the steps and put them on a tape; launches only."""
        tape = wp.Tape()
        for state in self.states:
            for a in state.arrays:
                a.mark_init()
        for n, impulses in enumerate(self.impulses):
            before, after = self.states[n : n + 2]
            self.stages.advance(before, after, impulses)
            if wp.config.verify_autograd_array_access:
                _mark(before, after)
            if self.efforts[n].size:
                self._measure_effort(before, impulses, self.efforts[n])
            back = partial(self.adjoint.reverse, before, impulses, after.gradient, before.gradient)
            tape.record_func(back, before.arrays + after.arrays)
            if after.p_x.size:
                tape.record_func(partial(self._add_pull, n + 1), [after.p_x, after.p_y])
        for term in self.terms:
            term.record(tape, self.states[-1])
        self._tapes[_strip()] = tape

    def _play_back(self, watch: Callable[[int, State], None] | None = None) -> None:
        """Play the tape back; launches only, unless it is watched."""
        if watch is None:
            self._tapes[_strip()].backward()
            return
        step = len(self.impulses)
        for back in reversed(self._tapes[0].launches):
            back()
            if back.func == self.adjoint.reverse:
                step -= 1
                watch(step, self.states[step].gradient)

    def _add_pull(self, slot: int) -> None:
        state = self.states[slot]
        for pull, p in zip(self.pulls[slot], (state.p_x, state.p_y), strict=True):
            misfit.add_entries.launch(len(p), self.stages.device, [pull], [p.grad])

    def _measure_effort(self, state: State, impulses: Impulses, rows: wp.array) -> None:
        """Squares of what forces add to the velocity, summed along rows; launches only."""
        stages = self.stages
        pushed, layout = stages.push(state, impulses), stages.layout
        for n, (f, before) in enumerate(zip(pushed, (state.u, state.v), strict=True)):
            inputs = [f, before, layout.nx, layout.pitch, n * layout.ny]
            misfit.row_squares.launch(layout.ny, stages.device, inputs, [rows])


def _strip() -> int:
    """The strip whose launches are being captured."""
    strip = STRIP.get()
    return strip.index if strip else 0


def _mark(read: State, written: State) -> None:
    """Tell Warp what a step reads and writes, for `wp.config.verify_autograd_array_access`."""
    for a in written.arrays:
        a.mark_write(operation="a step", filename=__file__, lineno=0)
    for a in read.arrays:
        a.mark_read()


@exclusive
def _copy(source: State, to: State) -> None:
    for a, b in zip(source.arrays, to.arrays, strict=True):
        if a is not b:
            wp.copy(b, a)
