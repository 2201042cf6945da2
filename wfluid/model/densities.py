"""Densities that the fluid transports and diffuses, such as ink and smoke (Bonilla & Velho, section II):

d rho / dt = -(v . grad) rho + kappa Lap rho + S
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from wfluid.domain.checks import check_word, listed
from wfluid.domain.envelopes import Constant, Envelope, Slopes, scaled
from wfluid.domain.limits import INK, LOOKS, VISCOSITY_LIMIT
from wfluid.domain.paths import Center, as_center, place_at
from wfluid.domain.piecewise import finite
from wfluid.domain.showing import short_repr
from wfluid.model.force import GaussianImpulse, check_radius, impulse_slopes, shape_slopes
from wfluid.model.painted import Painted, as_painted

SOURCE_RATE_LIMIT = 1e6
"""Largest rate of a source [1/s]."""


@dataclass(frozen=True)
class Source:
    """A source of density around a point: rate exp(-|x - center|^2 / 2 radius^2) times the envelope.

    Raises:
        ValueError: a value that is not finite, a rate beyond 1e6/s, or a radius outside 1e-6 … 1e3.
    """

    center: Center
    """Center x, y [longer side], or a `Path` or a function of the time [s] if it moves."""
    rate: float
    """Rate of density at the center [1/s]; with `Instantaneous`, the density added. Negative rates remove."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_center("Source.center", self.center))
        finite("Source.rate", self.rate)
        if not abs(self.rate) <= SOURCE_RATE_LIMIT:
            raise ValueError(f"Source.rate {self.rate:g}: the limit is {SOURCE_RATE_LIMIT:g}/s")
        check_radius("Source.radius", self.radius)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The density added from `start` to `end` [s]."""
        amount = self.rate * self.envelope.integral(start, end)
        return GaussianImpulse(place_at(self.center, (start + end) / 2), self.radius, amount=amount)

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """As `LocalForce.pull_back`: with respect to "rate", "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        return impulse_slopes("rate", self.rate, self.envelope, start, end, bar.amount) | shape


@dataclass(frozen=True, eq=False)
class PaintedSource:
    """A source of density that is painted over the picture: the painted rate times the envelope."""

    paint: Painted
    """Rate of density [1/s]; with `Instantaneous`, the density added."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "paint", as_painted("PaintedSource.paint", self.paint))

    def pull_back(self, start: float, end: float, bar: float) -> Slopes:
        """The gradient with respect to the envelope, from `bar`, that with respect to its integral."""
        return scaled(self.envelope.slopes(start, end), bar, "envelope.")


@dataclass(frozen=True, eq=False)
class Density:
    """A substance that the fluid transports and that is drawn over the picture.

    Raises:
        ValueError: a value outside its range; the message states the range.
    """

    name: str = "ink"
    """Name, by which `Buoyancy` and outputs refer to the density."""
    diffusion: float = 0.0
    """Diffusivity kappa [longer side^2/s]: a point spreads to a Gaussian of sigma sqrt(2 kappa t)."""
    initial: Painted | None = None
    """Density at time 0; 0 by default."""
    sources: Sequence[Source | PaintedSource] = ()
    """Sources S; one needs no list."""
    color: tuple[float, float, float] = INK
    """Colour: red, green, blue, 0 … 1 in linear light."""
    look: str = "ink"
    """"ink" multiplies the picture by color^rho; "smoke" covers it with opacity 1 - exp(-rho)."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a density needs a name")
        if not 0 <= self.diffusion <= VISCOSITY_LIMIT:
            raise ValueError(f"diffusion {self.diffusion}: expected 0 … {VISCOSITY_LIMIT:g}")
        check_word("look", self.look, LOOKS)
        if len(self.color) != 3 or not all(0 <= value <= 1 for value in self.color):
            raise ValueError(f"color {self.color}: expected three numbers 0 … 1")
        if self.initial is not None:
            object.__setattr__(self, "initial", as_painted("Density.initial", self.initial))
        kinds, what = (Source, PaintedSource), "Source or PaintedSource objects"
        object.__setattr__(self, "sources", listed("Density.sources", self.sources, kinds, what))
