"""Minimisation of a smooth function of many variables by limited-memory BFGS.

>>> def value_and_gradient(x):
...     return float(np.sum((x - 3) ** 4)), 4 * (x - 3) ** 3
>>> found = minimise(value_and_gradient, np.zeros(2), Settings(gradient_tolerance=1e-5))
>>> found.x.round(1), found.status.name
(array([3., 3.]), 'CONVERGED')

Each iteration searches along -H g. H is the BFGS approximation of the inverse Hessian from the last few steps
s and gradient differences y (J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., algorithms 7.4 and
7.5). Without such pairs, at the start and after a failed search, the direction is -g. `line_search` chooses
the length of the step. A step to a point where the function is not finite, or raises FloatingPointError, is
too long. `Settings` documents the parameters, `Status` the outcomes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wfluid.optimize.line_search import Rules, Sample, search
from wfluid.optimize.settings import Settings, Status

LEAST_CURVATURE = float(np.finfo(np.float64).eps)
"""A pair is kept if s.y > LEAST_CURVATURE |y|^2; otherwise its curvature is negative, or only rounding."""

PATIENCE = 10
"""Number of iterations after which a minimisation ends if they lower neither the value nor the gradient."""

Function = Callable[[np.ndarray], tuple]
"""Maps x (n,) to its value and gradient (n,); further results are kept in `Point.details`."""


@dataclass(frozen=True, eq=False)
class Point:
    """One evaluation of the function. Its arrays are read-only."""

    x: np.ndarray
    """Variables, (n,)."""
    value: float
    """f(x)."""
    gradient: np.ndarray
    """Gradient of f at x, (n,)."""
    details: tuple = ()
    """Further results of the function."""

    @property
    def is_finite(self) -> bool:
        """Whether the value and the gradient are finite."""
        return math.isfinite(self.value) and bool(np.isfinite(self.gradient).all())

    @property
    def steepness(self) -> float:
        """Largest absolute entry of the gradient."""
        return float(np.abs(self.gradient).max())


@dataclass(frozen=True, eq=False)
class _AtPoint:
    """Shorthands for the entries of a point."""

    point: Point
    """The current point; of a `Minimum`, the converged point or else the lowest one evaluated."""

    @property
    def x(self) -> np.ndarray:
        """Variables at the point, (n,)."""
        return self.point.x

    @property
    def value(self) -> float:
        """f at the point."""
        return self.point.value

    @property
    def gradient(self) -> np.ndarray:
        """Gradient of f at the point, (n,)."""
        return self.point.gradient


@dataclass(frozen=True, eq=False)
class Iterate(_AtPoint):
    """The state of a minimisation between two iterations; `minimise` resumes from it without a difference."""

    best: Point
    """The lowest point evaluated so far, trials of line searches included."""
    steps: tuple[np.ndarray, ...]
    """Steps s of the pairs in memory, oldest first, each (n,)."""
    differences: tuple[np.ndarray, ...]
    """Gradient differences y of the pairs, each (n,)."""
    values: tuple[float, ...]
    """f at the start and after each iteration."""
    slopes: tuple[float, ...]
    """Largest absolute entry of the gradient at the start and after each iteration."""
    evaluations: int
    """Number of evaluations so far, that of the start included."""

    @property
    def iteration(self) -> int:
        """Number of iterations so far."""
        return len(self.values) - 1


@dataclass(frozen=True, eq=False)
class Minimum(_AtPoint):
    """The result of a minimisation."""

    status: Status
    """Why the minimisation ended."""
    evaluations: int
    """Number of evaluations, those of an interrupted line search included."""
    state: Iterate
    """The state after the last complete iteration, from which `minimise` can resume."""

    @property
    def iterations(self) -> int:
        """Number of complete iterations."""
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
    """Find a local minimum of a function from a start (n,), or resume from a state.

    `callback` is called with the state after every iteration; if it returns True, the minimisation ends.

    Raises:
        ValueError: a start that is not a vector of finite numbers, or a gradient of another shape.
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
    """-H g by the two-loop recursion (Nocedal and Wright, algorithm 7.4); H_0 = s.y / y.y, last pair."""
    pairs = [(s, y, 1 / (s @ y)) for s, y in zip(steps, differences, strict=True)]
    q, alphas = gradient.copy(), []
    for s, y, rho in reversed(pairs):
        alphas.append(rho * (s @ q))
        q -= alphas[-1] * y
    s, y, rho = pairs[-1]
    q /= rho * (y @ y)
    for (s, y, rho), alpha in zip(pairs, reversed(alphas), strict=True):
        q += (alpha - rho * (y @ q)) * s
    return -q


