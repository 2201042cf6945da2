"""How far to go along a line: a step that lowers the function enough and flattens its slope enough.

With phi(a) the function a steps along, phi'(0) < 0, the strong Wolfe conditions are

    phi(a) <= phi(0) + decrease a phi'(0)        |phi'(a)| <= curvature |phi'(0)|

Close to a minimum the first compares numbers that differ in rounding alone. In its place will do what it
says of the slope where phi is a parabola, below a ceiling just above phi(0):

    phi(a) <= ceiling        phi'(a) <= (2 decrease - 1) phi'(0)

Steps are found as by J. J. Moré, D. J. Thuente, Line Search Algorithms with Guaranteed Sufficient Decrease,
ACM Transactions on Mathematical Software 20 (1994), 286-307; the second condition is from W. W. Hager,
H. Zhang, A New Conjugate Gradient Method with Guaranteed Descent, SIAM J. Optim. 16 (2005), eq. 4.1.
J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., sections 3.1 and 3.5, tells the same more gently.

Where the function is not finite, the step was too far, and the search goes back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

SHORTEST_GROWTH, LONGEST_GROWTH = 1.1, 4.0
"""How many times the last advance the next one may be, until the minimum is bracketed."""

CONTRACTION = 0.66
"""Part of a bracket's length that at least goes in two trials, or the bracket is halved."""

RETREAT = 0.5
"""Part of a step that is left of it where it was too far; squared each further time running, so
that sixteen decades take six trials."""


@dataclass(frozen=True)
class Sample:
    """The function at one step along the line."""

    step: float
    value: float
    slope: float
    point: Any = None
    """What the caller wants back with it."""

    @property
    def is_finite(self) -> bool:
        """Whether the function could be evaluated there."""
        return math.isfinite(self.value) and math.isfinite(self.slope)

    def tilted(self, slope: float) -> Sample:
        """The same of the function less a line of that slope."""
        return Sample(self.step, self.value - slope * self.step, self.slope - slope)


@dataclass(frozen=True)
class Rules:
    """What a step must do, and how much may be spent on finding it."""

    decrease: float = 1e-3
    """Part of the decrease that the first slope promises which is enough."""
    curvature: float = 0.9
    """Part of the first slope which is flat enough; more than `decrease`, or there may be no such step."""
    width: float = 0.1
    """Part of a step within which it need not be known better: a bracket so short ends the search."""
    evaluations: int = 20
    """Trials at most."""


class Ending(Enum):
    """Why a search ended."""

    WOLFE = "strong Wolfe conditions"
    APPROXIMATE_WOLFE = "approximate Wolfe conditions"
    NARROW = "narrow bracket"
    EXHAUSTED = "too many trials"


@dataclass(frozen=True)
class Found:
    """How a search ended."""

    sample: Sample | None
    """The step taken: one that meets the conditions, else the lowest lower than the start, else none."""
    ending: Ending


def search(
    along: Callable[[float], Sample],
    start: Sample,
    ceiling: float | None = None,
    *,
    first: float = 1.0,
    rules: Rules | None = None,
) -> Found:
    """Search from a sample at step 0 whose slope falls, trying the step `first` first.

    `ceiling` is the highest value that rounding alone may excuse, by default that of the start.
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
    """Which conditions hold at a trial, if any."""
    if abs(trial.slope) > rules.curvature * -start.slope:
        return None
    if trial.value <= start.value + rules.decrease * trial.step * start.slope:
        return Ending.WOLFE
    is_right = trial.value <= ceiling and trial.slope <= (2 * rules.decrease - 1) * start.slope
    return Ending.APPROXIMATE_WOLFE if is_right else None


class _Interval:
    """Where a step must lie that meets the conditions: between `low` and `high`, or beyond `low`.

    Trials that lack decrease but are no higher than `low` are judged by phi(a) - decrease a phi'(0), not phi:
    its minimum meets both conditions, as decrease < curvature (Moré and Thuente, section 3; their second
    stage is for curvature below decrease).
    """

    def __init__(self, start: Sample, tilt: float) -> None:
        self.start, self.tilt = start, tilt
        self.low = start
        """The lowest so far, downhill from which the minimum lies."""
        self.high: Sample | None = None
        """The other end of the bracket, once there is one."""
        self.wall = math.inf
        """The last step that was too far: while there is no bracket, the least."""
        self.left = RETREAT
        self.widths = (math.inf, math.inf)

    @property
    def lowest(self) -> Sample | None:
        """The lowest trial, if it is lower than the start."""
        return self.low if self.low.value < self.start.value else None

    def is_within(self, part: float) -> bool:
        """Whether its length is at most so much of its further end."""
        far = self.wall if self.high is None else self.high.step
        return math.isfinite(far) and abs(far - self.low.step) <= part * max(far, self.low.step)

    def retreat(self, step: float) -> float:
        """The step after one that was too far."""
        self.wall = step
        step = self.low.step + self.left * (step - self.low.step)
        self.left **= 2
        return step

    def take(self, trial: Sample) -> float:
        """Shorten the interval by a trial, and say where to go next."""
        self.left = RETREAT
        enough = self.start.value + self.tilt * trial.step
        tilt = self.tilt if enough < trial.value <= self.low.value else 0.0
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
        """A step within the bracket: the one given unless it is outside or the bracket shrinks too slowly."""
        ends = sorted((self.low.step, high.step))
        width = ends[1] - ends[0]
        is_slow = width >= CONTRACTION * self.widths[0]
        self.widths = self.widths[1], width
        return sum(ends) / 2 if is_slow or not ends[0] < step < ends[1] else step


def _next_step(low: Sample, high: Sample | None, new: Sample, most: float) -> float:
    """Where interpolation puts the minimum: the four cases of Moré and Thuente, section 4.

    Raises:
        ZeroDivisionError: nowhere.
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
    """Whether the function rises at one of them and falls at the other."""
    return (a.slope > 0) != (b.slope > 0)


def _cubic(a: Sample, b: Sample) -> float:
    """Minimum of the cubic through both with their slopes (Nocedal and Wright, eq. 3.59), nan without one."""
    length = b.step - a.step
    theta = 3 * (a.value - b.value) / length + a.slope + b.slope
    scale = max(abs(theta), abs(a.slope), abs(b.slope))
    square = (theta / scale) ** 2 - (a.slope / scale) * (b.slope / scale)
    if square < 0:
        return math.nan
    gamma = math.copysign(scale * math.sqrt(square), length)
    return a.step + (gamma - a.slope + theta) / (2 * gamma - a.slope + b.slope) * length


def _quadratic(a: Sample, b: Sample) -> float:
    """Minimum of the parabola through both with the first's slope."""
    length = b.step - a.step
    return a.step + a.slope / ((a.value - b.value) / length + a.slope) / 2 * length


def _secant(a: Sample, b: Sample) -> float:
    """Where a straight line through both slopes is zero."""
    return b.step + b.slope / (b.slope - a.slope) * (a.step - b.step)
