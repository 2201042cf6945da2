"""Minimise a smooth function of many numbers by limited-memory BFGS.

>>> def value_and_gradient(x):
...     return float(np.sum((x - 3) ** 4)), 4 * (x - 3) ** 3
>>> found = minimise(value_and_gradient, np.zeros(2), Settings(gradient_tolerance=1e-5))
>>> found.x.round(1), found.status.name
(array([3., 3.]), 'CONVERGED')

Each iteration goes along -H g, where H is BFGS's approximation of the inverse Hessian made of the last few
steps s and differences y of the gradient g, as far as `line_search` says (J. Nocedal, S. J. Wright, Numerical
Optimization, 2nd ed., algorithms 7.4 and 7.5). Without memory, at first and after a search that failed, it
goes along -g. Of the function nothing is known but its values and gradients; where they are not finite, or it
raises FloatingPointError, a step was too far.

Settings

    memory              how many pairs s, y are kept; >= 1, 10. More (up to 30) saves evaluations where each
                        is dear, at 5 n multiplications and 2 n numbers a pair.
    gradient_tolerance  CONVERGED where max |g_i| <= this; >= 0, 1e-6. In units of f over units of x: set it
                        by what a change of x is worth to you. Zero: only where g = 0.
    change_tolerance    SMALL_CHANGE after an iteration with f_k - f_(k+1) <= this max(|f_k|, |f_(k+1)|);
                        >= 0 and < 1, 0, which is never. Set 1e-3 or so where the last per mille is not worth
                        its evaluations.
    iterations          at most so many, counted from the very first start; >= 0, 1000.
    evaluations         at most so many, likewise; >= 1, 2000. The number that costs time.
    decrease            c1 of the line search, f(x + a d) <= f(x) + c1 a g.d; > 0 and < 1/2, 1e-3. Leave it.
    curvature           c2, |g(x + a d).d| <= c2 |g.d|; > decrease and < 1, 0.9. Smaller makes searches
                        longer and iterations fewer, which rarely pays.
    noise               part of |f| by which values may be wrong: a step may end so much higher than the
                        lowest where slopes say that it is right; >= 0 and < 1, 1e-10. For functions that
                        compute in single precision 1e-6.
    first_step          |x_1 - x_0| of the first trial, as of any without memory; > 0, 1. Set it to how far x
                        should move, at a guess, where that is not of the order of 1.

Statuses

    CONVERGED     the gradient is as small as asked
    SMALL_CHANGE  an iteration lowered f by no more than change_tolerance
    FLAT          ten iterations lowered neither f nor the gradient: their precision is reached
    NO_PROGRESS   nothing lower was found, not even straight downhill: gradient and values disagree, or
                  their precision is reached
    ITERATIONS    the limit of iterations is reached
    EVALUATIONS   the limit of evaluations is reached, perhaps within a line search
    STOPPED       the callback said so
    NOT_FINITE    f or its gradient is not finite at the start
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from numbers import Integral
from typing import Any

import numpy as np

from wfluid.optimize.line_search import Rules, Sample, search

LEAST_CURVATURE = float(np.finfo(np.float64).eps)
"""A pair is kept if s.y > this |y|^2: else the curvature that it tells of is rounding, or negative."""

PATIENCE = 10
"""Iterations that may pass without a lower value or a smaller gradient than all before."""

Function = Callable[[np.ndarray], tuple]
"""Of x: the value and the gradient there; what it returns beyond is kept as the point's `details`."""


class Status(Enum):
    """Why a minimisation ended; the module says what each means."""

    CONVERGED = "converged"
    SMALL_CHANGE = "small change"
    FLAT = "flat"
    NO_PROGRESS = "no progress"
    ITERATIONS = "iterations"
    EVALUATIONS = "evaluations"
    STOPPED = "stopped"
    NOT_FINITE = "not finite"


