"""Taylor test of a gradient: the remainder after the linear term must shrink with the step's square.

R(h) = |f(m + h d) - f(m) - h <g, d>|        log2 R(h) / R(h / 2) -> 2 for the exact gradient g, else 1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wfluid.gradient.functional import Functional

STEPS = (1e-5, 1e-4, 1e-3)
"""Candidates for the smallest step h, in the vector's units; the first with a remainder above rounding is
used."""

LADDER = (1, 4, 16, 64)
"""Multiples of the smallest step over which the rate is fitted. Some steps may cross a kink of the
interpolation or a limiter, so two of them would not suffice."""

LEAST_RATE = 1.9
"""Least rate of a correct gradient."""

NUDGE = 1e-3
"""Distance of the test from the start, where the feet of a fluid at rest are on kinks of interpolation."""

ROUNDING = 1e-11
"""Least remainder, relative to the objective, that is above rounding in double precision."""


@dataclass(frozen=True)
class Rate:
    """The result of the test for one slice of the vector of free numbers."""

    name: str
    """Name of the numbers."""
    size: int
    """Number of entries."""
    gradient: float
    """Euclidean norm of their gradient."""
    remainder: float
    """The largest remainder, relative to the objective's change."""
    rate: float
    """Median over directions; infinite if the objective is linear in these numbers, nan if it does not depend
    on them."""

    @property
    def holds(self) -> bool:
        """Whether the gradient passes; true also for nan."""
        return not self.rate < LEAST_RATE


def taylor_rates(functional: Functional, directions: int = 5, seed: int = 0) -> Iterator[Rate]:
    """Test each slice of a functional separately, near its start, in random directions of largest entry 1.

    Raises:
        FloatingPointError: as `Functional.value_and_gradient`.
    """
    random = np.random.default_rng(seed)
    m = functional.start + NUDGE * random.uniform(-1, 1, functional.start.size)
    value, gradient = functional.value_and_gradient(m)
    for part in functional.variables.slices:
        found = []
        for _ in range(directions):
            direction = np.zeros_like(m)
            drawn = random.standard_normal(part.entries.stop - part.entries.start)
            direction[part.entries] = drawn / np.abs(drawn).max()
            found.append(_rate(functional, m, direction, value, float(gradient @ direction)))
        rates, remainders = zip(*found, strict=True)
        size = part.entries.stop - part.entries.start
        norm = float(np.linalg.norm(gradient[part.entries]))
        yield Rate(part.name, size, norm, max(remainders), float(np.median(rates)))


def _rate(
    functional: Functional, m: np.ndarray, direction: np.ndarray, value: float, slope: float
) -> tuple[float, float]:
    """The rate in one direction, and the largest remainder relative to the change."""

    def measured(h: float) -> tuple[float, float]:
        change = functional.value(m + h * direction) - value
        remainder = abs(change - h * slope)
        return remainder, remainder / max(abs(change), abs(h * slope), np.finfo(float).tiny)

    for least in STEPS:
        remainder, relative = measured(least)
        if remainder > ROUNDING * abs(value):
            found = [(remainder, relative), *(measured(least * times) for times in LADDER[1:])]
            remainders, relatives = zip(*found, strict=True)
            return float(np.polyfit(np.log2(LADDER), np.log2(remainders), 1)[0]), max(relatives)
    return np.inf if slope else np.nan, relative
