"""Taylor's test of a gradient: what it leaves of a small change must shrink with the change's square.

R(h) = |f(m + h d) - f(m) - h <g, d>|        log2 R(h) / R(h / 2) -> 2 for the exact gradient g, else 1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wfluid.control.functional import Functional

STEPS = (1e-5, 1e-4, 1e-3, 1e-2)
"""h, beside what variables are scaled by: the smallest whose remainder is clear of rounding. Interpolation
and limiters have kinks, and the fewer traces cross one on the way, the nearer the rate is to 2."""

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
    """Median over directions; infinite where the objective is linear in these numbers."""

    @property
    def holds(self) -> bool:
        """Whether the gradient is right."""
        return self.rate >= LEAST_RATE


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
    """The rate in one direction, and the remainder as a part of the change."""
    for h in STEPS:
        change = functional.value(m + 2 * h * direction) - value
        left = abs(change - 2 * h * slope)
        half = abs(functional.value(m + h * direction) - value - h * slope)
        part = left / max(abs(change), abs(2 * h * slope), np.finfo(float).tiny)
        if min(left, half) > ROUNDING * abs(value):
            return float(np.log2(left / half)), part
    return np.inf, part