@dataclass(frozen=True)
class Settings:
    """What to stop at, and how to go; the module says what each means and when to change it.

    Raises:
        ValueError: a setting is outside its legal range.
    """

    memory: int = 10
    gradient_tolerance: float = 1e-6
    change_tolerance: float = 0.0
    iterations: int = 1000
    evaluations: int = 2000
    decrease: float = 1e-3
    curvature: float = 0.9
    noise: float = 1e-10
    first_step: float = 1.0

    def __post_init__(self) -> None:
        is_count = isinstance(self.memory, Integral)
        legal = {
            "memory": (is_count and self.memory >= 1, "a whole number, at least 1"),
            "gradient_tolerance": (0 <= self.gradient_tolerance < math.inf, "at least 0"),
            "change_tolerance": (0 <= self.change_tolerance < 1, "at least 0, below 1"),
            "iterations": (self.iterations >= 0, "at least 0"),
            "evaluations": (self.evaluations >= 1, "at least 1, that of the start"),
            "decrease": (0 < self.decrease < 0.5, "above 0, below 1/2"),
            "curvature": (self.decrease < self.curvature < 1, "above decrease, below 1"),
            "noise": (0 <= self.noise < 1, "at least 0, below 1"),
            "first_step": (0 < self.first_step < math.inf, "above 0"),
        }
        for name, (is_legal, rule) in legal.items():
            if not is_legal:
                raise ValueError(f"{name} is {getattr(self, name)}, must be {rule}")


@dataclass(frozen=True, eq=False)
class Point:
    """The function at one place. Its arrays cannot be written."""

    x: np.ndarray
    value: float
    gradient: np.ndarray
    details: tuple = ()
    """Whatever else the function returned there."""

    @property
    def is_finite(self) -> bool:
        """Whether the function could be evaluated there."""
        return math.isfinite(self.value) and bool(np.isfinite(self.gradient).all())

    @property
    def steepness(self) -> float:
        """Largest entry of the gradient."""
        return float(np.abs(self.gradient).max())


@dataclass(frozen=True, eq=False)
class _AtPoint:
    """Something that is at a point, with what the function is there."""

    point: Point
    """Where it is: of what came of a minimisation where it converged, else the lowest point evaluated."""

    @property
    def x(self) -> np.ndarray:
        """Where it is."""
        return self.point.x

    @property
    def value(self) -> float:
        """f there."""
        return self.point.value

    @property
    def gradient(self) -> np.ndarray:
        """Its gradient there."""
        return self.point.gradient


@dataclass(frozen=True, eq=False)
class Iterate(_AtPoint):
    """A minimisation between two iterations: all that it needs to go on as if it had never stopped."""

    best: Point
    """The lowest that it has seen, if only in a line search."""
    steps: tuple[np.ndarray, ...]
    """s of the pairs kept, the oldest first."""
    differences: tuple[np.ndarray, ...]
    """y of each."""
    values: tuple[float, ...]
    """f at the start and after each iteration."""
    slopes: tuple[float, ...]
    """Largest entry of the gradient, likewise."""
    evaluations: int
    """So many until here, of the start one."""

    @property
    def iteration(self) -> int:
        """How many are done."""
        return len(self.values) - 1


@dataclass(frozen=True, eq=False)
class Minimum(_AtPoint):
    """What came of a minimisation."""

    status: Status
    """Why it ended."""
    evaluations: int
    """So many in all, those of a line search cut short included."""
    state: Iterate
    """After the last whole iteration: `minimise` goes on from it."""

    @property
    def iterations(self) -> int:
        """How many were done."""
        return self.state.iteration

    @property
    def history(self) -> tuple[float, ...]:
        """f at the start and after each iteration."""
        return self.state.values

    @property
    def message(self) -> str:
        """The result in one line."""
        return (
            f"{self.status.value} after {self.iterations} iterations, {self.evaluations} evaluations: "
            f"value {self.value:.6g}, largest slope {self.point.steepness:.3g}"
        )


