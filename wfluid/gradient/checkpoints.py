"""Which steps are taken, kept and gone back through, when there is no room to keep all: a list of actions.

Even segments: the state at the beginning of each is stored; going backward, a segment's steps are taken
again, this time all kept, and reversed. With room for about 2 sqrt(steps) states every step but those
of the last segment is taken twice, never more often (A. Griewank, A. Walther, Evaluating Derivatives,
2nd ed., section 12.3). What is done does not depend on the room, only how often.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Advance:
    """Take the steps from `start` to `end`, keeping every state between; the state at `start` is there."""

    start: int
    end: int


@dataclass(frozen=True)
class Store:
    """Store the state at `step`, the last one taken to, and begin the next segment with it."""

    step: int


@dataclass(frozen=True)
class Restore:
    """Begin with the state stored at `step`."""

    step: int


@dataclass(frozen=True)
class Reverse:
    """Go back from `end` to `start`, whose states between are all kept."""

    start: int
    end: int


Action = Advance | Store | Restore | Reverse


@dataclass(frozen=True)
class Schedule:
    """Segments of a run, and what is done with them."""

    segments: tuple[tuple[int, int], ...]
    """First step and end of each."""
    keeps_all: bool
    """Whether there is room for every state, so that none need be stored or computed again."""

    @property
    def room(self) -> int:
        """States that it keeps or stores."""
        if self.keeps_all:
            return self.segments[-1][1] + 1
        return max(end - start for start, end in self.segments) + 1 + len(self.segments)

    def forward(self) -> list[Action]:
        """What leads from the beginning to the end."""
        actions: list[Action] = []
        for start, end in self.segments:
            if not self.keeps_all:
                actions.append(Store(start))
            actions.append(Advance(start, end))
        return actions

    def backward(self) -> list[Action]:
        """What leads back, once `forward` has been done."""
        actions: list[Action] = []
        for n, (start, end) in enumerate(reversed(self.segments)):
            if n and not self.keeps_all:
                actions += [Restore(start), Advance(start, end)]
            actions.append(Reverse(start, end))
        return actions


def even_segments(steps: int, room: int | None = None, breaks: Iterable[int] = ()) -> Schedule:
    """The longest even segments of so many steps for which there is room, cut at `breaks` too.

    `room` counts states; by default there is enough for all.

    Raises:
        ValueError: not even the shortest fit, with the least that does.
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
    """States that the least demanding schedule keeps or stores."""
    cuts = sorted({0, steps, *breaks})
    return min(steps + 1, *(_room(cuts, length) for length in range(1, steps + 1)))


def _room(cuts: list[int], length: int) -> int:
    """States that segments of at most so many steps, between the cuts, keep and store."""
    counts = [-(-(b - a) // length) for a, b in pairwise(cuts)]
    longest = max(-(-(b - a) // count) for (a, b), count in zip(pairwise(cuts), counts, strict=True))
    return longest + 1 + sum(counts)


def _evenly(start: int, end: int, length: int) -> list[tuple[int, int]]:
    """The fewest segments of at most `length` steps, as even as can be."""
    count = -(-(end - start) // length)
    return list(pairwise(start + (end - start) * n // count for n in range(count + 1)))
