"""A force along a stroke of the pen."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.envelopes import Constant, Envelope, Slopes, scaled
from wfluid.domain.paths import Path, Place
from wfluid.domain.piecewise import finite
from wfluid.model.force import GaussianImpulse, LocalForce, check_acceleration, check_radius
from wfluid.model.painted import Painted


@dataclass(frozen=True)
class Stroke(LocalForce):
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
        check_acceleration("stroke", max(math.hypot(*push) for _, _, push in self._pieces(self.strength)))

    def _pieces(self, strength: float) -> Iterator[tuple[float, float, Place]]:
        """From when to when one of a strength pushes how [longer side/s^2]."""
        knots = zip(self.path.times, self.path.places, strict=True)
        for (t0, (x0, y0)), (t1, (x1, y1)) in itertools.pairwise(knots):
            vx, vy = (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)
            factor = strength * math.hypot(vx, vy) / (self.radius * math.sqrt(2 * math.pi))
            yield t0, t1, (vx * factor, vy * factor)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The pieces of the path within the step, each in its direction."""
        px, py = 0.0, 0.0
        for t0, t1, (ax, ay) in self._pieces(self.strength):
            if t0 < end and t1 > start:
                impulse = self.envelope.integral(max(t0, start), min(t1, end))
                px, py = px + ax * impulse, py + ay * impulse
        begin, stop = max(start, self.path.times[0]), min(end, self.path.times[-1])
        return GaussianImpulse(self.path.at((begin + stop) / 2), self.radius, push=(px, py))

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
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
