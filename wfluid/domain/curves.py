"""When a morph does what: curves of warp and blend, and a mask by which places are ahead of others."""

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
    """How far a morph is, 0 … 1, after a part of its time, 0 … 1; it begins at 0 and ends at 1.

    Raises:
        ValueError: times that are not within 0 … 1 and in order, values outside 0 … 1, or ends elsewhere.
    """

    keys: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))
    """Parts of the time, and values; straight lines between them."""
    eased: bool = False
    """Whether it starts and stops softly between its keys (3 s^2 - 2 s^3)."""

    def __post_init__(self) -> None:
        times = [time for time, _ in self.keys]
        if any(not (math.isfinite(value) and 0 <= value <= 1) for key in self.keys for value in key):
            raise ValueError("a curve's keys: expected times within the morph, and values 0 … 1")
        if any(one >= other for one, other in pairwise(times)):
            raise ValueError("a curve's keys: two have one time")
        if not self.keys or self.keys[0] != (0, 0) or self.keys[-1] != (1, 1):
            raise ValueError("a curve's keys: it begins with 0 and ends with 1")

    def at(self, part: float | np.ndarray) -> np.ndarray:
        """Its value after parts of the time, of their shape."""
        times, values = (np.array(column, dtype=np.float64) for column in zip(*self.keys, strict=True))
        if not self.eased:
            return np.interp(np.asarray(part), times, values)
        numbers = np.arange(len(times))
        at = np.interp(part, times, numbers)  # the key before, and the part of the way to the next
        before = np.floor(at)
        return np.interp(before + ease(at - before), numbers, values)


def curve_of(what: str | Curve | Mapping[float, float], duration: float) -> Curve:
    """A curve by its name, "linear" or "ease"; or with keys: values 0 … 1 by time [s].

    Keys need not name the ends, where it is 0 and 1.

    Raises:
        ValueError: as `Curve`, or no such curve.
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
    """The elapsed part of each place's own time, 0 … 1, after a part of the total time.

    Places where `ahead` is 1 begin at once, those where it is 0 after `delay`, a part of the total time. All
    take equally long; the last end with the total time.
    """
    return np.clip((part - delay * (1 - ahead)) / (1 - delay), 0.0, 1.0)