def minimise(
    value_and_gradient: Function,
    start: np.ndarray | Iterate,
    settings: Settings | None = None,
    callback: Callable[[Iterate], bool] | None = None,
) -> Minimum:
    """Find a local minimum of a function downhill from a start, or go on from a state.

    `callback` is called after every iteration, and ends the minimisation if it returns True.

    Raises:
        ValueError: the start is no vector of finite numbers, or a gradient has another shape.
    """
    settings = settings or Settings()
    function = _Counted(value_and_gradient, settings.evaluations)
    state = function.resume(start) if isinstance(start, Iterate) else function.begin(_vector(start))
    status = _stop(None, state, settings)
    while status is None:
        try:
            found = _descend(function, state, settings)
        except _Spent:
            status = Status.EVALUATIONS
            break
        if found is None:
            status = Status.NO_PROGRESS
            break
        before, state = state, _advanced(state, *found, function, settings)
        is_unwanted = callback is not None and callback(state)
        status = _stop(before, state, settings) or (Status.STOPPED if is_unwanted else None)
    point = state.point if status is Status.CONVERGED else function.best
    return Minimum(point, status, function.evaluations, state)


@np.errstate(all="ignore")
def descent_direction(
    gradient: np.ndarray, steps: tuple[np.ndarray, ...], differences: tuple[np.ndarray, ...]
) -> np.ndarray:
    """-H g by the two loops of Nocedal and Wright's algorithm 7.4, H_0 = (s.y / y.y) of the last pair."""
    pairs = [(s, y, 1 / (s @ y)) for s, y in zip(steps, differences, strict=True)]
    q, parts = gradient.copy(), []
    for s, y, rho in reversed(pairs):
        parts.append(rho * (s @ q))
        q -= parts[-1] * y
    s, y, rho = pairs[-1]
    q /= rho * (y @ y)
    for (s, y, rho), part in zip(pairs, reversed(parts), strict=True):
        q += (part - rho * (y @ q)) * s
    return -q


@np.errstate(all="ignore")
def _downhill(gradient: np.ndarray, length: float) -> np.ndarray:
    """So far along -g, safe from overflow in its norm."""
    unit = gradient / np.abs(gradient).max()
    return unit * (-length / np.linalg.norm(unit))


def _stop(before: Iterate | None, state: Iterate, settings: Settings) -> Status | None:
    """Whether to end at a state, after an iteration from the one before."""
    if not state.point.is_finite:
        return Status.NOT_FINITE
    if state.point.steepness <= settings.gradient_tolerance:
        return Status.CONVERGED
    if before is not None and (status := _little_gained(before, state, settings)):
        return status
    if state.iteration >= settings.iterations:
        return Status.ITERATIONS
    return Status.EVALUATIONS if state.evaluations >= settings.evaluations else None


def _little_gained(before: Iterate, after: Iterate, settings: Settings) -> Status | None:
    """Whether an iteration gained so little that it should be the last."""
    if not (_is_lower_of_late(after.values) or _is_lower_of_late(after.slopes)):
        return Status.FLAT
    least = settings.change_tolerance * max(abs(before.value), abs(after.value))
    is_small = settings.change_tolerance > 0 and before.value - after.value <= least
    return Status.SMALL_CHANGE if is_small else None


def _is_lower_of_late(history: tuple[float, ...]) -> bool:
    """Whether the last few are lower than all before, or there are only few."""
    return len(history) <= PATIENCE or min(history[-PATIENCE:]) < min(history[:-PATIENCE])


def _descend(function: _Counted, state: Iterate, settings: Settings) -> tuple[Point, bool] | None:
    """The next point, and whether the memory led there; None if there is none, even along -g."""
    if state.steps:
        direction = descent_direction(state.gradient, state.steps, state.differences)
        if point := _along(function, state, direction, settings):
            return point, True
    point = _along(function, state, _downhill(state.gradient, settings.first_step), settings)
    return None if point is None else (point, False)


