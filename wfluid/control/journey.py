"""The objective of keyframes: how far particles are from where they should be, at the time.

phi = 1/2 sum over keyframe times of ||q - K||^2 (Bonilla & Velho, section III), in units of a force's
radius squared. While the search begins, misfits from the expected ways count too, at some times between:
they lead it round what it could not pass.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wfluid.control.objectives import ParticleObjective
from wfluid.control.plan import Way

SAME_TIME = 1e-9
"""Times nearer than this are one [s]."""

HOLD = 0.1
"""Weight of a pin's misfits between keyframes."""


class Journey(ParticleObjective):
    """Misfits of particles on their ways.

    `points` are places at the beginning of the run. The weight `guide` of what is between keyframes may be
    changed; pins are held there always.
    """

    def __init__(
        self, ways: Sequence[Way], points: np.ndarray, moments: Sequence[float], unit: float, guided=None
    ):
        """`moments` are times of the run, those of keyframes among them; `guided` says whose ways count."""
        self.points, self.times, self.guide = points, tuple(moments), 1.0
        self._unit = unit
        guided = np.ones(len(ways)) if guided is None else np.asarray(guided, dtype=np.float64)
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
            self._led[t] = np.where(self._held[t] > 0, 0.0, guided * under_way)
        self._misfits: dict[float, float] = {}

    guide: float
    """Weight of the ways between keyframes."""

    def at(self, t: float, places: np.ndarray) -> tuple[float, np.ndarray]:
        """Half the weighted sum of squares, and the weighted misfits."""
        left = places - self._aims[t]
        keyed = np.linalg.norm(left[self._keyed[t] > 0], axis=1)
        self._misfits[t] = float(keyed.max(initial=0.0))
        slope = ((self._held[t] + self.guide * self._led[t]) / self._unit**2)[:, None] * left
        return 0.5 * float(np.sum(slope * left)), slope

    @property
    def worst(self) -> float:
        """The longest misfit of a keyframe in the last evaluation [longer side]."""
        return max(self._misfits.values(), default=0.0)

    def shift(self, t: float, by: np.ndarray) -> None:
        """Aim beside the keyframes of a time by so much, (particles, 2) [longer side]."""
        self._aims[t] = self._aims[t] + by
