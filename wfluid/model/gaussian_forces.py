"""Local forces: pushes, vortices and growth, each with the shape of a Gaussian."""

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
"""Largest prescribed divergence that the solver is tested with [1/s]."""

STEP_GROWTH = 0.5
"""Largest change of area by one step: absolute logarithm of the ratio of areas."""


@dataclass(frozen=True)
class GaussianForce(LocalForce):
    """A push around a point: vector exp(-|x - center|^2 / 2 radius^2) times the envelope.

    The paper's force (Bonilla & Velho, section III). A moving center is evaluated at the middle of a step,
    which is of second order in the step.

    Raises:
        ValueError: a value that is not finite, a radius outside 1e-6 … 1e3, or a vector longer than
            1e4 longer sides/s^2.
    """

    center: Center
    """Center x, y [longer side], or a `Path` or a function of the time [s] if it moves."""
    vector: tuple[float, float]
    """Acceleration x, y at the center [longer side/s^2]; with `Instantaneous`, the velocity gained."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def __post_init__(self) -> None:
        self._settle()
        object.__setattr__(self, "center", as_center("GaussianForce.center", self.center))
        object.__setattr__(self, "vector", place("GaussianForce.vector", self.vector))
        check_acceleration("force", math.hypot(*self.vector))
        check_radius("GaussianForce.radius", self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The push: the vector times the envelope's integral."""
        impulse = self.envelope.integral(start, end)
        push = (self.vector[0] * impulse, self.vector[1] * impulse)
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, push=push)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "vector" (2,), "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar.push) | shape


@dataclass(frozen=True)
class VortexForce(LocalForce):
    """A rotation: spin (-(y - center_y), x - center_x) exp(-|x - center|^2 / 2 radius^2) times the envelope.

    The field is free of divergence, so that the pressure does not reduce it: in a free flow the center turns
    by the double time integral of spin times envelope. Positive spins turn clockwise on the screen (from x to
    y).

    Raises:
        ValueError: as `GaussianForce`; the limit applies to spin times radius.
    """

    center: Center
    """Center x, y [longer side], or a `Path` or a function of the time [s] if it moves."""
    spin: float
    """Angular acceleration at the center [rad/s^2]; with `Instantaneous`, the angular velocity gained."""
    radius: float
    """Sigma of the Gaussian [longer side]; at this distance the force is largest, spin radius exp(-1/2)."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def __post_init__(self) -> None:
        self._settle()
        object.__setattr__(self, "center", as_center("VortexForce.center", self.center))
        check_radius("VortexForce.radius", self.radius)
        finite("VortexForce.spin", self.spin)
        check_acceleration("vortex", abs(self.spin) * self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The turn: spin times radius times the envelope's integral."""
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
    """Growth or shrinking: a prescribed divergence rate (1 - r^2 / 2) exp(-r^2 / 2) times the envelope.

    r is the distance from the center in radii. The ring beyond r = sqrt(2) shrinks by as much as the middle
    grows, so that the integral of the divergence is 0. In free space its velocity is
    rate / 2 (x - center) exp(-r^2 / 2): the center stays in place, and areas at the center grow by the factor
    exp(integral of rate times envelope). If walls cut the ring, the mean over the picture is subtracted.

    Each step prescribes the mean of the rate over its length, and the resulting velocity moves the picture in
    the next step. The growth is therefore complete one step after its end, for any length of the steps.
    Frozen places grow too, unless the `weight` excludes them.

    Raises:
        ValueError: as `GaussianForce`; a rate beyond 100/s; an instantaneous envelope.
    """

    center: Center
    """Center x, y [longer side], or a `Path` or a function of the time [s] if it moves."""
    rate: float
    """Divergence at the center [1/s]; negative rates shrink."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture, 1 everywhere by default; the mean of the product is subtracted."""

    def __post_init__(self) -> None:
        self._settle()
        object.__setattr__(self, "center", as_center("Growth.center", self.center))
        check_radius("Growth.radius", self.radius)
        if not abs(self.rate) <= GROWTH_RATE_LIMIT:
            raise ValueError(f"growth of {self.rate:g}/s: the limit is {GROWTH_RATE_LIMIT:g}/s")
        if isinstance(self.envelope, Instantaneous):
            raise ValueError(
                "a growth with an instantaneous envelope: expected a window, such as Constant(start, end)"
            )

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The swell: the mean of the rate over the step."""
        length = end - start
        factor = self.envelope.integral(start, end) / length if length > 0 else self.envelope.value(start)
        mean = self.rate * factor
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, swell=mean)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "rate", "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        if end > start:
            mean = bar.swell / (end - start)
            return impulse_slopes("rate", self.rate, self.envelope, start, end, mean) | shape
        over_time = scaled(self.envelope.value_slopes(start), self.rate * bar.swell, "envelope.")
        return {"rate": np.array(self.envelope.value(start) * bar.swell)} | over_time | shape
