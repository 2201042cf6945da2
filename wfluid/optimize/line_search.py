"""Line search: a step along a direction that meets the strong Wolfe conditions.

phi(a) is the function at step a along the direction, with phi'(0) < 0. The conditions, sufficient decrease
and small slope, are

    phi(a) <= phi(0) + decrease a phi'(0)        |phi'(a)| <= curvature |phi'(0)|

Close to a minimum the values in the first condition differ by rounding only. The approximate conditions
replace it by its equivalent for the slope of a parabola, with values up to a ceiling just above phi(0):

    phi(a) <= ceiling        phi'(a) <= (2 decrease - 1) phi'(0)

The choice of trial steps is from J. J. Moré, D. J. Thuente, Line Search Algorithms with Guaranteed Sufficient
Decrease, ACM Transactions on Mathematical Software 20 (1994), 286-307. The approximate conditions are from
W. W. Hager, H. Zhang, A New Conjugate Gradient Method with Guaranteed Descent, SIAM J. Optim. 16 (2005),
eq. 4.1. An introduction: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., sections 3.1 and 3.5.

A step at which the function is not finite is too long, and the next trial is shorter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

SHORTEST_GROWTH, LONGEST_GROWTH = 1.1, 4.0
"""Least and largest ratio of consecutive advances until the minimum is bracketed."""

CONTRACTION = 0.66
"""A bracket that two trials leave longer than this fraction of its length is halved."""

RETREAT = 0.5
"""Factor on a step that was too long; it is squared for each further one in a row, so that sixteen decades
take six trials."""


@dataclass(frozen=True)
class Sample:
    """The function at one step along the direction."""

    step: float
    """Step a."""
    value: float
    """phi(a)."""
    slope: float
    """phi'(a)."""
    point: Any = None
    """The caller's data for this step."""

    @property
    def is_finite(self) -> bool:
        """Whether the value and the slope are finite."""
        return math.isfinite(self.value) and math.isfinite(self.slope)

    def tilted(self, slope: float) -> Sample:
        """The sample of the function minus a line through 0 of this slope."""
        return Sample(self.step, self.value - slope * self.step, self.slope - slope)


@dataclass(frozen=True)
class Rules:
    """Parameters of the conditions, and limits of the search."""

    decrease: float = 1e-3
    """c1: fraction of the decrease predicted by the first slope that suffices."""
    curvature: float = 0.9
    """c2: fraction of the first slope that counts as flat; above `decrease`, so that such a step exists."""
    width: float = 0.1
    """Relative width of the bracket at which the search ends."""
    evaluations: int = 20
    """Largest number of trials."""


class Ending(Enum):
    """Why a search ended."""

    WOLFE = "strong Wolfe conditions"
    """The step meets the strong Wolfe conditions."""
    APPROXIMATE_WOLFE = "approximate Wolfe conditions"
    """The step meets the approximate conditions."""
    NARROW = "narrow bracket"
    """The bracket is shorter than `Rules.width`."""
    EXHAUSTED = "too many trials"
    """The limit `Rules.evaluations` was reached."""


@dataclass(frozen=True)
class Found:
    """The result of a search."""

    sample: Sample | None
    """A step that meets the conditions; else the lowest one below the start; else None."""
    ending: Ending
    """Why the search ended."""


def search(
    along: Callable[[float], Sample],
    start: Sample,
    ceiling: float | None = None,
    *,
    first: float = 1.0,
    rules: Rules | None = None,
) -> Found:
    """Search from a sample at step 0 with a negative slope; the first trial is the step `first`.

    `along` evaluates the function at a step. `ceiling` is the largest value for the approximate conditions,
    by default the value at the start.
    """
    rules = rules or Rules()
    ceiling = start.value if ceiling is None else ceiling
    interval, step = _Interval(start, rules.decrease * start.slope), first
    for _ in range(rules.evaluations):
        trial = along(step)
        if not trial.is_finite:
            step = interval.retreat(step)
        elif ending := _met(start, trial, ceiling, rules):
            return Found(trial, ending)
        else:
            step = interval.take(trial)
        if interval.is_within(rules.width):
            return Found(interval.lowest, Ending.NARROW)
    return Found(interval.lowest, Ending.EXHAUSTED)


def _met(start: Sample, trial: Sample, ceiling: float, rules: Rules) -> Ending | None:
    """The conditions that a trial meets, if any."""
    if abs(trial.slope) > rules.curvature * -start.slope:
        return None
    if trial.value <= start.value + rules.decrease * trial.step * start.slope:
        return Ending.WOLFE
    is_right = trial.value <= ceiling and trial.slope <= (2 * rules.decrease - 1) * start.slope
    return Ending.APPROXIMATE_WOLFE if is_right else None


