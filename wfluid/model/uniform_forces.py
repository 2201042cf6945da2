"""Forces that are the same everywhere: wind and buoyancy."""

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
    """One acceleration everywhere.

    Between closed walls the pressure balances it wholly and nothing moves; along a periodic axis it
    blows, and a `weight` lets it blow anywhere.

    Raises:
        ValueError: as `GaussianForce`.
    """

    vector: tuple[float, float]
    """Acceleration [longer side/s^2]; for `Instantaneous` the velocity gained."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", place("Wind.vector", self.vector))
        check_acceleration("wind", math.hypot(*self.vector))

    @property
    def reach(self) -> float:
        """1: its fields are directions, and how strong it is their integrals say."""
        return 1.0

    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """The directions of x and of y on all faces within the walls; so its vector may vary."""
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
    """A density's push on the fluid: the density times a vector times the envelope; smoke rises.

    Raises:
        ValueError: as `GaussianForce`.
    """

    density: str
    """Name of the `Density` that is read."""
    vector: tuple[float, float] = (0.0, -1.0)
    """Acceleration where the density is 1 [longer side/s^2]; y points down."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", place("Buoyancy.vector", self.vector))
        check_acceleration("buoyancy", math.hypot(*self.vector))

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """With respect to "vector" (2,) and envelope, from `bar` (2,), that to vector times integral."""
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar)
