"""Checkpoints: the schedule of a forward and backward pass with limited memory, as a list of actions.

The run is cut into even segments, and the state at the beginning of each is stored as a checkpoint. In the
backward pass the steps of a segment are taken again from its checkpoint, with all their states stored, and
then reversed. With room for about 2 sqrt(steps) states every step is taken at most twice, those of the last
segment once (A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., section 12.3). The results have the
same bits for any schedule.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Advance:
    """Take the steps from `start` to `end` from the current state, and store every state between."""

    start: int
    end: int


@dataclass(frozen=True)
class Store:
    """Store the current state, at `step`, as the checkpoint of the segment that begins there."""

    step: int


@dataclass(frozen=True)
class Restore:
    """Make the checkpoint at `step` the current state."""

    step: int


@dataclass(frozen=True)
class Reverse:
    """The backward pass from `end` to `start`, between which all states are stored."""

    start: int
    end: int


Action = Advance | Store | Restore | Reverse


@dataclass(frozen=True)
class Schedule:
    """The segments of a run, and the actions of both passes."""

    segments: tuple[tuple[int, int], ...]
    """First step and end of each segment."""
    keeps_all: bool
    """Whether all states are stored, so that no checkpoints are needed and no step is taken again."""

    @property
    def room(self) -> int:
        """Number of states that are stored at once, checkpoints included."""
        if self.keeps_all:
            return self.segments[-1][1] + 1
        return max(end - start for start, end in self.segments) + 1 + len(self.segments)

    def forward(self) -> list[Action]:
        """The actions of the forward pass."""
        actions: list[Action] = []
        for start, end in self.segments:
            if not self.keeps_all:
                actions.append(Store(start))
            actions.append(Advance(start, end))
        return actions

    def backward(self) -> list[Action]:
        """The actions of the backward pass, after those of `forward`."""
        actions: list[Action] = []
        for n, (start, end) in enumerate(reversed(self.segments)):
            if n and not self.keeps_all:
                actions += [Restore(start), Advance(start, end)]
            actions.append(Reverse(start, end))
        return actions


def even_segments(steps: int, room: int | None = None, breaks: Iterable[int] = ()) -> Schedule:
    """The schedule with the longest even segments that fit in `room` states; every break ends a segment.

    By default there is room for all states.

    Raises:
        ValueError: too little room for any schedule, with the least that works.
    """
    breaks = set(breaks)
    cuts = sorted({0, steps, *breaks})
    every = Schedule(tuple(pairwise(cuts)), keeps_all=True)
    if room is None or every.room <= room:
        return every
    for length in range(steps, 0, -1):
        if _room(cuts, length) <= room:
            segments = tuple(pair for a, b in pairwise(cuts) for pair in _evenly(a, b, length))
            return Schedule(segments, keeps_all=False)
    raise ValueError(f"room for {room} states: at least {least_room(steps, breaks)} are needed")


def least_room(steps: int, breaks: Iterable[int] = ()) -> int:
    """Least number of states with which a schedule works."""
    cuts = sorted({0, steps, *breaks})
    return min(steps + 1, *(_room(cuts, length) for length in range(1, steps + 1)))


def _room(cuts: list[int], length: int) -> int:
    """Number of states stored at once with segments of at most `length` steps between the cuts."""
    counts = [-(-(b - a) // length) for a, b in pairwise(cuts)]
    longest = max(-(-(b - a) // count) for (a, b), count in zip(pairwise(cuts), counts, strict=True))
    return longest + 1 + sum(counts)


def _evenly(start: int, end: int, length: int) -> list[tuple[int, int]]:
    """The fewest segments of at most `length` steps, of sizes that differ by 1 at most."""
    count = -(-(end - start) // length)
    return list(pairwise(start + (end - start) * n // count for n in range(count + 1)))
