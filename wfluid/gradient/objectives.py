"""What is to be made small: misfits of particles, of the map, of densities; effort; sums; a user's own.

>>> objective = ParticleMisfit([(0.4, 0.5)], [(0.6, 0.5)], time=1.0) + 1e-4 * Effort()
>>> [weight for weight, _ in objective.terms]
[1.0, 0.0001]

Each is a frozen description; `functional` brings it to the device. Misfits are halves of weighted squares:
their gradients are the weighted misfits themselves.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wfluid.domain.paths import Place


class Objective:
    """A number that a run has. Objectives add and are multiplied by numbers."""

    def __add__(self, other: Objective) -> Sum:
        return Sum((*terms_of(self), *terms_of(other)))

    def __mul__(self, weight: float) -> Sum:
        return Sum(tuple((weight * own, term) for own, term in terms_of(self)))

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
    """Objectives, each times its weight.

    Raises:
        ValueError: a weight that is not finite.
    """

    terms: tuple[tuple[float, Objective], ...]
    """Weight and objective of each."""

    def __post_init__(self) -> None:
        parts = [(weight * own, term) for weight, whole in self.terms for own, term in terms_of(whole)]
        object.__setattr__(self, "terms", tuple(parts))
        for weight, _ in self.terms:
            if not math.isfinite(weight):
                raise ValueError(f"an objective's weight is {weight}: expected a finite number")


def points_of(objective: Objective) -> np.ndarray:
    """Where the particles begin that an objective looks at [longer side], (n, 2)."""
    return getattr(objective, "points", np.empty((0, 2)))


def times_of(objective: Objective) -> tuple[float, ...]:
    """When an objective looks at the run [s]; none for one of the whole run."""
    return getattr(objective, "times", ())


def terms_of(objective: Objective) -> tuple[tuple[float, Objective], ...]:
    """The parts of an objective with their weights."""
    return objective.terms if isinstance(objective, Sum) else ((1.0, objective),)


class ParticleObjective(Objective):
    """An objective of where particles are at some times; computed on the host, in double precision."""

    @abstractmethod
    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Its part of time t, one of `times`, and the gradient (n, 2), for particles at `places` (n, 2)."""


@dataclass(frozen=True, eq=False)
class ParticleMisfit(ParticleObjective):
    """How far particles are from their destinations (Bonilla & Velho, section III, phi):

        1/2 sum_n weight_n |x_n(t) - destination_n|^2    [longer side^2]

    Raises:
        ValueError: places that are not (n, 2) finite numbers, as many as points; negative weights.
    """

    points: np.ndarray | Sequence[Place]
    """Where the particles begin [longer side], (n, 2)."""
    destinations: np.ndarray | Sequence[Place]
    """Where they should be [longer side], (n, 2)."""
    time: float
    """When [s]."""
    weights: np.ndarray | float = 1.0
    """How much each counts, (n,)."""

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
    def times(self) -> tuple[float, ...]:
        """Its one time."""
        return (self.time,)

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Half the weighted sum of squares, and the weighted misfits."""
        misfit = places - self.destinations
        slope = self.weights[:, None] * misfit
        return 0.5 * float(np.sum(slope * misfit)), slope


@dataclass(frozen=True, eq=False)
class ParticleFunction(ParticleObjective):
    """A function of where particles are.

    Raises:
        ValueError: points that are not (n, 2) finite numbers, or no times.
    """

    points: np.ndarray | Sequence[Place]
    """Where the particles begin [longer side], (n, 2)."""
    function: Callable[[float, np.ndarray], tuple[float, np.ndarray]]
    """Of the time [s] and the places (n, 2) [longer side]: a value, and its gradient (n, 2). Its values at
    all times are summed."""
    times: Sequence[float]
    """When it is asked [s]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", places_of("points", self.points))
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        if not self.times:
            raise ValueError("a function of particles needs one time or more")

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """What the function says."""
        value, slope = self.function(t, places)
        slope = np.asarray(slope, dtype=np.float64)
        if slope.shape != places.shape:
            raise ValueError(f"a gradient of shape {slope.shape} for particles of shape {places.shape}")
        return float(value), slope


@dataclass(frozen=True)
class Effort(Objective):
    """What forces cost: 1/2 the integral of |f|^2 over picture and time [longer side^4/s^3].

    f is the mean over a step of all that adds to the velocity, weights included, so that forces which
    cancel cost nothing. A growth, which prescribes divergence, is not counted.
    """


def places_of(name: str, values: Any) -> np.ndarray:
    """Places as (n, 2) finite numbers.

    Raises:
        ValueError: they are not.
    """
    values = np.array(values, dtype=np.float64) if np.size(values) else np.empty((0, 2))  # a copy
    if values.ndim != 2 or values.shape[1] != 2:
        raise ValueError(f"{name} of shape {values.shape}: expected (n, 2)")
    return finite_array(name, values, values.shape)


def finite_array(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """The values as float64.

    Raises:
        ValueError: another shape than expected, or a number that is not finite.
    """
    values = np.asarray(values, dtype=np.float64)
    if values.shape != shape:
        raise ValueError(f"{name} of shape {values.shape}: expected {shape}")
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{name}: a number is not finite")
    return values
