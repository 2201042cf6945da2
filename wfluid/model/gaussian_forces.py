"""Forces under a Gaussian: pushes, vortices, growths."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.envelopes import Constant, Envelope, Instantaneous, Slopes, scaled
from wfluid.domain.paths import Center, as_center, place, place_at
from wfluid.domain.piecewise import finite
from wfluid.model.force import (
    GaussianImpulse,
    LocalForce,
    check_acceleration,
    check_radius,
    impulse_slopes,
    shape_slopes,
)
from wfluid.model.painted import Painted

GROWTH_RATE_LIMIT = 100.0
"""Largest prescribed divergence the solver is tested with [1/s]."""

STEP_GROWTH = 0.5
"""Most that a step may grow or shrink: logarithm of the area."""


@dataclass(frozen=True)
class GaussianForce(LocalForce):
    """A push around a point: vector exp(-|x - center|^2 / 2 radius^2) times the envelope.

    A moving center is taken at the middle of a step: second order in the step.

    Raises:
        ValueError: a value that is not finite, a radius that is not positive, or a vector beyond
            1e4 longer sides/s^2.
    """

    center: Center
    """Point (x, y) [longer side]; a `Path` or a function of the time [s] where it moves."""
    vector: tuple[float, float]
    """Acceleration at the center [longer side/s^2]; for `Instantaneous` the velocity gained."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_center("GaussianForce.center", self.center))
        object.__setattr__(self, "vector", place("GaussianForce.vector", self.vector))
        check_acceleration("force", math.hypot(*self.vector))
        check_radius("GaussianForce.radius", self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The vector times the envelope's integral."""
        impulse = self.envelope.integral(start, end)
        push = (self.vector[0] * impulse, self.vector[1] * impulse)
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, push=push)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "vector" (2,), "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar.push) | shape


@dataclass(frozen=True)
class VortexForce(LocalForce):
    """A twirl: spin (-(y - center_y), x - center_x) exp(-|x - center|^2 / 2 radius^2) times the envelope.

    It is free of divergence, so that no pressure takes a part of it: in a free flow the center turns by
    the double integral of spin times envelope. Positive spins turn clockwise on the screen (x towards y).

    Raises:
        ValueError: as `GaussianForce`; the limit holds for spin times radius.
    """

    center: Center
    """Point (x, y) [longer side]; a `Path` or a function of the time [s] where it moves."""
    spin: float
    """Angular acceleration at the center [rad/s^2]; for `Instantaneous` the angular velocity gained."""
    radius: float
    """Sigma of the Gaussian [longer side]; the force is strongest there, spin radius exp(-1/2)."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_center("VortexForce.center", self.center))
        check_radius("VortexForce.radius", self.radius)
        finite("VortexForce.spin", self.spin)
        check_acceleration("vortex", abs(self.spin) * self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """Spin times radius times the envelope's integral."""
        turn = self.spin * self.radius * self.envelope.integral(start, end)
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, turn=turn)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "spin", "radius", center and envelope."""
        slopes = impulse_slopes("spin", self.spin, self.envelope, start, end, self.radius * bar.turn)
        slopes |= shape_slopes(self.center, start, end, bar)
        slopes["radius"] += self.spin / self.radius * slopes["spin"]  # the turn is their product
        return slopes


@dataclass(frozen=True)
class Growth(LocalForce):
    """Grow (rate > 0) or shrink: a prescribed divergence rate (1 - r^2 / 2) exp(-r^2 / 2) times the envelope.

    r is the distance from the center in radii. The ring beyond r = sqrt(2) gives way for what the middle
    takes, their integrals cancel, and the velocity that belongs to it in free space is
    rate / 2 (x - center) exp(-r^2 / 2): the center stays, and areas there grow by exp of the integral of
    rate times envelope. Where walls cut the ring the mean over the picture is taken off. Areas are not
    preserved. A step prescribes the mean over its length, which carries the picture in the next step: the
    whole is exact whatever the step, once a step has passed after its end. What is frozen grows too; give
    a `weight` that spares it.

    Raises:
        ValueError: as `GaussianForce`; a rate beyond 100/s.
    """

    center: Center
    """Point (x, y) [longer side]; a `Path` or a function of the time [s] where it moves."""
    rate: float
    """Divergence at the center [1/s]."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture; the mean of what is left is taken off."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_center("Growth.center", self.center))
        check_radius("Growth.radius", self.radius)
        if not abs(self.rate) <= GROWTH_RATE_LIMIT:
            raise ValueError(f"growth of {self.rate:g}/s: the limit is {GROWTH_RATE_LIMIT:g}/s")
        if isinstance(self.envelope, Instantaneous):
            raise ValueError("a growth takes time: give it a window instead of an instant")

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The rate's mean over the step."""
        length = end - start
        course = self.envelope.integral(start, end) / length if length > 0 else self.envelope.value(start)
        mean = self.rate * course
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, swell=mean)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "rate", "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        if end > start:
            mean = bar.swell / (end - start)
            return impulse_slopes("rate", self.rate, self.envelope, start, end, mean) | shape
        course = scaled(self.envelope.value_slopes(start), self.rate * bar.swell, "envelope.")
        return {"rate": np.array(self.envelope.value(start) * bar.swell)} | course | shape
