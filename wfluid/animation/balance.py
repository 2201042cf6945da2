"""A swinging fluid held in its place: a steady force balances the streaming that swings cause.

A velocity that swings about 0 also drives a slow mean flow, which carries the picture away. Where the fluid
should return after a lap, its start velocity v and a steady acceleration g are found lap by lap (a shooting
method): g takes the change of velocity over a lap, v the mean velocity of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.animation.simulation import SimulatedFrame, Simulation
from wfluid.model.force import Force
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import measure_map

LAPS = 10
"""Most laps of the search."""

DRIFT = 0.15
"""Log-strain of a drift over a lap that is small enough."""


@dataclass(frozen=True)
class Balance:
    """What makes a fluid return after a lap: on faces, along x (ny, nx + 1) and along y (ny + 1, nx)."""

    velocity: tuple[np.ndarray, ...]
    """Velocity at the start of the lap [longer side/s]."""
    acceleration: tuple[np.ndarray, ...]
    """Steady acceleration [longer side/s^2]."""

    def act(self, runner: Simulation) -> None:
        """Accelerate the current fluid for the duration of a frame."""
        runner.solver.add_velocity(runner.now, *(g / runner.timeline.fps for g in self.acceleration))


def lap_of(
    runner: Simulation, forces: Sequence[Force], frames: int, balance: Balance
) -> Iterator[SimulatedFrame]:
    """The fluid at each frame of a lap, from the untouched picture; the balance acts once a frame."""
    runner.solver.set_velocity(runner.now, *balance.velocity)
    runner.untouch()
    for moment in runner.moments(forces, frames):
        yield moment
        balance.act(runner)


def find_balance(
    runner: Simulation, forces: Sequence[Force], frames: int, struck: Sequence[Force]
) -> Balance:
    """The balance of a lap of `frames` frames; the forces `struck` set the resting fluid in motion.

    Of all laps it is that with the smallest drift.
    """
    _, mean, end = _mean_and_end(runner, runner.moments(forces, frames, struck), frames)
    balance = Balance(
        tuple(v - m for v, m in zip(end, mean, strict=True)), tuple(np.zeros_like(v) for v in end)
    )
    best, least, length = balance, np.inf, frames / runner.timeline.fps
    for _ in range(LAPS):
        start, mean, end = _mean_and_end(runner, lap_of(runner, forces, frames, balance), frames)
        warp = CoordinateMap.of_state(runner.now, runner.solver.fluid.walls)
        drift = measure_map(runner.now, warp).log_strain
        if drift < least:
            best, least = balance, drift
        if drift < DRIFT:
            break
        pulls = zip(balance.acceleration, start, end, strict=True)
        balance = Balance(
            tuple(v - m for v, m in zip(start, mean, strict=True)),
            tuple(g + (first - last) / length for g, first, last in pulls),
        )
    return best


def _mean_and_end(
    runner: Simulation, moments: Iterator[SimulatedFrame], frames: int
) -> tuple[tuple[np.ndarray, ...], ...]:
    """The velocity at the start of a lap, its mean, and the velocity at the end."""
    first = mean = last = ()
    for n, moment in enumerate(moments):
        last = tuple(v.copy() for v in moment.state.velocity)
        first = first or last
        mean = (
            tuple(m + v / frames for m, v in zip(mean, last, strict=True))
            if n > 1
            else (tuple(v / frames for v in last))
        )
    return first, mean, last
