"""Chebyshev polynomials: the best damping factors for a given number of sweeps or cycles.

G. Golub, C. Van Loan, Matrix Computations, 4th ed., 11.2.8.
"""

from __future__ import annotations

import math

import numpy as np


def chebyshev_factors(low: float, high: float, count: int) -> np.ndarray:
    """Inverse roots of the Chebyshev polynomial of degree `count` on [low, high], largest root first."""
    angles = np.pi * (2 * np.arange(count) + 1) / (2 * count)
    return 1.0 / ((high + low) / 2 + (high - low) / 2 * np.cos(angles))


def chebyshev_count(low: float, high: float, tolerance: float) -> int:
    """The least degree whose Chebyshev polynomial on [low, high] reduces errors by the factor `tolerance`."""
    if high - low < 1e-12 * high:
        return 1
    return max(1, math.ceil(math.acosh(1 / tolerance) / math.acosh((high + low) / (high - low))))


def interval_with_root(at: float, other: float, count: int) -> tuple[float, float]:
    """The interval from `other` past `at` on which the outermost root of the polynomial of degree `count` is
    `at`: the polynomial reduces errors there to 0. `at` may be the lower or the upper end.

    A lower end at or below 0 has no use.
    """
    cos = math.cos(math.pi / (2 * count))
    past = (2 * at - other * (1 - cos)) / (1 + cos)
    return min(past, other), max(past, other)


def count_with_root(at: float, other: float, tolerance: float) -> int:
    """As `chebyshev_count` between the two, for the polynomial that has a root at `at`."""
    count = chebyshev_count(min(at, other), max(at, other), tolerance)
    while True:
        low, high = interval_with_root(at, other, count)
        if low > 0 and chebyshev_count(low, high, tolerance) <= count:
            return count
        count += 1
