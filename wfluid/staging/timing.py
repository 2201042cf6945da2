"""When a drawn force acts, and how strong it must be to carry as far as it is drawn."""

from __future__ import annotations

import math

from wfluid.domain.envelopes import Constant, Envelope, Fade, Instantaneous
from wfluid.domain.limits import LEAST_TIME
from wfluid.domain.oscillator import Oscillator
from wfluid.scene.forces import LOOP_PHASE, PHASE, Blow, Ramps, Wave, Window

PAPER_PHASE = 0.0
"""Part of a period that the paper's oscillators are ahead where nothing says it: they are a sine."""


def envelope_and_scale(
    what: str, timing: Window, duration: float, scheme: str = "standard", loop: str | None = None
) -> tuple[Envelope, float]:
    """The envelope that a table says, and the acceleration (or velocity) that carries a free particle by one.

    By the end of its window; a blow (`at`) by the end of the animation, an oscillator to either side.

    Raises:
        ValueError: keys that contradict, or a window outside the animation.
    """
    _check(what, timing)
    if isinstance(timing, Blow) and timing.at is not None:
        if timing.at >= duration:
            raise ValueError(f"{what} at={timing.at:g}: the animation lasts {duration:g} s")
        return Instantaneous(timing.at), 1.0 / (duration - timing.at)
    start, end = time_window(what, timing, duration)
    envelope, per_length = _steady(timing, start, end, scheme, loop)
    if isinstance(timing, Ramps) and (timing.rise or timing.fall):
        try:
            envelope = envelope * Fade(timing.rise, timing.fall, start, end)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    return envelope, per_length


def time_window(what: str, window: Window, duration: float) -> tuple[float, float]:
    """When a force begins and ends [s].

    Raises:
        ValueError: outside the animation, or too short.
    """
    start, end = window.start, duration if window.end is None else window.end
    if start >= duration:
        raise ValueError(f"{what} start={start:g}: the animation lasts {duration:g} s")
    if window.end is not None and end <= start:
        raise ValueError(f"{what}: end {end:g} is not after start {start:g}")
    if end - start < LEAST_TIME:
        raise ValueError(
            f"{what} from {start:g} to {end:g} s: expected {LEAST_TIME} s or more; at= is a blow"
        )
    return start, end


def phase_of(wave: Wave, loop: str | None) -> float:
    """Part of a period that an oscillation is ahead.

    In an oscillating loop the flow has swung before: -sin is the force of a swing along the arrow first.
    """
    usual = LOOP_PHASE if loop == "oscillate" else PHASE
    return usual if wave.phase is None else wave.phase


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
    if isinstance(timing, Blow) and timing.at is not None and timing.gives(*window):
        raise ValueError(f"{what}: at= is one blow; it goes without period, phase, start, end, rise and fall")
    if isinstance(timing, Wave) and timing.gives("phase") and timing.period is None:
        raise ValueError(f"{what}: phase= needs period=")
