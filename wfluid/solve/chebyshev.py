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
