"""A cache of recordings: later functionals replay their captured graphs with other numbers."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.gradient.recording import Recording
from wfluid.model.fluid import Fluid


class GraphCache:
    """The last recording for each grid and timeline, for the functionals that are given this cache.

    Capturing graphs takes as long as some steps, which counts in a series of short minimisations. A recording
    serves one functional at a time: the one that took it last.
    """

    def __init__(self) -> None:
        self._recordings: dict[tuple[Grid, Timeline], Recording] = {}
        self._users: WeakKeyDictionary[Recording, object] = WeakKeyDictionary()

    def find(self, grid: Grid, timeline: Timeline, fluid: Fluid) -> Recording | None:
        """The last recording with this grid and timeline, if it is for the same `Fluid` object."""
        found = self._recordings.get((grid, timeline))
        return found if found and found.step.fluid is fluid else None

    def keep(self, recording: Recording, user: object) -> None:
        """Store a recording as the last one, and `user` as the functional it serves."""
        self._recordings[recording.step.grid, recording.timeline] = recording
        self._users[recording] = user

    def serves(self, recording: Recording, user: object) -> bool:
        """Whether `user` is the functional that a recording serves."""
        return self._users.get(recording) is user