@np.errstate(all="ignore")
def _downhill(gradient: np.ndarray, length: float) -> np.ndarray:
    """A step of a given length along -g; the scaling prevents overflow of the norm."""
    unit = gradient / np.abs(gradient).max()
    return unit * (-length / np.linalg.norm(unit))


def _stop(before: Iterate | None, state: Iterate, settings: Settings) -> Status | None:
    """The status with which the minimisation ends at a state, if it does; `before` is the previous state."""
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
    """The status if an iteration gained too little to continue."""
    if not (_is_lower_of_late(after.values) or _is_lower_of_late(after.slopes)):
        return Status.FLAT
    least = settings.change_tolerance * max(abs(before.value), abs(after.value))
    is_small = settings.change_tolerance > 0 and before.value - after.value <= least
    return Status.SMALL_CHANGE if is_small else None


def _is_lower_of_late(history: tuple[float, ...]) -> bool:
    """Whether one of the last `PATIENCE` entries is below all earlier ones, or there are no earlier ones."""
    return len(history) <= PATIENCE or min(history[-PATIENCE:]) < min(history[:-PATIENCE])


def _descend(function: _Counted, state: Iterate, settings: Settings) -> tuple[Point, bool] | None:
    """The next point, and whether the pairs in memory led to it; None if even -g leads to no lower point."""
    if state.steps:
        direction = descent_direction(state.gradient, state.steps, state.differences)
        if point := _along(function, state, direction, settings):
            return point, True
    point = _along(function, state, _downhill(state.gradient, settings.first_step), settings)
    return None if point is None else (point, False)


def _along(function: _Counted, state: Iterate, direction: np.ndarray, settings: Settings) -> Point | None:
    """The point at which a line search along a direction ends; its first trial is the full step."""

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
    """The point at a step along a direction."""
    return x + step * direction


@np.errstate(all="ignore")
def _slope(point: Point, direction: np.ndarray) -> float:
    """The derivative of the function along a direction."""
    return float(point.gradient @ direction)


@np.errstate(all="ignore")
def _advanced(
    state: Iterate, point: Point, keeps_memory: bool, function: _Counted, settings: Settings
) -> Iterate:
    """The state at the next point; the new pair is kept if its curvature is positive."""
    steps, differences = (state.steps, state.differences) if keeps_memory else ((), ())
    s, y = _frozen(point.x - state.x), _frozen(point.gradient - state.gradient)
    if s @ y > LEAST_CURVATURE * (y @ y):
        steps = (*steps, s)[-settings.memory :]
        differences = (*differences, y)[-settings.memory :]
    values, slopes = (*state.values, point.value), (*state.slopes, point.steepness)
    return Iterate(point, function.best, steps, differences, values, slopes, function.evaluations)


class _Spent(Exception):
    """The limit of evaluations is reached."""


class _Counted:
    """The function, with the number of its evaluations and the lowest point among them."""

    def __init__(self, value_and_gradient: Function, limit: int) -> None:
        self.value_and_gradient = value_and_gradient
        self.limit = limit
        self.evaluations = 0

    best: Point
    """The lowest point so far; `begin` or `resume` sets it first."""

    def begin(self, x: np.ndarray) -> Iterate:
        """The state at a start."""
        point = self.best = self._evaluate(x)
        self.evaluations = 1
        return Iterate(point, point, (), (), (point.value,), (point.steepness,), self.evaluations)

    def resume(self, state: Iterate) -> Iterate:
        """The same state; counting continues from its evaluations and lowest point."""
        self.evaluations, self.best = state.evaluations, state.best
        return state

    def __call__(self, x: np.ndarray) -> Point:
        """Evaluate the function.

        Raises:
            _Spent: the limit of evaluations is reached.
        """
        if self.evaluations >= self.limit:
            raise _Spent
        self.evaluations += 1
        point = self._evaluate(x)
        if point.is_finite and point.value < self.best.value:
            self.best = point
        return point

    def _evaluate(self, x: np.ndarray) -> Point:
        """Evaluate on copies, so that neither the caller nor the function can change the other's arrays."""
        try:
            value, gradient, *details = self.value_and_gradient(x.copy())
        except FloatingPointError:
            value, gradient, details = math.nan, np.full(x.shape, math.nan), []
        gradient = np.array(gradient, dtype=np.float64)
        if gradient.shape != x.shape:
            raise ValueError(f"the gradient has shape {gradient.shape}, the start {x.shape}")
        return Point(_frozen(x), float(value), _frozen(gradient), tuple(details))


def _vector(start: Any) -> np.ndarray:
    """A start given by a user, checked."""
    x = np.array(start, dtype=np.float64)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"the start must be a vector of finite numbers, not {start!r:.60}")
    return x


def _frozen(array: np.ndarray) -> np.ndarray:
    """The same array, made read-only."""
    array.setflags(write=False)
    return array
