"""Taylor's test of a gradient: what it leaves of a small change must shrink with the change's square.

R(h) = |f(m + h d) - f(m) - h <g, d>|        log2 R(h) / R(h / 2) -> 2 for the exact gradient g, else 1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wfluid.gradient.functional import Functional

STEPS = (1e-5, 1e-4, 1e-3)
"""The least h, beside what variables are scaled by: the first whose remainder is clear of rounding."""

LADDER = (1, 4, 16, 64)
"""Multiples of it over which the rate is fitted: where some of them cross a kink of interpolation or limiter,
any two alone are a bad measure."""

LEAST_RATE = 1.9
"""Below it a gradient is wrong."""

NUDGE = 1e-3
"""How far from the start the test is made: there, a picture at rest lies with every trace on a kink."""

ROUNDING = 1e-11
"""Part of the objective above which a remainder is clear of rounding in double precision."""


@dataclass(frozen=True)
class Rate:
    """The test of one slice of the vector of free numbers."""

    name: str
    """Which numbers."""
    size: int
    """How many."""
    gradient: float
    """Euclidean norm of their gradient."""
    remainder: float
    """The largest, as a part of the objective's change."""
    rate: float
    """Median over directions; infinite where the objective is linear in these numbers, nan where it does not
    see them."""

    @property
    def holds(self) -> bool:
        """Whether the gradient is right."""
        return not self.rate < LEAST_RATE


def taylor_rates(functional: Functional, directions: int = 5, seed: int = 0) -> Iterator[Rate]:
    """Test every slice of a functional near its start, each alone, in random directions of largest entry 1.

    Raises:
        FloatingPointError: as `Functional.value_and_gradient`.
    """
    random = np.random.default_rng(seed)
    m = functional.start + NUDGE * random.uniform(-1, 1, functional.start.size)
    value, gradient = functional.value_and_gradient(m)
    for one in functional.variables.slices:
        found = []
        for _ in range(directions):
            direction = np.zeros_like(m)
            drawn = random.standard_normal(one.entries.stop - one.entries.start)
            direction[one.entries] = drawn / np.abs(drawn).max()
            found.append(_rate(functional, m, direction, value, gradient @ direction))
        rates, parts = zip(*found, strict=True)
        size = one.entries.stop - one.entries.start
        norm = float(np.linalg.norm(gradient[one.entries]))
        yield Rate(one.name, size, norm, max(parts), float(np.median(rates)))


def _rate(
    functional: Functional, m: np.ndarray, direction: np.ndarray, value: float, slope: float
) -> tuple[float, float]:
    """The rate in one direction, and the largest remainder as a part of the change."""

    def remainder(h: float) -> tuple[float, float]:
        change = functional.value(m + h * direction) - value
        left = abs(change - h * slope)
        return left, left / max(abs(change), abs(h * slope), np.finfo(float).tiny)

    for least in STEPS:
        left, part = remainder(least)
        if left > ROUNDING * abs(value):
            found = [(left, part), *(remainder(least * times) for times in LADDER[1:])]
            lefts, parts = zip(*found, strict=True)
            return float(np.polyfit(np.log2(LADDER), np.log2(lefts), 1)[0]), max(parts)
    return np.inf if slope else np.nan, part
