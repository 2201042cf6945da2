"""A force that moves along a stroke."""

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
    """A brush stroke: a Gaussian that moves along a path and pushes in the direction of its motion.

    The acceleration is |V| V strength / (radius sqrt(2 pi)), with the velocity V of the path. It gives a free
    particle on the path the velocity `strength` V once the Gaussian has passed.

    Raises:
        ValueError: as `GaussianForce`.
        TypeError: a path that is no `Path`.
    """

    path: Path
    """Center over time."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    strength: float = 1.0
    """Velocity of a free particle on the path, relative to that of the path."""
    envelope: Envelope = field(default_factory=Constant)
    """Further factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def __post_init__(self) -> None:
        self._settle()
        if not isinstance(self.path, Path):
            raise TypeError(f"Stroke.path: expected a Path, got {type(self.path).__name__}")
        check_radius("Stroke.radius", self.radius)
        finite("Stroke.strength", self.strength)
        check_acceleration("stroke", max(math.hypot(*push) for _, _, push in self._pieces(self.strength)))

    def _pieces(self, strength: float) -> Iterator[tuple[float, float, Place]]:
        """Start and end [s] of each segment of the path, and its acceleration [longer side/s^2]."""
        knots = zip(self.path.times, self.path.places, strict=True)
        for (t0, (x0, y0)), (t1, (x1, y1)) in itertools.pairwise(knots):
            vx, vy = (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)
            factor = strength * math.hypot(vx, vy) / (self.radius * math.sqrt(2 * math.pi))
            yield t0, t1, (vx * factor, vy * factor)

    def impulse(self, start: float, end: float) -> GaussianImpulse:
        """The sum over the path's segments within the step."""
        px, py = 0.0, 0.0
        for t0, t1, (ax, ay) in self._pieces(self.strength):
            if t0 < end and t1 > start:
                impulse = self.envelope.integral(max(t0, start), min(t1, end))
                px, py = px + ax * impulse, py + ay * impulse
        begin, stop = max(start, self.path.times[0]), min(end, self.path.times[-1])
        return GaussianImpulse(self.path.at((begin + stop) / 2), self.radius, push=(px, py))

    def pull_back(self, start: float, end: float, bar: GaussianImpulse) -> Slopes:
        """With respect to "strength", "radius" and envelope; the path counts as fixed."""
        own = 0.0
        over_time = scaled(self.envelope.slopes(start, start), 0.0, "envelope.")
        for t0, t1, push in self._pieces(1.0):
            if t0 < end and t1 > start:
                part, along = (max(t0, start), min(t1, end)), np.dot(push, bar.push)
                own += self.envelope.integral(*part) * along
                for name, slope in self.envelope.slopes(*part).items():
                    over_time[f"envelope.{name}"] += self.strength * along * slope
        radius = bar.radius - self.strength * own / self.radius
        return {"strength": np.array(own), "radius": np.array(radius)} | over_time
