"""Forces with one direction everywhere: wind and buoyancy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.envelopes import Constant, Envelope, Slopes
from wfluid.domain.grid import Grid
from wfluid.domain.paths import place
from wfluid.domain.walls import Walls
from wfluid.model.force import FieldForce, Force, check_acceleration, impulse_slopes, on_faces
from wfluid.model.painted import Painted


@dataclass(frozen=True)
class Wind(FieldForce):
    """The same acceleration everywhere.

    Between closed walls the pressure balances a wind completely and nothing moves. It moves the fluid along a
    periodic axis, or with a non-uniform `weight`.

    Raises:
        ValueError: as `GaussianForce`.
    """

    vector: tuple[float, float]
    """Acceleration x, y [longer side/s^2]; with `Instantaneous`, the velocity gained."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def __post_init__(self) -> None:
        self._settle()
        object.__setattr__(self, "vector", place("Wind.vector", self.vector))
        check_acceleration("wind", math.hypot(*self.vector))

    @property
    def reach(self) -> float:
        """1: the fields are unit directions; `integrals` contain the acceleration."""
        return 1.0

    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """Two fields, the directions of x and y on all faces, so that the vector can be a free parameter."""
        one, none = np.ones((grid.ny, grid.nx)), np.zeros((grid.ny, grid.nx))
        return [on_faces(force, self.weight, grid, walls) for force in ((one, none), (none, one))]

    def integrals(self, start: float, end: float) -> list[float]:
        """The vector times the envelope's integral [longer side/s]."""
        impulse = self.envelope.integral(start, end)
        return [component * impulse for component in self.vector]

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """With respect to "vector" (2,) and envelope."""
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar)


@dataclass(frozen=True)
class Buoyancy(Force):
    """A force proportional to a density: the density times a vector times the envelope, such as rising smoke.

    Raises:
        ValueError: as `GaussianForce`.
    """

    density: str
    """Name of the `Density`."""
    vector: tuple[float, float] = (0.0, -1.0)
    """Acceleration x, y for density 1 [longer side/s^2]; y points down."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""

    def __post_init__(self) -> None:
        self._settle()
        object.__setattr__(self, "vector", place("Buoyancy.vector", self.vector))
        check_acceleration("buoyancy", math.hypot(*self.vector))

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """The gradient with respect to "vector" (2,) and envelope.

        `bar` (2,) is the gradient with respect to the vector times the envelope's integral.
        """
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar)
