"""What moves the fluid, as frozen descriptions: a shape in space times an envelope in time.

Most shapes are Gaussians g = exp(-|x - c|^2 / 2 sigma^2) about a center c that may move, or such times a
low power of x - c: `Blob` holds the numbers of one over a step. The others are fields over the whole
picture (`Field`), made once.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wfluid.envelopes import Constant, Envelope, Instantaneous, Slopes, finite, product, scaled
from wfluid.grid import Grid
from wfluid.painted import Painted
from wfluid.paths import Center, Path, Place, as_center, center_slopes, place, place_at
from wfluid.walls import Walls

FORCE_LIMIT = 1e4
"""Largest force the solver is tested with [longer side/s^2]."""

RATE_LIMIT = 100.0
"""Largest prescribed divergence the solver is tested with [1/s]."""

STEP_GROWTH = 0.5
"""Most that a step may grow or shrink: logarithm of the area."""

LEAST_RADIUS, MOST_RADIUS = 1e-6, 1e3
"""Radii that single precision holds [longer side]."""


@dataclass(frozen=True)
class Blob:
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
        return replace(self, envelope=product(self.envelope, envelope))


class BlobForce(Force):
    """A force whose shape is a Gaussian's."""

    @abstractmethod
    def over(self, start: float, end: float) -> Blob:
        """What it does from `start` to `end` [s]."""

    def pull_back(self, start: float, end: float, bar: Blob) -> Slopes:
        """The gradient with respect to the force's numbers, from `bar`, that to those of `over(start, end)`.

        This is the transpose of the derivative of `over`, in float64, under attribute paths: "center" (2,),
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

        As `BlobForce.pull_back`; the fields, with the numbers that made them, are taken as fixed. By
        default those of a lone field's envelope, and nothing of several fields.
        """
        return scaled(self.envelope.slopes(start, end), bar[0], "envelope.") if len(bar) == 1 else {}


@dataclass(frozen=True)
class GaussianForce(BlobForce):
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
        _limited("force", math.hypot(*self.vector))
        check_radius("GaussianForce.radius", self.radius)

    def over(self, start: float, end: float) -> Blob:
        """The vector times the envelope's integral."""
        impulse = self.envelope.integral(start, end)
        push = (self.vector[0] * impulse, self.vector[1] * impulse)
        return Blob(place_at(self.center, (start + end) / 2), self.radius, push=push)

    def pull_back(self, start: float, end: float, bar: Blob) -> Slopes:
        """With respect to "vector" (2,), "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar.push) | shape


@dataclass(frozen=True)
class VortexForce(BlobForce):
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
        _limited("vortex", abs(self.spin) * self.radius)

    def over(self, start: float, end: float) -> Blob:
        """Spin times radius times the envelope's integral."""
        turn = self.spin * self.radius * self.envelope.integral(start, end)
        return Blob(place_at(self.center, (start + end) / 2), self.radius, turn=turn)

    def pull_back(self, start: float, end: float, bar: Blob) -> Slopes:
        """With respect to "spin", "radius", center and envelope."""
        slopes = impulse_slopes("spin", self.spin, self.envelope, start, end, self.radius * bar.turn)
        slopes |= shape_slopes(self.center, start, end, bar)
        slopes["radius"] += self.spin / self.radius * slopes["spin"]  # the turn is their product
        return slopes


@dataclass(frozen=True)
class Growth(BlobForce):
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
        if not abs(self.rate) <= RATE_LIMIT:
            raise ValueError(f"growth of {self.rate:g}/s: the limit is {RATE_LIMIT:g}/s")
        if isinstance(self.envelope, Instantaneous):
            raise ValueError("a growth takes time: give it a window instead of an instant")

    def over(self, start: float, end: float) -> Blob:
        """The rate's mean over the step."""
        length = end - start
        course = self.envelope.integral(start, end) / length if length > 0 else self.envelope.value(start)
        mean = self.rate * course
        return Blob(place_at(self.center, (start + end) / 2), self.radius, swell=mean)

    def pull_back(self, start: float, end: float, bar: Blob) -> Slopes:
        """With respect to "rate", "radius", center and envelope."""
        shape = shape_slopes(self.center, start, end, bar)
        if end > start:
            mean = bar.swell / (end - start)
            return impulse_slopes("rate", self.rate, self.envelope, start, end, mean) | shape
        course = scaled(self.envelope.value_slopes(start), self.rate * bar.swell, "envelope.")
        return {"rate": np.array(self.envelope.value(start) * bar.swell)} | course | shape


