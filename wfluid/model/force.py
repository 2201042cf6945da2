"""What moves the fluid, as frozen descriptions: a shape in space times an envelope in time.

Most shapes are Gaussians g = exp(-|x - c|^2 / 2 sigma^2) about a center c that may move, or such times a
low power of x - c: `GaussianImpulse` holds the numbers of one over a step. The others are fields over the
whole picture (`Field`), made once.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wfluid.domain.envelopes import Constant, Envelope, Slopes, product, scaled
from wfluid.domain.grid import Grid
from wfluid.domain.operators import mean_with_before
from wfluid.domain.paths import Center, Place, center_slopes
from wfluid.domain.piecewise import finite
from wfluid.domain.walls import Walls
from wfluid.model.painted import Painted

FORCE_LIMIT = 1e4
"""Largest force the solver is tested with [longer side/s^2]."""

LEAST_RADIUS, MOST_RADIUS = 1e-6, 1e3
"""Radii that single precision holds [longer side]."""


@dataclass(frozen=True)
class GaussianImpulse:
    """What a Gaussian of one force does over one step; r = (x - center) / radius, g = exp(-r^2 / 2)."""

    center: Place
    """Where it is [longer side]."""
    radius: float
    """Sigma [longer side]."""
    push: Place = (0.0, 0.0)
    """Velocity gained at the center: push g [longer side/s]."""
    turn: float = 0.0
    """Velocity gained around it: turn (-r_y, r_x) g [longer side/s]."""
    swell: float = 0.0
    """Divergence prescribed at the step's end: swell (1 - r^2 / 2) g [1/s]."""
    amount: float = 0.0
    """Density gained: amount g."""

    @property
    def gained(self) -> float:
        """Bound of the velocity that the step gains [longer side/s]."""
        return math.hypot(*self.push) + abs(self.turn)


class Force(ABC):
    """Anything that moves the fluid."""

    envelope: Envelope
    weight: Painted | None = None

    def under(self, envelope: Envelope) -> Force:
        """The same force with its envelope multiplied by another."""
        return replace(self, envelope=product(self.envelope, envelope))  # type: ignore[type-var]  # a dataclass


class LocalForce(Force):
    """A force whose shape is a Gaussian's."""

    radius: float
    """Sigma of the Gaussian [longer side]."""

    @abstractmethod
    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """What it does from `start` to `end` [s]."""

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """Gradient by the force's numbers, from `bar`, that by the numbers of `impulse(start, end)`.

        The transpose of the derivative of `impulse`, in float64, under attribute paths: "center" (2,),
        or "center.places" (k, 2) of a `Path`; "envelope.period". What is not there, such as the numbers of
        a function, is taken as fixed. Nothing by default.
        """
        return {}


class FieldForce(Force):
    """A force that is a field over the picture times an envelope; or a sum of such."""

    @abstractmethod
    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """Accelerations [longer side/s^2] along x, y on the first nx x-faces and ny y-faces, each (ny, nx).

        On closed walls they are 0. Where `integrals` holds the acceleration they are factors without unit.
        """

    @property
    @abstractmethod
    def reach(self) -> float:
        """Bound of each field, in the fields' unit [longer side/s^2]."""

    def integrals(self, start: float, end: float) -> list[float]:
        """What each field is multiplied by over a step [s]."""
        return [self.envelope.integral(start, end)]

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """The gradient with respect to the force's numbers, from `bar`, that to each of `integrals`.

        As `LocalForce.pull_back`; the fields, with the numbers that made them, are taken as fixed. By
        default those of a lone field's envelope, and nothing of several fields.
        """
        return scaled(self.envelope.slopes(start, end), bar[0], "envelope.") if len(bar) == 1 else {}


@dataclass(frozen=True)
class Group:
    """Forces with a name, an envelope and a strength in common: edited as one.

    Raises:
        TypeError: a member that is neither a force nor a group.
    """

    members: Sequence[Force | Group]
    """The forces; a group may hold groups."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time that all are multiplied by."""
    strength: float = 1.0
    """Factor that all are multiplied by."""
    name: str = ""
    """What it is called."""
    forces: tuple[Force, ...] = field(init=False, repr=False)
    """The forces, each under the common envelope and strength."""

    def __post_init__(self) -> None:
        finite("Group.strength", self.strength)
        common = product(self.strength, self.envelope)
        object.__setattr__(self, "forces", tuple(force.under(common) for force in flatten(self.members)))


def flatten(forces: Sequence[Force | Group]) -> tuple[Force, ...]:
    """The forces themselves, those of groups in their place.

    Raises:
        TypeError: something that is neither a force nor a group.
    """
    found: list[Force] = []
    for force in forces:
        if not isinstance(force, Force | Group):
            raise TypeError(f"expected a force or a Group of forces, got {type(force).__name__}")
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
    """The gradient with respect to a number and its envelope, from `bar`, that to number times integral."""
    own = np.multiply(bar, envelope.integral(start, end), dtype=np.float64)
    return {name: np.array(own)} | scaled(envelope.slopes(start, end), np.dot(number, bar), "envelope.")


def shape_slopes(center: Center, start: float, end: float, bar: GaussianImpulse) -> Slopes:
    """The gradient with respect to radius and center, from that to those of the blob of a step."""
    radius = np.array(bar.radius, dtype=np.float64)
    return {"radius": radius} | center_slopes(center, (start + end) / 2, bar.center)


def on_faces(
    force: Sequence[np.ndarray], weight: Painted | None, grid: Grid, walls: Walls
) -> tuple[np.ndarray, np.ndarray]:
    """A field's components on faces (ny, nx), times the weight's means there, and 0 on closed walls."""
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
    """Refuse an acceleration beyond `FORCE_LIMIT` [longer sides/s^2].

    Raises:
        ValueError: with the limit.
    """
    if not acceleration <= FORCE_LIMIT:
        raise ValueError(f"{what} of {acceleration:g}: the limit is {FORCE_LIMIT:g} longer sides/s^2")


def check_radius(name: str, value: float) -> None:
    """Refuse a radius that is none.

    Raises:
        ValueError: outside 1e-6 … 1e3 longer sides.
    """
    if not LEAST_RADIUS <= value <= MOST_RADIUS:
        raise ValueError(f"{name} {value}: expected {LEAST_RADIUS:g} … {MOST_RADIUS:g} longer sides")
