"""When a drawn force acts, and how strong it must be to carry as far as it is drawn.

The keys are those of `scene_format.COURSE`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from wfluid.domain.envelopes import Constant, Envelope, Fade, Instantaneous, Oscillator
from wfluid.scene.format import LEAST_TIME


def envelope_and_scale(
    what: str, given: Mapping[str, Any], duration: float, scheme: str = "standard", loop: str | None = None
) -> tuple[Envelope, float]:
    """The envelope that keys say, and the acceleration (or velocity) that carries a free particle by one.

    By the end of its window; a blow (`at`) by the end of the animation, an oscillator to either side.

    Raises:
        ValueError: keys that contradict, or a window outside the animation.
    """
    _check(what, given)
    if "at" in given:
        if given["at"] >= duration:
            raise ValueError(f"{what} at={given['at']:g}: the animation lasts {duration:g} s")
        return Instantaneous(given["at"]), 1.0 / (duration - given["at"])
    start, end = time_window(what, given, duration)
    envelope, per_length = _steady(given, start, end, scheme, loop)
    if given.get("rise") or given.get("fall"):
        try:
            envelope = envelope * Fade(given.get("rise", 0.0), given.get("fall", 0.0), start, end)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    return envelope, per_length


def time_window(what: str, given: Mapping[str, Any], duration: float) -> tuple[float, float]:
    """When a force begins and ends [s].

    Raises:
        ValueError: outside the animation, or too short.
    """
    start, end = given.get("start", 0.0), given.get("end", duration)
    if start >= duration:
        raise ValueError(f"{what} start={start:g}: the animation lasts {duration:g} s")
    if "end" in given and end <= start:
        raise ValueError(f"{what}: end {end:g} is not after start {start:g}")
    if end - start < LEAST_TIME:
        raise ValueError(
            f"{what} from {start:g} to {end:g} s: expected {LEAST_TIME} s or more; at= is a blow"
        )
    return start, end


def _steady(
    given: Mapping[str, Any], start: float, end: float, scheme: str, loop: str | None
) -> tuple[Envelope, float]:
    if "period" not in given:
        return Constant(start, end), 2.0 / (end - start) ** 2
    paper, period = scheme == "paper", given["period"]
    # in an oscillating loop the flow has swung before: -sin is the force of a swing along the arrow first
    phase = given.get("phase", 0.0 if paper else 0.5 if loop == "oscillate" else 0.25)
    centred = not paper and loop != "oscillate" and math.isclose(phase % 0.5, 0.25)
    envelope = Oscillator(period=period, phase=phase, start=start, end=end, centred=centred)
    return envelope, (2 * math.pi / period) ** 2


def _check(what: str, given: Mapping[str, Any]) -> None:
    if "at" in given and given.keys() & {"period", "phase", "start", "end", "rise", "fall"}:
        raise ValueError(f"{what}: at= is one blow; it goes without period, phase, start, end, rise and fall")
    if "phase" in given and "period" not in given:
        raise ValueError(f"{what}: phase= needs period=")
    if given.get("period", 1.0) < LEAST_TIME:
        raise ValueError(f"{what}: period {given['period']:g}: expected {LEAST_TIME} s or more")
    for key in ("start", "at"):
        if given.get(key, 0) < 0:
            raise ValueError(f"{what}: {key} {given[key]:g} is before the animation")
