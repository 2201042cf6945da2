"""A series of steps, which alternates between two states."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from wfluid.domain.timeline import Timeline
from wfluid.fields.state import State
from wfluid.model.force import Force
from wfluid.step.solver import Solver

Advance = Callable[[State, State, int], None]
"""Takes a step: arguments are the state before, the state after (written) and the step's number."""


def march(now: State, spare: State, steps: Iterable[int], advance: Advance) -> Iterator[tuple[State, State]]:
    """Take steps. After each, yields the current state, and the state that the next step overwrites."""
    for step in steps:
        advance(now, spare, step)
        now, spare = spare, now
        yield now, spare


def steps_of(solver: Solver, timeline: Timeline, forces: Sequence[Force]) -> Advance:
    """A function for `march` that takes the steps of a timeline under forces."""

    def advance(state_in: State, state_out: State, step: int) -> None:
        t, until = timeline.time_of(step), timeline.time_of(step + 1)
        solver.step(state_in, state_out, forces, t, timeline.dt, until=until)

    return advance
