"""The objective of a keyframe search: the misfits of particles from their keyframes and ways.

phi = 1/2 sum over keyframe times of ||q - K||^2 (Bonilla & Velho, section III), in units of a force's
radius squared. In a march, misfits from the planned ways count too at times between keyframes; they lead
particles around others and walls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from wfluid.gradient.objectives import ParticleObjective
from wfluid.keyframes.ways import Way

SAME_TIME = 1e-9
"""Times that differ by less are the same [s]."""

NOTHING: Mapping[float, np.ndarray] = MappingProxyType({})
"""No corrections and no multipliers."""

HOLD = 0.3
"""Weight of a pin's misfits between keyframes."""


class WayMisfit(ParticleObjective):
    """Misfits of particles from their keyframes and ways.

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
        """`moments` are the times at which misfits count [s], including those of keyframes.

        `guided` tells for each point whether its way counts between keyframes. `corrections` are added to the
        targets at a time, (n, 2) [longer side]. `multipliers` move the aims of the minimisation only; misfits
        are still measured from the targets.
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

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Half the weighted sum of squares, and the weighted misfits."""
        misfit = places - self._aims[t]
        slope = ((self._held[t] + self._led[t]) / self._unit**2)[:, None] * misfit
        return 0.5 * float(np.sum(slope * misfit)), slope

    def misfits(self, places: Mapping[float, np.ndarray]) -> dict[float, np.ndarray]:
        """Misfits of keyframes for positions of all particles, both by time: (n, 2) [longer side].

        They are 0 for particles that have no keyframe at the time.
        """
        return {
            t: np.where(self._keyed[t][:, None] > 0, found - self._places[t], 0.0)
            for t, found in places.items()
        }


def longest(misfits: Mapping[float, np.ndarray]) -> float:
    """The length of the longest misfit [longer side]."""
    return max(float(np.linalg.norm(misfit, axis=1).max()) for misfit in misfits.values())
