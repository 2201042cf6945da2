"""Loops: animations whose last frame is followed by the first.

"oscillate"  All periods are fitted to the loop, and an impulse at the start of each force makes its velocity
             swing about zero. A swinging fluid also streams: a steady force balances that, and a flow takes
             off the drift that is left, evenly over the loop, which begins with the untouched picture.
"pingpong"   Forwards, then backwards.
"crossfade"  The frames after the end are blended into the beginning. Maps are blended, not colours, so that
             nothing appears double.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from wfluid.animation.balance import find_balance, lap_of
from wfluid.animation.drift import Maps
from wfluid.animation.simulation import SimulatedFrame, Simulation
from wfluid.animation.snapshot import Snapshot
from wfluid.domain.checks import check_word
from wfluid.domain.envelopes import Envelope, Instantaneous, Product, product
from wfluid.domain.limits import LOOPS
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Path
from wfluid.domain.piecewise import ease
from wfluid.domain.timeline import Timeline
from wfluid.fields.state import State
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import Growth
from wfluid.model.noise_force import NoiseForce
from wfluid.model.uniform_forces import Buoyancy

FADE = 0.25
"""Fraction of a loop over which its end is blended into its beginning."""


@dataclass
class Seam:
    """How well the last frame of a loop meets the first, over the cells of the grid."""

    position_max: float = 0.0
    """Largest distance between the first frame and what would follow the last [longer side]."""
    position_mean: float = 0.0
    """Mean of that distance [longer side]."""
    velocity_max: float = 0.0
    """Largest difference between the motion from the first frame and that into it [longer side/s]; at the
    far turn of a pingpong, if it is larger there."""
    velocity_mean: float = 0.0
    """Mean of that difference [longer side/s]."""
    drift_max: float = 0.0
    """Largest drift that was taken off an oscillating loop [longer side]."""
    drift_mean: float = 0.0
    """Mean of that drift [longer side]."""


def check_loop(loop: str, forces: Sequence[Force]) -> None:
    """Check a kind of loop against the forces.

    Raises:
        ValueError: an unknown kind, or "oscillate" without an oscillating force; the message gives the
        remedy.
    """
    check_word("loop", loop, LOOPS)
    if loop == "oscillate" and not any(_oscillates(force) for force in forces):
        raise ValueError(
            "loop oscillate: no force oscillates; give one a period, or use pingpong or crossfade"
        )


def fit_to_loop(force: Force, length: float) -> Force:
    """The force with all its periods fitted to a loop of `length` seconds.

    An oscillator acts all the time: its start only shifts its phase.
    """
    force = replace(force, envelope=_fitted(force.envelope, length))
    if isinstance(force, NoiseForce) and force.period is not None:
        force = replace(force, period=fitted_period(force.period, length))
    return force


def fitted_period(period: float, length: float) -> float:
    """The nearest period that divides `length` into an integer number of periods [s]."""
    return length / max(1, round(length / period))


def _fitted(envelope: Envelope, length: float) -> Envelope:
    if isinstance(envelope, Product):
        return product(envelope.gain, *(_fitted(factor, length) for factor in envelope.factors))
    if not isinstance(envelope, Oscillator):
        return envelope
    period = fitted_period(envelope.period, length)
    phase = (envelope.phase - envelope.start / period) % 1.0
    return replace(envelope, period=period, phase=phase, start=0.0, end=math.inf, centred=False)


def _oscillates(force: Force) -> bool:
    factors = force.envelope.factors if isinstance(force.envelope, Product) else (force.envelope,)
    noise = isinstance(force, NoiseForce) and force.period is not None
    return noise or any(isinstance(factor, Oscillator) for factor in factors)


def starting_impulses(forces: Sequence[Force], length: float, steps: int) -> list[Force]:
    """Impulses on the resting fluid that make the velocity due to each force swing about zero.

    With the envelope e and its integral E, the impulse is minus the mean of E over the loop.
    """
    struck: list[Force] = []
    for force in forces:
        if isinstance(force, Growth | Buoyancy | NoiseForce):
            continue
        edges = np.linspace(0.0, length, steps + 1)
        parts = [force.envelope.integral(a, b) for a, b in pairwise(edges)]
        mean = float(np.cumsum([0.0, *parts])[:-1].mean())
        if abs(sum(parts)) <= 1e-6 * sum(map(abs, parts)) and mean:
            struck.append(replace(force, envelope=product(-mean, Instantaneous())))
    return struck


def frames_of(loop: str, frames: int) -> int:
    """The number of frames that a loop shows: an even one for a pingpong."""
    return 2 * max(1, round(frames / 2)) if loop == "pingpong" else max(1, frames)


def acting_time(loop: str | None, timeline: Timeline) -> float:
    """The time in which forces act by default [s]: of a pingpong its way out, at whose end it turns."""
    return (
        frames_of(loop, timeline.frames - 1) / 2 / timeline.fps if loop == "pingpong" else timeline.duration
    )


def loop_frames(
    loop: str, runner: Simulation, forces: Sequence[Force], frames: int, fps: float, seam: Seam
) -> Iterator[SimulatedFrame]:
    """The fluid at every frame of a loop; after the last one the seam's measurements are filled in.

    A frame's state is overwritten when the next is asked for.
    """
    order = {"oscillate": _oscillating, "pingpong": _turning, "crossfade": _fading}[loop]
    kept: dict[int, np.ndarray] = {}
    turns = (0, frames // 2) if loop == "pingpong" else (0,)
    needed = {n % frames if n < 0 else n for turn in turns for n in (turn - 1, turn, turn + 1)} | {frames}
    for n, moment in enumerate(order(runner, forces, frames, seam)):
        if n in needed:
            kept[n] = np.stack(moment.state.displacement)
        if n < frames:
            yield moment
    gap = np.hypot(*(kept[frames] - kept[0]))
    seam.position_max, seam.position_mean = float(gap.max()), float(gap.mean())
    for turn in turns:
        into = kept[turn] - kept[turn - 1] if turn else kept[frames] - kept[frames - 1]
        jump = np.hypot(*(kept[turn + 1] - kept[turn] - into)) * fps
        seam.velocity_max = max(seam.velocity_max, float(jump.max()))
        seam.velocity_mean = max(seam.velocity_mean, float(jump.mean()))


def _oscillating(
    runner: Simulation, forces: Sequence[Force], frames: int, seam: Seam
) -> Iterator[SimulatedFrame]:
    """Laps from the untouched picture, all alike, in a fluid that returns after each."""
    timeline = runner.timeline
    laps = laps_of(forces, timeline.time_of(frames * timeline.steps_per_frame), frames, runner.solver.fluid)
    steps = frames // laps
    struck = starting_impulses(forces, timeline.time_of(frames * timeline.steps_per_frame), frames)
    balance = find_balance(runner, forces, steps, struck)
    lap = [(Snapshot.of(moment.state), moment.solve) for moment in lap_of(runner, forces, steps, balance)]
    maps = [np.stack(snapshot.onto(runner.spare).displacement, axis=2) for snapshot, _ in lap]
    closed = _closed(maps, Maps(runner.solver), seam)
    for n in range(frames + 1):
        at = n % steps if n < frames else steps
        snapshot, solve = lap[at]
        s = max(0.0, 1.0 - (frames - n) / max(1.0, FADE * frames))
        fade = ease(s)  # densities do not swing: their end is blended into their beginning
        poured = Snapshot.sum_of((1 - fade, snapshot), (fade, lap[0][0]))
        yield SimulatedFrame(moved_state(runner, closed[at], replace(snapshot, poured=poured.poured)), solve)


def laps_of(forces: Sequence[Force], length: float, frames: int, fluid: Fluid) -> int:
    """The number of equal laps of a loop of `length` seconds, each of a whole number of frames."""
    periods = [period for force in forces for period in _periods(force)]
    if fluid.densities or not isinstance(fluid.viscosity, float) or not all(periods):
        return 1
    return math.gcd(frames, *(round(length / period) for period in periods))


def _periods(force: Force) -> list[float]:
    """The periods of a force; 0 where something of it is not periodic."""
    factors = force.envelope.factors if isinstance(force.envelope, Product) else (force.envelope,)
    found = [factor.period if isinstance(factor, Oscillator) else 0.0 for factor in factors]
    if any(isinstance(value, Path) for value in vars(force).values()):
        found.append(0.0)
    return [*found, force.period] if isinstance(force, NoiseForce) and force.period else found


def _closed(lap: list[np.ndarray], maps: Maps, seam: Seam) -> list[np.ndarray]:
    """The maps of a lap without its drift, which is the last of them."""
    drift = np.hypot(*np.moveaxis(lap[-1], 2, 0))
    seam.drift_max, seam.drift_mean = float(drift.max()), float(drift.mean())
    return maps.without_drift(lap, len(lap) - 1, *maps.logarithm(lap[-1]))


def moved_state(runner: Simulation, displacement: np.ndarray, snapshot: Snapshot) -> State:
    """The runner's state with a map, the points that it moves, and the densities of a snapshot."""
    sources = runner.solver.rest(runner.points).points
    if len(sources):
        grid, guess = runner.solver.grid, snapshot.onto(runner.now).points
        places = Maps(runner.solver).places(displacement, sources, guess) / (grid.hx, grid.hy)
        snapshot = replace(snapshot, moved=(*snapshot.moved[:2], *places.T))
    state = snapshot.onto(runner.now)
    runner.solver.set_map(state, displacement)
    return state


def _turning(runner: Simulation, forces: Sequence[Force], frames: int, _: Seam) -> Iterator[SimulatedFrame]:
    """Half the frames, then back the same way."""
    kept: list[Snapshot] = []
    for moment in runner.moments(forces, frames // 2):
        kept.append(Snapshot.of(moment.state))
        yield moment
    for snapshot in kept[-2::-1]:
        yield SimulatedFrame(snapshot.onto(runner.now), None)


def _fading(runner: Simulation, forces: Sequence[Force], frames: int, _: Seam) -> Iterator[SimulatedFrame]:
    """From the end of the fade to the end of the loop, then the frames after it, blended into the first."""
    fading = max(1, round(FADE * frames))
    kept: list[Snapshot] = []
    for n, moment in enumerate(runner.moments(forces, frames + fading)):
        if n <= fading:
            kept.append(Snapshot.of(moment.state))
        if fading <= n < frames:
            yield moment
        elif n >= frames:
            weight = ease((n - frames) / fading)
            mixed = Snapshot.sum_of((1 - weight, Snapshot.of(moment.state)), (weight, kept[n - frames]))
            yield SimulatedFrame(mixed.onto(runner.spare), moment.solve)
