"""Forces, as frozen descriptions: a shape in space times an envelope in time.

A `LocalForce` is a Gaussian g = exp(-|x - c|^2 / 2 sigma^2) about a center c that may move, or g times a low
power of x - c; `GaussianImpulse` holds its parameters over a step. On a periodic axis the images of a
Gaussian, one period apart, add up. A `FieldForce` is a field over the entire picture, computed once.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wfluid.domain.checks import check_number, listed
from wfluid.domain.envelopes import Constant, Envelope, Slopes, product, scaled
from wfluid.domain.grid import Grid
from wfluid.domain.operators import mean_with_before
from wfluid.domain.paths import Center, Place, center_slopes
from wfluid.domain.piecewise import finite
from wfluid.domain.showing import short_repr
from wfluid.domain.walls import Walls
from wfluid.model.painted import Painted, as_painted

FORCE_LIMIT = 1e4
"""Largest acceleration that the solver is tested with [longer side/s^2]."""

LEAST_RADIUS, MOST_RADIUS = 1e-6, 1e3
"""Smallest and largest radius, limited by single precision [longer side]."""


@dataclass(frozen=True)
class GaussianImpulse:
    """The effect of a local force over one step, with r = (x - center) / radius and g = exp(-r^2 / 2)."""

    center: Place
    """Center at the middle of the step [longer side]."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    push: Place = (0.0, 0.0)
    """Velocity added: push g [longer side/s]."""
    turn: float = 0.0
    """Rotational velocity added: turn (-r_y, r_x) g [longer side/s]."""
    swell: float = 0.0
    """Divergence prescribed at the end of the step: swell (1 - r^2 / 2) g [1/s]."""
    amount: float = 0.0
    """Density added: amount g."""

    @property
    def gained(self) -> float:
        """Upper bound of the velocity added [longer side/s]."""
        return math.hypot(*self.push) + abs(self.turn)


class Force(ABC):
    """A force on the fluid."""

    envelope: Envelope
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def _settle(self) -> None:
        """Check the envelope, and turn a picture given as weight into `Painted`.

        Raises:
            TypeError: an envelope or a weight of another type.
        """
        name = type(self).__name__
        if not isinstance(self.envelope, Envelope):
            raise TypeError(
                f"{name}.envelope: expected an envelope, such as Constant(0, 1) or Oscillator(period=1), "
                f"got {type(self.envelope).__name__}"
            )
        if self.weight is not None:
            object.__setattr__(self, "weight", as_painted(f"{name}.weight", self.weight))

    def under(self, envelope: Envelope) -> Force:
        """The same force, its envelope multiplied by another one."""
        return replace(self, envelope=product(self.envelope, envelope))  # type: ignore[type-var]  # a dataclass


class LocalForce(Force):
    """A force with the shape of a Gaussian."""

    radius: float
    """Sigma of the Gaussian [longer side]."""

    @abstractmethod
    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The effect of the force from `start` to `end` [s]."""

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """The gradient with respect to the force's parameters.

        `bar` is the gradient with respect to the entries of `impulse(start, end)`; the result is the
        transposed derivative of `impulse` times `bar`, in float64, by attribute path: "center" (2,),
        "center.places" (k, 2) for a `Path`, "envelope.period". Parameters that are missing, such as those of
        a function, count as fixed. Empty by default.
        """
        return {}


class FieldForce(Force):
    """A field of accelerations over the picture times an envelope, or a sum of such products."""

    @abstractmethod
    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """Components of each field along x and y [longer side/s^2], two arrays (ny, nx).

        They lie on the first nx x-faces and the first ny y-faces and are 0 on closed walls. If `integrals`
        contain the acceleration, the fields are factors without unit.
        """

    @property
    @abstractmethod
    def reach(self) -> float:
        """Upper bound of the fields, in their unit [longer side/s^2]."""

    def integrals(self, start: float, end: float) -> list[float]:
        """The factor on each field over a step [s]."""
        return [self.envelope.integral(start, end)]

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """The gradient with respect to the force's parameters, as `LocalForce.pull_back`.

        `bar` is the gradient with respect to each of `integrals`. The fields, and parameters that determine
        them, count as fixed. By default the envelope's parameters for a single field, and empty for several.
        """
        return scaled(self.envelope.slopes(start, end), bar[0], "envelope.") if len(bar) == 1 else {}


@dataclass(frozen=True)
class Group:
    """Forces with a common envelope and strength.

    Raises:
        TypeError: a member that is neither a force nor a group.
        ValueError: a strength that is not finite.
    """

    members: Force | Group | Sequence[Force | Group]
    """The forces; a group may contain groups."""
    envelope: Envelope = field(default_factory=Constant)
    """Common factor over time."""
    strength: float = 1.0
    """Common constant factor."""
    name: str = ""
    """Name of the group."""
    forces: tuple[Force, ...] = field(init=False, repr=False)
    """The forces, each with the common envelope and strength applied."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        finite("Group.strength", self.strength)
        common = product(self.strength, self.envelope)
        object.__setattr__(self, "forces", tuple(force.under(common) for force in flatten(self.members)))


