"""Recorded runs whose captured graphs later functionals replay with other numbers."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.gradient.recording import Recording
from wfluid.model.fluid import Fluid


class GraphCache:
    """The last recording for each grid and timeline, for the functionals that are given this cache.

    Capturing graphs takes the time of some steps; a series of short minimisations saves it. A recording
    serves one functional at a time: the last one that took it.
    """

    def __init__(self) -> None:
        self._recordings: dict[tuple[Grid, Timeline], Recording] = {}
        self._users: WeakKeyDictionary[Recording, object] = WeakKeyDictionary()

    def find(self, grid: Grid, timeline: Timeline, fluid: Fluid) -> Recording | None:
        """The last recording with this grid and timeline, if it was made for this very fluid."""
        found = self._recordings.get((grid, timeline))
        return found if found and found.step.fluid is fluid else None

    def keep(self, recording: Recording, user: object) -> None:
        """Store a recording as the last one, which `user` runs from now on."""
        self._recordings[recording.step.grid, recording.timeline] = recording
        self._users[recording] = user

    def serves(self, recording: Recording, user: object) -> bool:
        """Whether nobody else has taken the recording since."""
        return self._users.get(recording) is user
