"""Loops: animations whose last frame is followed by the first.

"oscillate"  All periods are fitted to the loop, so that the flow is periodic. An impulse at the start of
             each force makes its velocity swing about zero; one lap is run for the flow to become periodic,
             and the loop begins with the untouched picture. A swinging fluid also streams slowly: that
             drift is subtracted evenly over the loop, and the jump of velocity at the seam near the seam.
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

from wfluid.animation.simulation import SimulatedFrame, Simulation
from wfluid.animation.snapshot import Snapshot
from wfluid.domain.checks import check_word
from wfluid.domain.envelopes import Envelope, Instantaneous, Product, product
from wfluid.domain.limits import LOOPS
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.piecewise import ease
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import Growth
from wfluid.model.noise_force import NoiseForce
from wfluid.model.uniform_forces import Buoyancy

FADE = 0.25
"""Fraction of a loop over which its end is blended into its beginning, or velocities are matched."""


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
    """Largest drift that was subtracted from an oscillating loop [longer side]."""
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
    """One lap for the flow to become periodic, then one from the untouched picture, bent to close."""
    struck = starting_impulses(
        forces, runner.timeline.time_of(frames * runner.timeline.steps_per_frame), frames
    )
    for _ in runner.moments(forces, frames, struck):
        pass
    runner.untouch()
    lap = [(Snapshot.of(moment.state), moment.solve) for moment in runner.moments(forces, frames + 1)]
    first, second, last, after = (lap[n][0] for n in (0, 1, frames, frames + 1))
    drift = np.hypot(*last.onto(runner.spare).displacement)
    seam.drift_max, seam.drift_mean = float(drift.max()), float(drift.mean())
    for n, (snapshot, solve) in enumerate(lap[: frames + 1]):
        # less n / N (last - first), and less the bend times (after - last) - (second - first)
        part, bend = n / frames, _bend(n, frames)
        weights = (1.0, part - bend, bend, bend - part, -bend)
        terms = zip(weights, (snapshot, first, second, last, after), strict=True)
        closed = Snapshot.sum_of(*terms)
        s = max(0.0, 1.0 - (frames - n) / max(1.0, FADE * frames))
        fade = ease(s)  # densities do not swing: their end is blended into their beginning
        poured = Snapshot.sum_of((1 - fade, snapshot), (fade, first))
        yield SimulatedFrame(Snapshot(closed.moved, poured.poured).onto(runner.now), solve)


def _bend(n: int, frames: int) -> float:
    """A displacement that adds a velocity of 1/2 a frame at a loop's end and -1/2 at its beginning.

    It is 0 there, and from `FADE` of the loop away.
    """
    reach = max(1.0, FADE * frames)
    s = max(0.0, 1.0 - min(n, frames - n) / reach)
    return reach / 2 * (s**3 - s**2)


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
