"""Timing of a morph: curves of warp and blend, and masks that let some places start before others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wfluid.domain.limits import CURVES, EASE
from wfluid.domain.piecewise import ease


@dataclass(frozen=True)
class Curve:
    """A timing curve: progress, 0 … 1, as a function of the fraction of the duration, 0 … 1.

    Raises:
        ValueError: a time or a value outside 0 … 1, times that do not increase, or a first key other than
            (0, 0) or last key other than (1, 1).
    """

    keys: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))
    """Pairs of time and progress; interpolated linearly."""
    eased: bool = False
    """Whether progress between two keys follows 3 s^2 - 2 s^3, with zero speed at each key."""

    def __post_init__(self) -> None:
        times = [time for time, _ in self.keys]
        if any(not (math.isfinite(value) and 0 <= value <= 1) for key in self.keys for value in key):
            raise ValueError("a curve's keys: expected times within the morph, and values 0 … 1")
        if any(one >= other for one, other in pairwise(times)):
            raise ValueError("a curve's keys: expected times that increase")
        if not self.keys or self.keys[0] != (0, 0) or self.keys[-1] != (1, 1):
            raise ValueError("a curve's keys: expected 0 at the start and 1 at the end")

    def at(self, part: float | np.ndarray) -> np.ndarray:
        """The progress at fractions of the duration, in the shape of `part`."""
        times, values = (np.array(column, dtype=np.float64) for column in zip(*self.keys, strict=True))
        if not self.eased:
            return np.interp(np.asarray(part), times, values)
        numbers = np.arange(len(times))
        position = np.interp(part, times, numbers)  # index of the key before, plus the fraction to the next
        before = np.floor(position)
        return np.interp(before + ease(position - before), numbers, values)


def curve_of(what: str | Curve | Mapping[float, float], duration: float) -> Curve:
    """The curve named "linear" or "ease", or a curve through keys: progress 0 … 1 by time [s].

    Keys at time 0 (progress 0) and `duration` [s] (progress 1) may be omitted.

    Raises:
        ValueError: an unknown name, or keys that `Curve` refuses.
    """
    if isinstance(what, Curve):
        return what
    if isinstance(what, str):
        if what not in CURVES:
            raise ValueError(f"curve {what!r}: expected {', '.join(CURVES)} or keys")
        return Curve(eased=what == EASE)
    keys = {0.0: 0.0, 1.0: 1.0} | {time / duration: value for time, value in what.items()}
    return Curve(tuple(sorted(keys.items())))


def delayed_part(part: float, ahead: np.ndarray, delay: float) -> np.ndarray:
    """The fraction of each place's own duration that has elapsed, 0 … 1, after a fraction of the total.

    Places where `ahead` is 1 start at once; places where it is 0 start after `delay`, a fraction of the total
    duration. Every place takes equally long, and the last ones end with the total duration.
    """
    return np.clip((part - delay * (1 - ahead)) / (1 - delay), 0.0, 1.0)
