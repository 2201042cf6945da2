"""Functions of one variable that are put together from pieces: lines, ramps, cubics; checks of numbers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Number = TypeVar("Number", float, np.ndarray)


def interval(times: Sequence[float], t: float) -> tuple[int, int, float]:
    """Two of some increasing times that t lies between, by number, and the part of the way, 0 … 1.

    Before the first, and from the last on, both are that one.
    """
    after = bisect_right(times, t)
    if after in (0, len(times)):
        end = max(after - 1, 0)
        return end, end, 0.0
    return after - 1, after, (t - times[after - 1]) / (times[after] - times[after - 1])


def lerp_at(times: Sequence[float], values: Sequence[float], t: float) -> float:
    """The value at time t [s] on straight lines between samples; the first before them, the last after."""
    n, m, s = interval(times, t)
    return values[n] + s * (values[m] - values[n])


def hats(times: Sequence[float], t: float) -> np.ndarray:
    """How much each of n samples counts in `lerp_at`, (n,); 1 in sum."""
    n, m, s = interval(times, t)
    weights = np.zeros(len(times))
    weights[m] = s
    weights[n] = 1.0 - s
    return weights


def ease(s: Number) -> Number:
    """3 s^2 - 2 s^3 for s of 0 … 1: from 0 to 1, level at both ends."""
    return s * s * (3.0 - 2.0 * s)


def catmull_rom(t: np.ndarray) -> np.ndarray:
    """Weights (4, …) of four points in a row of a cubic, t past the second, 0 … 1 (E. Catmull, R. Rom, 1974).

    `kernels/step/interpolation.py` has the same.
    """
    s = 1.0 - t
    outer, inner = (lambda t: t * (-0.5 + t * (1.0 - 0.5 * t))), (lambda t: 1.0 + t * t * (-2.5 + 1.5 * t))
    return np.stack([outer(t), inner(t), inner(s), outer(s)])


def finite(name: str, value: float) -> None:
    """Refuse what is no finite number.

    Raises:
        ValueError: with the name and the value.
    """
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: expected a finite number")