FORCES = "forces, such as GaussianForce((0.5, 0.5), (1, 0), 0.06), or a Group of them"
"""What a list of forces holds."""


def flatten(forces: Force | Group | Iterable[Force | Group]) -> tuple[Force, ...]:
    """All forces in order, with each group replaced by its forces.

    One force, or one group, needs no list.

    Raises:
        TypeError: an entry that is neither a force nor a group.
    """
    found: list[Force] = []
    for force in listed("forces", forces, (Force, Group), FORCES):
        found += force.forces if isinstance(force, Group) else (force,)
    return tuple(found)


def impulse_slopes(
    name: str,
    number: float | Place,
    envelope: Envelope,
    start: float,
    end: float,
    bar: float | Sequence[float],
) -> Slopes:
    """The gradient with respect to a parameter and its envelope.

    `bar` is the gradient with respect to the product of the parameter and the envelope's integral.
    """
    own = np.multiply(bar, envelope.integral(start, end), dtype=np.float64)
    return {name: np.array(own)} | scaled(envelope.slopes(start, end), np.dot(number, bar), "envelope.")


def shape_slopes(center: Center, start: float, end: float, bar: GaussianImpulse) -> Slopes:
    """The gradient with respect to "radius" and center, from `bar`, that with respect to an impulse."""
    radius = np.array(bar.radius, dtype=np.float64)
    return {"radius": radius} | center_slopes(center, (start + end) / 2, bar.center)


def on_faces(
    force: Sequence[np.ndarray], weight: Painted | None, grid: Grid, walls: Walls
) -> tuple[np.ndarray, np.ndarray]:
    """The components of a field on faces (ny, nx), times the weight's means on faces, 0 on closed walls."""
    at_centres = None if weight is None else weight.sample(grid)
    closed = (slice(None), 0), (0, slice(None))
    out = []
    for n, (f, periodic) in enumerate(zip(force, walls.periodic, strict=True)):
        f = f.copy() if at_centres is None else f * mean_with_before(at_centres, 1 - n, periodic)
        if not periodic:
            f[closed[n]] = 0.0
        out.append(f)
    return out[0], out[1]


def check_acceleration(what: str, acceleration: float) -> None:
    """Check an acceleration against `FORCE_LIMIT` [longer side/s^2].

    Raises:
        ValueError: it is larger or NaN; the message states the limit.
    """
    if not acceleration <= FORCE_LIMIT:
        raise ValueError(f"{what} of {acceleration:g}: the limit is {FORCE_LIMIT:g} longer sides/s^2")


def check_radius(name: str, value: float) -> None:
    """Check a radius [longer side].

    Raises:
        TypeError: it is no number.
        ValueError: it is outside 1e-6 … 1e3; the message states the range.
    """
    check_number(name, value)
    if not LEAST_RADIUS <= value <= MOST_RADIUS:
        raise ValueError(f"{name} {value}: expected {LEAST_RADIUS:g} … {MOST_RADIUS:g} longer sides")
