"""Functions of one variable that are put together from pieces, and checks of numbers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np


def hats(times: Sequence[float], t: float) -> np.ndarray:
    """How much each of n samples counts at time t [s] between which lines are straight, (n,); 1 in sum.

    Before the first sample it counts alone, and so does the last after it.
    """
    n = min(max(bisect_right(times, t), 1), len(times) - 1)
    s = min(max((t - times[n - 1]) / (times[n] - times[n - 1]), 0.0), 1.0)
    weights = np.zeros(len(times))
    weights[n - 1 : n + 1] = 1.0 - s, s
    return weights


def finite(name: str, value: float) -> None:
    """Refuse what is no finite number.

    Raises:
        ValueError: with the name and the value.
    """
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: expected a finite number")


def smoothstep(s: float) -> float:
    """3 s^2 - 2 s^3 for s = 0 … 1; 0 before, 1 after."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)