def _along(function: _Counted, state: Iterate, direction: np.ndarray, settings: Settings) -> Point | None:
    """Where a search along a direction ends, whose first trial is all of it."""

    def sample(step: float) -> Sample:
        point = function(_ahead(state.x, step, direction))
        return Sample(step, point.value, _slope(point, direction), point)

    start = Sample(0.0, state.value, _slope(state.point, direction), state.point)
    if not -math.inf < start.slope < 0:
        return None
    lowest = min(state.values)
    ceiling = lowest + settings.noise * abs(lowest)
    found = search(sample, start, ceiling, rules=Rules(settings.decrease, settings.curvature)).sample
    return None if found is None else found.point


@np.errstate(all="ignore")
def _ahead(x: np.ndarray, step: float, direction: np.ndarray) -> np.ndarray:
    """So far along a direction."""
    return x + step * direction


@np.errstate(all="ignore")
def _slope(point: Point, direction: np.ndarray) -> float:
    """Of the function along a direction."""
    return float(point.gradient @ direction)


@np.errstate(all="ignore")
def _advanced(
    state: Iterate, point: Point, keeps_memory: bool, function: _Counted, settings: Settings
) -> Iterate:
    """The state at the next point, with the pair that leads there if it tells of positive curvature."""
    steps, differences = (state.steps, state.differences) if keeps_memory else ((), ())
    s, y = _frozen(point.x - state.x), _frozen(point.gradient - state.gradient)
    if s @ y > LEAST_CURVATURE * (y @ y):
        steps = (*steps, s)[-settings.memory :]
        differences = (*differences, y)[-settings.memory :]
    values, slopes = (*state.values, point.value), (*state.slopes, point.steepness)
    return Iterate(point, function.best, steps, differences, values, slopes, function.evaluations)


class _Spent(Exception):
    """There are no evaluations left."""


class _Counted:
    """The function, with the number of its evaluations and the lowest of them."""

    def __init__(self, value_and_gradient: Function, limit: int) -> None:
        self.value_and_gradient = value_and_gradient
        self.limit = limit
        self.evaluations = 0

    best: Point
    """The lowest point so far; `begin` or `resume` gives the first."""

    def begin(self, x: np.ndarray) -> Iterate:
        """The state at a start."""
        point = self.best = self._evaluate(x)
        self.evaluations = 1
        return Iterate(point, point, (), (), (point.value,), (point.steepness,), self.evaluations)

    def resume(self, state: Iterate) -> Iterate:
        """The same state, whose evaluations and lowest point are this function's."""
        self.evaluations, self.best = state.evaluations, state.best
        return state

    def __call__(self, x: np.ndarray) -> Point:
        """Evaluate, if there are evaluations left."""
        if self.evaluations >= self.limit:
            raise _Spent
        self.evaluations += 1
        point = self._evaluate(x)
        if point.is_finite and point.value < self.best.value:
            self.best = point
        return point

    def _evaluate(self, x: np.ndarray) -> Point:
        """Evaluate on copies, so that neither side can change what the other holds."""
        try:
            value, gradient, *details = self.value_and_gradient(x.copy())
        except FloatingPointError:
            value, gradient, details = math.nan, np.full(x.shape, math.nan), []
        gradient = np.array(gradient, dtype=np.float64)
        if gradient.shape != x.shape:
            raise ValueError(f"the gradient has shape {gradient.shape}, the start {x.shape}")
        return Point(_frozen(x), float(value), _frozen(gradient), tuple(details))


def _vector(start: Any) -> np.ndarray:
    """A start of one's own, checked."""
    x = np.array(start, dtype=np.float64)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"the start must be a vector of finite numbers, not {start!r:.60}")
    return x


def _frozen(array: np.ndarray) -> np.ndarray:
    """The same array, which from now on cannot be written."""
    array.setflags(write=False)
    return array
