"""Objectives to minimise: misfits of particles, of the map, of densities; effort; sums; user-defined ones.

>>> objective = ParticleMisfit([(0.4, 0.5)], [(0.6, 0.5)], time=1.0) + 1e-4 * Effort()
>>> [weight for weight, _ in objective.terms]
[1.0, 0.0001]

An objective here is a description only; `functional` evaluates it. A misfit is half a weighted sum of
squares, so its gradient is the weighted residual.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wfluid.domain.paths import Place, check_no_pixels
from wfluid.domain.showing import short_repr


class Objective:
    """A number computed from a run. Objectives can be added, and multiplied by numbers."""

    def __add__(self, other: Objective) -> Sum:
        return Sum((*terms_of(self), *terms_of(other)))

    def __mul__(self, factor: float) -> Sum:
        return Sum(tuple((factor * weight, term) for weight, term in terms_of(self)))

    __rmul__ = __mul__

    def __neg__(self) -> Sum:
        return -1.0 * self

    def __sub__(self, other: Objective) -> Sum:
        return self + -1.0 * other

    def __truediv__(self, number: float) -> Sum:
        return self * (1 / number)

    def __radd__(self, zero: int) -> Objective:
        return self if zero == 0 else NotImplemented  # for sum()


@dataclass(frozen=True)
class Sum(Objective):
    """A weighted sum of objectives.

    Raises:
        ValueError: a weight that is not finite.
    """

    terms: tuple[tuple[float, Objective], ...]
    """Weight and objective of each term."""

    def __post_init__(self) -> None:
        parts = [(factor * weight, term) for factor, sum_ in self.terms for weight, term in terms_of(sum_)]
        object.__setattr__(self, "terms", tuple(parts))
        for weight, _ in self.terms:
            if not math.isfinite(weight):
                raise ValueError(f"an objective's weight is {weight}: expected a finite number")


def points_of(objective: Objective) -> np.ndarray:
    """Positions at the beginning of an objective's particles [longer side], (n, 2)."""
    return getattr(objective, "points", np.empty((0, 2)))


def times_of(objective: Objective) -> tuple[float, ...]:
    """The times at which an objective reads the state [s]; none for one of all steps."""
    return getattr(objective, "times", ())


def terms_of(objective: Objective) -> tuple[tuple[float, Objective], ...]:
    """The terms of an objective with their weights."""
    return objective.terms if isinstance(objective, Sum) else ((1.0, objective),)


class ParticleObjective(Objective):
    """An objective of particles' positions at some times; computed on the host, in double precision."""

    points: np.ndarray | Sequence[Place]
    """Positions of the particles at the beginning [longer side], (n, 2)."""
    times: Sequence[float]
    """Times at which it reads their positions [s]."""

    @abstractmethod
    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Its term for time t, one of `times`, and the gradient (n, 2), for particles at `places` (n, 2)."""


@dataclass(frozen=True, eq=False)
class ParticleMisfit(ParticleObjective):
    """The distances of particles from their destinations (Bonilla & Velho, section III, phi):

        1/2 sum_n weight_n |x_n(t) - destination_n|^2    [longer side^2]

    Raises:
        ValueError: positions that are not (n, 2) finite numbers; other numbers of points and destinations;
            negative weights.
    """

    points: np.ndarray | Sequence[Place]
    """Where the particles begin [longer side], (n, 2)."""
    destinations: np.ndarray | Sequence[Place]
    """Their target positions [longer side], (n, 2)."""
    time: float
    """Time of the misfit [s]."""
    weights: np.ndarray | float = 1.0
    """Weight of each particle, (n,)."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for name in ("points", "destinations"):
            object.__setattr__(self, name, places_of(name, getattr(self, name)))
        if len(self.points) != len(self.destinations):
            raise ValueError(f"{len(self.points)} points and {len(self.destinations)} destinations")
        weights = np.asarray(self.weights, dtype=np.float64)
        if weights.shape not in ((), (len(self.points),)):
            raise ValueError(f"weights of shape {weights.shape} for {len(self.points)} particles")
        weights = np.broadcast_to(weights, len(self.points)).copy()
        if not (np.all(np.isfinite(weights)) and np.all(weights >= 0)):
            raise ValueError("weights of particles: expected finite numbers from 0 on")
        object.__setattr__(self, "weights", weights)

    @property
    def times(self) -> tuple[float, ...]:  # type: ignore[override]
        """`time` alone."""
        return (self.time,)

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Half the weighted sum of squares, and the weighted residuals."""
        residual = places - np.asarray(self.destinations)
        slope = np.asarray(self.weights)[:, None] * residual
        return 0.5 * float(np.sum(slope * residual)), slope


@dataclass(frozen=True, eq=False)
class ParticleFunction(ParticleObjective):
    """A function of particles' positions.

    Raises:
        ValueError: points that are not (n, 2) finite numbers, or no times.
    """

    points: np.ndarray | Sequence[Place]
    """Where the particles begin [longer side], (n, 2)."""
    function: Callable[[float, np.ndarray], tuple[float, np.ndarray]]
    """Takes the time [s] and the positions (n, 2) [longer side]; returns a value and its gradient (n, 2).
    The objective is the sum over all times."""
    times: Sequence[float]
    """Times at which it is evaluated [s]."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", places_of("points", self.points))
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        if not self.times:
            raise ValueError("a function of particles needs one time or more")

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """The function's value and gradient."""
        value, slope = self.function(t, places)
        slope = np.asarray(slope, dtype=np.float64)
        if slope.shape != places.shape:
            raise ValueError(f"a gradient of shape {slope.shape} for particles of shape {places.shape}")
        return float(value), slope


@dataclass(frozen=True)
class Effort(Objective):
    """The effort of forces: 1/2 the integral of |f|^2 over picture and time [longer side^4/s^3].

    f is the sum of all forces, weights included, averaged over each step: forces that cancel have no effort.
    A growth, which prescribes divergence, does not count.
    """


def places_of(name: str, values: Any) -> np.ndarray:
    """Positions as an array (n, 2).

    Raises:
        ValueError: another shape, a number that is not finite, or places that look like pixels.
    """
    values = np.array(values, dtype=np.float64) if np.size(values) else np.empty((0, 2))  # a copy
    if values.ndim != 2 or values.shape[1] != 2:
        raise ValueError(f"{name} of shape {values.shape}: expected (n, 2)")
    for at in finite_array(name, values, values.shape):
        check_no_pixels(name, (at[0], at[1]))
    return values


def finite_array(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """The values as float64.

    Raises:
        ValueError: another shape, or a number that is not finite.
    """
    values = np.asarray(values, dtype=np.float64)
    if values.shape != shape:
        raise ValueError(f"{name} of shape {values.shape}: expected {shape}")
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{name}: a number is not finite")
    return values