@dataclass(frozen=True)
class Stroke(BlobForce):
    """A drag along a polyline: a Gaussian that moves along a path and pushes the way it goes.

    Its acceleration |V| V strength / (radius sqrt(2 pi)), V the path's velocity, gives a free particle
    on the path the velocity `strength` V by the time it has passed.

    Raises:
        ValueError: as `GaussianForce`.
    """

    path: Path
    """Where the brush is."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    strength: float = 1.0
    """Part of the brush's velocity that a free particle on its path takes on."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time, beside the path's own."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        if not isinstance(self.path, Path):
            raise TypeError(f"Stroke.path: expected a Path, got {type(self.path).__name__}")
        check_radius("Stroke.radius", self.radius)
        finite("Stroke.strength", self.strength)
        _limited("stroke", max(math.hypot(*push) for _, _, push in self._pieces(self.strength)))

    def _pieces(self, strength: float) -> Iterator[tuple[float, float, Place]]:
        """From when to when one of a strength pushes how [longer side/s^2]."""
        knots = zip(self.path.times, self.path.places, strict=True)
        for (t0, (x0, y0)), (t1, (x1, y1)) in itertools.pairwise(knots):
            vx, vy = (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)
            factor = strength * math.hypot(vx, vy) / (self.radius * math.sqrt(2 * math.pi))
            yield t0, t1, (vx * factor, vy * factor)

    def over(self, start: float, end: float) -> Blob:
        """The pieces of the path within the step, each in its direction."""
        px, py = 0.0, 0.0
        for t0, t1, (ax, ay) in self._pieces(self.strength):
            if t0 < end and t1 > start:
                impulse = self.envelope.integral(max(t0, start), min(t1, end))
                px, py = px + ax * impulse, py + ay * impulse
        begin, stop = max(start, self.path.times[0]), min(end, self.path.times[-1])
        return Blob(self.path.at((begin + stop) / 2), self.radius, push=(px, py))

    def pull_back(self, start: float, end: float, bar: Blob) -> Slopes:
        """With respect to "strength", "radius" and envelope; the path is taken as fixed."""
        own = 0.0
        course = scaled(self.envelope.slopes(start, start), 0.0, "envelope.")
        for t0, t1, push in self._pieces(1.0):
            if t0 < end and t1 > start:
                part, along = (max(t0, start), min(t1, end)), np.dot(push, bar.push)
                own += self.envelope.integral(*part) * along
                for name, slope in self.envelope.slopes(*part).items():
                    course[f"envelope.{name}"] += self.strength * along * slope
        radius = bar.radius - self.strength * own / self.radius
        return {"strength": np.array(own), "radius": np.array(radius)} | course


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
        _limited("wind", math.hypot(*self.vector))

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
        _limited("buoyancy", math.hypot(*self.vector))

    def pull_back(self, start: float, end: float, bar: Sequence[float]) -> Slopes:
        """With respect to "vector" (2,) and envelope, from `bar` (2,), that to vector times integral."""
        return impulse_slopes("vector", self.vector, self.envelope, start, end, bar)


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
        object.__setattr__(self, "forces", tuple(force.under(common) for force in flat(self.members)))


def flat(forces: Sequence[Force | Group]) -> tuple[Force, ...]:
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


def shape_slopes(center: Center, start: float, end: float, bar: Blob) -> Slopes:
    """The gradient with respect to radius and center, from that to those of the blob of a step."""
    radius = np.array(bar.radius, dtype=np.float64)
    return {"radius": radius} | center_slopes(center, (start + end) / 2, bar.center)


def on_faces(
    force: Sequence[np.ndarray], weight: Painted | None, grid: Grid, walls: Walls
) -> tuple[np.ndarray, np.ndarray]:
    """A field's components on faces (ny, nx), times the weight's means there, and 0 on closed walls."""
    at_centres = None if weight is None else weight.on(grid)
    closed = (slice(None), 0), (0, slice(None))
    out = []
    for n, (f, periodic) in enumerate(zip(force, walls.periodic, strict=True)):
        f = f.copy() if at_centres is None else f * mean_with_before(at_centres, 1 - n, periodic)
        if not periodic:
            f[closed[n]] = 0.0
        out.append(f)
    return out[0], out[1]


def mean_with_before(values: np.ndarray, axis: int, wraps: bool) -> np.ndarray:
    """The mean of each value and the one before it along an axis: from centres to faces."""
    return (values + before(values, axis, wraps)) / 2


def before(values: np.ndarray, axis: int, wraps: bool) -> np.ndarray:
    """The value before each along an axis; before the first its own, or the last where the axis wraps."""
    if wraps:
        return np.roll(values, 1, axis)
    first = values.take([0], axis)
    return np.concatenate([first, np.delete(values, -1, axis)], axis)


def _limited(what: str, acceleration: float) -> None:
    if not acceleration <= FORCE_LIMIT:
        raise ValueError(f"{what} of {acceleration:g}: the limit is {FORCE_LIMIT:g} longer sides/s^2")


def check_radius(name: str, value: float) -> None:
    """Refuse a radius that is none.

    Raises:
        ValueError: outside 1e-6 … 1e3 longer sides.
    """
    if not LEAST_RADIUS <= value <= MOST_RADIUS:
        raise ValueError(f"{name} {value}: expected {LEAST_RADIUS:g} … {MOST_RADIUS:g} longer sides")