class _Interval:
    """The interval of steps that may meet the conditions: between `low` and `high`, or beyond `low`.

    For trials without sufficient decrease, but not above `low`, the tilted function phi(a) - decrease a
    phi'(0) replaces phi: as decrease < curvature, its minimum meets both conditions (Moré and Thuente,
    section 3; their second stage is for curvature below decrease).
    """

    def __init__(self, start: Sample, tilt: float) -> None:
        self.start, self.tilt = start, tilt
        self.low = start
        """The lowest sample so far; the minimum lies in its downhill direction."""
        self.high: Sample | None = None
        """The other end of the bracket; None until the minimum is bracketed."""
        self.wall = math.inf
        """The last step that was too long; without a bracket it is the shortest such step."""
        self.shrink = RETREAT
        """Factor on the next step that is too long."""
        self.widths = (math.inf, math.inf)
        """Lengths of the last two brackets."""

    @property
    def lowest(self) -> Sample | None:
        """The lowest trial, if it is lower than the start."""
        return self.low if self.low.value < self.start.value else None

    def is_within(self, part: float) -> bool:
        """Whether its length is at most this fraction of its larger end."""
        far = self.wall if self.high is None else self.high.step
        return math.isfinite(far) and abs(far - self.low.step) <= part * max(far, self.low.step)

    def retreat(self, step: float) -> float:
        """The trial after a step that was too long."""
        self.wall = step
        step = self.low.step + self.shrink * (step - self.low.step)
        self.shrink **= 2
        return step

    def take(self, trial: Sample) -> float:
        """Shorten the interval by a trial; returns the next step to try."""
        self.shrink = RETREAT
        sufficient = self.start.value + self.tilt * trial.step
        tilt = self.tilt if sufficient < trial.value <= self.low.value else 0.0
        low, new = self.low.tilted(tilt), trial.tilted(tilt)
        high = None if self.high is None else self.high.tilted(tilt)

        advance = trial.step - low.step
        least = trial.step + (SHORTEST_GROWTH * advance if low.step else 0.0)
        most = trial.step + LONGEST_GROWTH * advance
        try:
            step = _next_step(low, high, new, most)
        except ZeroDivisionError:
            step = math.nan

        if new.value > low.value:
            self.high = trial
        else:
            if _turns(low, new):
                self.high = self.low
            self.low = trial
        if self.high is not None:
            return self._inside(step, self.high)
        step = min(max(step, least), most) if math.isfinite(step) else most
        return step if step < self.wall else (self.low.step + self.wall) / 2

    def _inside(self, step: float, high: Sample) -> float:
        """The step if it is inside the bracket and the bracket shrinks fast enough, else the middle."""
        ends = sorted((self.low.step, high.step))
        width = ends[1] - ends[0]
        is_slow = width >= CONTRACTION * self.widths[0]
        self.widths = self.widths[1], width
        return sum(ends) / 2 if is_slow or not ends[0] < step < ends[1] else step


def _next_step(low: Sample, high: Sample | None, new: Sample, most: float) -> float:
    """The minimum by interpolation: the four cases of Moré and Thuente, section 4.

    Raises:
        ZeroDivisionError: the interpolation has no minimum.
    """
    if new.value > low.value:
        cubic, quadratic = _cubic(low, new), _quadratic(low, new)
        is_near = abs(cubic - low.step) < abs(quadratic - low.step)
        return cubic if is_near else (cubic + quadratic) / 2
    cubic, secant = _cubic(new, low), _secant(low, new)
    nearer, further = sorted((cubic, secant), key=lambda step: abs(step - new.step))
    if _turns(low, new):
        return further
    if abs(new.slope) < abs(low.slope):
        is_beyond = (cubic - new.step) * (new.step - low.step) > 0
        if high is None:
            return max(cubic, secant) if is_beyond else most
        limit = new.step + CONTRACTION * (high.step - new.step)
        step = nearer if is_beyond else secant
        return min(step, limit) if new.step > low.step else max(step, limit)
    return most if high is None else _cubic(new, high)


def _turns(a: Sample, b: Sample) -> bool:
    """Whether the slopes of two samples have different signs."""
    return (a.slope > 0) != (b.slope > 0)


def _cubic(a: Sample, b: Sample) -> float:
    """Minimum of the cubic through both values and slopes (Nocedal and Wright, eq. 3.59); nan without one."""
    length = b.step - a.step
    theta = 3 * (a.value - b.value) / length + a.slope + b.slope
    scale = max(abs(theta), abs(a.slope), abs(b.slope))
    square = (theta / scale) ** 2 - (a.slope / scale) * (b.slope / scale)
    if square < 0:
        return math.nan
    gamma = math.copysign(scale * math.sqrt(square), length)
    return a.step + (gamma - a.slope + theta) / (2 * gamma - a.slope + b.slope) * length


def _quadratic(a: Sample, b: Sample) -> float:
    """Minimum of the parabola through both values and the slope at a."""
    length = b.step - a.step
    return a.step + a.slope / ((a.value - b.value) / length + a.slope) / 2 * length


def _secant(a: Sample, b: Sample) -> float:
    """Zero of the linear interpolation of both slopes."""
    return b.step + b.slope / (b.slope - a.slope) * (a.step - b.step)
