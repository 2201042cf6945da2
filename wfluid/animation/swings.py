"""Swings that last stay about their place: the balance of one period acts all the time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from wfluid.animation.balance import Balance, find_balance
from wfluid.animation.drift import Maps
from wfluid.animation.loops import fit_to_loop, moved_state, starting_impulses
from wfluid.animation.simulation import SimulatedFrame, Simulation
from wfluid.animation.snapshot import Snapshot
from wfluid.domain.envelopes import Product
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.timeline import Timeline
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force
from wfluid.step.solver import Solver

LAP_FRAMES = 8
"""Fewest frames of a lap in which a balance is found."""

LASTING = 1.5
"""Periods for which swings last at least, if they are balanced."""

WHOLE = 0.02
"""Largest error of a period that is a whole part of the longest one."""


def swing_period(forces: Sequence[Force], fluid: Fluid, timeline: Timeline) -> float:
    """The common period of forces that only swing, and all the time [s]; 0 if there is none."""
    waves = [_wave(force) for force in forces]
    if not all(waves) or fluid.densities or not isinstance(fluid.viscosity, float):
        return 0.0
    longest = max((wave.period for wave in waves if wave), default=0.0)
    for wave in filter(None, waves):
        parts = longest / wave.period
        late = wave.start >= longest or wave.end < timeline.end
        if late or abs(parts - round(parts)) > WHOLE:
            return 0.0
    return longest if timeline.duration >= LASTING * longest else 0.0


def _wave(force: Force) -> Oscillator | None:
    """The centred oscillator of a force's envelope; None if it has another envelope."""
    factors = force.envelope.factors if isinstance(force.envelope, Product) else (force.envelope,)
    (first, *others) = factors or (None,)
    return first if isinstance(first, Oscillator) and first.centred and not others else None


def balanced_moments(
    solver: Solver, timeline: Timeline, forces: Sequence[Force], points: Sequence, period: float
) -> Iterator[SimulatedFrame]:
    """The fluid at every frame, under swings and the steady acceleration that balances their streaming."""
    periods = math.ceil(LAP_FRAMES / (period * timeline.fps))
    frames = round(periods * period * timeline.fps)
    lap = frames / timeline.fps
    fitted = [fit_to_loop(force, lap) for force in forces]
    struck = starting_impulses(fitted, lap, frames)
    balance = find_balance(Simulation(solver, timeline, points), fitted, frames, struck)
    runner = Simulation(solver, timeline, points)
    moments = _balanced(runner, forces, timeline.frames - 1, balance)
    yield from islice(moments, frames + 1)
    if abs(lap - periods * period) < 1e-6 * lap:
        moments = _returning(runner, moments, frames)
    yield from moments


def _balanced(
    runner: Simulation, forces: Sequence[Force], frames: int, balance: Balance
) -> Iterator[SimulatedFrame]:
    """The fluid at every frame, under the balance."""
    for moment in runner.moments(forces, frames):
        yield moment
        balance.act(runner)


def _returning(
    runner: Simulation, moments: Iterator[SimulatedFrame], frames: int
) -> Iterator[SimulatedFrame]:
    """The frames after the first lap: a reverse flow returns each lap to the map at the end of the first."""
    maps, first, logarithm = Maps(runner.solver), Snapshot.of(runner.now), None
    before = np.stack(first.onto(runner.now).displacement, axis=2)
    guess = first.moved[2:]
    while True:
        runner.untouch()
        lap = [(Snapshot.of(moment.state), moment.solve) for moment in islice(moments, frames)]
        if not lap:
            return
        shown = [np.stack(snapshot.onto(runner.spare).displacement, axis=2) for snapshot, _ in lap]
        if len(lap) == frames:  # the last lap may be cut short
            logarithm = maps.logarithm(shown[-1])
        steady = [np.zeros_like(before), *shown]
        if logarithm:
            steady = maps.without_drift(steady, frames, *logarithm)
        for displacement, (snapshot, solve) in zip(steady[1:], lap, strict=True):
            at = replace(snapshot, moved=(*snapshot.moved[:2], *guess))
            state = moved_state(runner, maps.composed(before, displacement), at)
            guess = Snapshot.of(state).moved[2:]
            yield SimulatedFrame(state, solve)
