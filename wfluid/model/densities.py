"""Densities that the fluid carries and spreads, such as ink and smoke (Bonilla & Velho, section II):

d rho / dt = -(v . grad) rho + kappa Lap rho + S
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from wfluid.domain.checks import check_word
from wfluid.domain.envelopes import Constant, Envelope, Slopes, scaled
from wfluid.domain.limits import INK, LOOKS, VISCOSITY_LIMIT
from wfluid.domain.paths import Center, as_center, place_at
from wfluid.domain.piecewise import finite
from wfluid.model.force import GaussianImpulse, check_radius, impulse_slopes, shape_slopes
from wfluid.model.painted import Painted

SOURCE_RATE_LIMIT = 1e6
"""Most that a source may pour [1/s]."""


@dataclass(frozen=True)
class Source:
    """Pours density around a point: rate exp(-|x - center|^2 / 2 radius^2) times the envelope.

    Raises:
        ValueError: a value that is not finite, or a radius that is not positive.
    """

    center: Center
    """Point (x, y) [longer side]; a `Path` or a function of the time [s] where it moves."""
    rate: float
    """Density gained at the center [1/s]; for `Instantaneous` the density gained. Negative takes away."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_center("Source.center", self.center))
        finite("Source.rate", self.rate)
        if not abs(self.rate) <= SOURCE_RATE_LIMIT:
            raise ValueError(f"Source.rate {self.rate:g}: the limit is {SOURCE_RATE_LIMIT:g}/s")
        check_radius("Source.radius", self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """What it pours from `start` to `end` [s]."""
        amount = self.rate * self.envelope.integral(start, end)
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, amount=amount)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """As `LocalForce.pull_back`, with respect to "rate", "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        return impulse_slopes("rate", self.rate, self.envelope, start, end, bar.amount) | shape


@dataclass(frozen=True, eq=False)
class PaintedSource:
    """Pours density where a picture paints it: the painted values [1/s] times the envelope."""

    paint: Painted
    """Density gained [1/s]; for `Instantaneous` the density gained."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""

    def pull_back(self, start: float, end: float, bar: float) -> Slopes:
        """As of `FieldForce`: with respect to the envelope, from `bar`, the gradient to its integral."""
        return scaled(self.envelope.slopes(start, end), bar, "envelope.")


@dataclass(frozen=True, eq=False)
class Density:
    """Something dissolved in the fluid that moves with it, spreads, and is seen over the picture.

    Raises:
        ValueError: a value outside its range.
    """

    name: str = "ink"
    """What it is called, where a `Buoyancy` or an output speaks of it."""
    diffusion: float = 0.0
    """kappa [longer side^2/s]: what starts as a point has spread to a sigma of sqrt(2 kappa t)."""
    initial: Painted | None = None
    """What is there at the beginning; nothing by default."""
    sources: Sequence[Source | PaintedSource] = ()
    """S: what is poured in."""
    color: tuple[float, float, float] = INK
    """Its colour, red, green, blue, 0 … 1 in linear light."""
    look: str = "ink"
    """"ink" lets through color^rho of the light, "smoke" covers 1 - exp(-rho) of what is behind."""

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a density needs a name")
        if not 0 <= self.diffusion <= VISCOSITY_LIMIT:
            raise ValueError(f"diffusion {self.diffusion}: expected 0 … {VISCOSITY_LIMIT:g}")
        check_word("look", self.look, LOOKS)
        if len(self.color) != 3 or not all(0 <= value <= 1 for value in self.color):
            raise ValueError(f"color {self.color}: expected three numbers 0 … 1")
        object.__setattr__(self, "sources", tuple(self.sources))
