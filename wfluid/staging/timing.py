"""Envelopes of drawn forces, and the strength that causes the drawn displacement."""

from __future__ import annotations

import math

from wfluid.domain.envelopes import Constant, Envelope, Fade, Instantaneous
from wfluid.domain.limits import LEAST_TIME
from wfluid.domain.oscillator import Oscillator
from wfluid.scene.forces import LOOP_PHASE, PHASE, Impulse, Ramps, Wave, Window

PAPER_PHASE = 0.0
"""Default phase in the scheme "paper", a part of a period: a sine."""


def envelope_and_scale(
    what: str, timing: Window, duration: float, scheme: str = "standard", loop: str | None = None
) -> tuple[Envelope, float]:
    """The envelope of a force, and the acceleration (or velocity) that displaces a free particle by 1.

    The displacement is that at the end of the window; of an impulse (`at`) at the end of the animation; of an
    oscillator its amplitude. `what` begins the messages.

    Raises:
        ValueError: keys that exclude each other, or a window outside the animation.
    """
    _check(what, timing)
    if isinstance(timing, Impulse) and timing.at is not None:
        if timing.at >= duration:
            raise ValueError(f"{what} at={timing.at:g}: {_lasts(duration, loop)}")
        return Instantaneous(timing.at), 1.0 / (duration - timing.at)
    start, end = time_window(what, timing, duration, loop)
    envelope, per_length = _steady(timing, start, end, scheme, loop)
    if isinstance(timing, Ramps) and (timing.rise or timing.fall):
        try:
            envelope = envelope * Fade(timing.rise, timing.fall, start, end)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    return envelope, per_length


def time_window(what: str, window: Window, duration: float, loop: str | None = None) -> tuple[float, float]:
    """Start and end of a force [s].

    Raises:
        ValueError: a window outside the animation, or too short.
    """
    start, end = window.start, duration if window.end is None else window.end
    if start >= duration:
        raise ValueError(f"{what} start={start:g}: {_lasts(duration, loop)}")
    if window.end is not None and end <= start:
        raise ValueError(f"{what}: end {end:g} is not after start {start:g}")
    if end - start < LEAST_TIME:
        raise ValueError(
            f"{what} from {start:g} to {end:g} s: expected {LEAST_TIME} s or more; for an impulse give at="
        )
    return start, end


def _lasts(duration: float, loop: str | None) -> str:
    what = "the way out of the pingpong" if loop == "pingpong" else "the animation"
    return f"{what} lasts {duration:g} s"


def phase_of(wave: Wave, loop: str | None) -> float:
    """Phase of an oscillation, a part of a period.

    An oscillating loop starts in the middle of its motion: the force -sin displaces along the arrow first.
    """
    default = LOOP_PHASE if loop == "oscillate" else PHASE
    return default if wave.phase is None else wave.phase


def _steady(
    timing: Window, start: float, end: float, scheme: str, loop: str | None
) -> tuple[Envelope, float]:
    if not isinstance(timing, Wave) or timing.period is None:
        return Constant(start, end), 2.0 / (end - start) ** 2
    paper, period = scheme == "paper", timing.period
    phase = PAPER_PHASE if paper and timing.phase is None else phase_of(timing, loop)
    centred = not paper and loop != "oscillate" and math.isclose(phase % 0.5, 0.25)
    envelope = Oscillator(period=period, phase=phase, start=start, end=end, centred=centred)
    return envelope, (2 * math.pi / period) ** 2


def _check(what: str, timing: Window) -> None:
    window = ("period", "phase", "start", "end", "rise", "fall")
    if isinstance(timing, Impulse) and timing.at is not None and timing.gives(*window):
        raise ValueError(f"{what}: at= is an impulse: leave out period, phase, start, end, rise and fall")
    if isinstance(timing, Wave) and timing.gives("phase") and timing.period is None:
        raise ValueError(f"{what}: phase= needs period=")
