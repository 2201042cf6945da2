"""The objective of keyframes: how far particles are from where they should be, at the time.

phi = 1/2 sum over keyframe times of ||q - K||^2 (Bonilla & Velho, section III), in units of a force's
radius squared. In a march misfits from the expected ways count too, at some times between: they lead it round
what it could not pass.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from wfluid.gradient.objectives import ParticleObjective
from wfluid.keyframes.ways import Way

SAME_TIME = 1e-9
"""Times nearer than this are one [s]."""

NOTHING: Mapping[float, np.ndarray] = MappingProxyType({})
"""No shifts."""

HOLD = 0.3
"""Weight of a pin's misfits between keyframes."""


class WayMisfit(ParticleObjective):
    """Misfits of particles on their ways.

    `points` are places at the beginning of the run. Between keyframes pins are held, and points may be led
    along their ways.
    """

    def __init__(
        self,
        ways: Sequence[Way],
        points: np.ndarray,
        moments: Sequence[float],
        unit: float,
        guided: Sequence[bool] = (),
        corrections: Mapping[float, np.ndarray] = NOTHING,
        multipliers: Mapping[float, np.ndarray] = NOTHING,
    ):
        """`moments` are times of the run, those of keyframes among them; `guided` says who is led, if any.

        `corrections` are added to the places of a time, (n, 2) [longer side]; `multipliers` move the aim
        only: misfits are still measured from the place.
        """
        self.points, self.times = points, tuple(moments)
        self._unit = unit
        led = np.array(guided or [False] * len(ways), dtype=np.float64)
        self._aims: dict[float, np.ndarray] = {}
        self._keyed: dict[float, np.ndarray] = {}
        self._held: dict[float, np.ndarray] = {}
        self._led: dict[float, np.ndarray] = {}
        pinned = np.array([float(way.particle.pinned) for way in ways])
        for t in self.times:
            aims, keyed = np.array([way.at(t) for way in ways]), np.zeros(len(ways))
            for n, way in enumerate(ways):
                for m, time in enumerate(way.particle.times):
                    if abs(time - t) < SAME_TIME:
                        aims[n], keyed[n] = way.particle.destinations[m], way.particle.weights[m]
            self._aims[t], self._keyed[t] = aims, keyed
            self._held[t] = np.where(keyed > 0, keyed, HOLD * pinned)
            under_way = np.array([t < way.particle.times[-1] for way in ways])
            self._led[t] = np.where(self._held[t] > 0, 0.0, led * under_way)
        self._places = {t: aims + corrections.get(t, 0.0) for t, aims in self._aims.items()}
        self._aims = {t: place + multipliers.get(t, 0.0) for t, place in self._places.items()}
        self.left: dict[float, np.ndarray] = {}

    left: dict[float, np.ndarray]
    """What keyframes are missed by in the last evaluation, by time: (n, 2) [longer side], 0 for others."""

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Half the weighted sum of squares, and the weighted misfits."""
        self.left[t] = np.where(self._keyed[t][:, None] > 0, places - self._places[t], 0.0)
        left = places - self._aims[t]
        slope = ((self._held[t] + self._led[t]) / self._unit**2)[:, None] * left
        return 0.5 * float(np.sum(slope * left)), slope

    @property
    def worst(self) -> float:
        """The longest misfit of a keyframe in the last evaluation [longer side]."""
        return max(float(np.linalg.norm(left, axis=1).max()) for left in self.left.values())
