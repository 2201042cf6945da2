"""Piecewise functions of one variable: linear interpolation, ramps, cubics; and a check of numbers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from wfluid.domain.checks import check_number

Number = TypeVar("Number", float, np.ndarray)


def interval(times: Sequence[float], t: float) -> tuple[int, int, float]:
    """The indices of the two times around t, and the fraction of the interval that has passed, 0 … 1.

    `times` increase. Before the first time, and from the last on, both indices are equal; the fraction is 0.
    """
    after = bisect_right(times, t)
    if after in (0, len(times)):
        end = max(after - 1, 0)
        return end, end, 0.0
    return after - 1, after, (t - times[after - 1]) / (times[after] - times[after - 1])


def lerp_at(times: Sequence[float], values: Sequence[float], t: float) -> float:
    """Linear interpolation of samples at time t [s]; constant before the first and after the last."""
    n, m, s = interval(times, t)
    return values[n] + s * (values[m] - values[n])


def hats(times: Sequence[float], t: float) -> np.ndarray:
    """The weights of n samples in `lerp_at`, (n,); their sum is 1."""
    n, m, s = interval(times, t)
    weights = np.zeros(len(times))
    weights[m] = s
    weights[n] = 1.0 - s
    return weights


def ease(s: Number) -> Number:
    """3 s^2 - 2 s^3 for s in 0 … 1: a ramp from 0 to 1 with zero slope at both ends."""
    return s * s * (3.0 - 2.0 * s)


def catmull_rom(t: np.ndarray) -> np.ndarray:
    """Weights (4, …) of four neighbouring points in Catmull-Rom interpolation, for t in 0 … 1.

    t is the distance from the second point, in units of the spacing (E. Catmull, R. Rom, 1974). The kernels'
    version is in `kernels/step/interpolation.py`.
    """
    s = 1.0 - t
    outer, inner = (lambda t: t * (-0.5 + t * (1.0 - 0.5 * t))), (lambda t: 1.0 + t * t * (-2.5 + 1.5 * t))
    return np.stack([outer(t), inner(t), inner(s), outer(s)])


def finite(name: str, value: float) -> None:
    """Check that a number is finite; `name` is what the message calls it.

    Raises:
        TypeError: it is no number.
        ValueError: it is infinite or NaN.
    """
    check_number(name, value)
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: expected a finite number")
