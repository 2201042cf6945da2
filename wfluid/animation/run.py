"""An animation while it runs: its frames, the time spent on them, and how well a loop closes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from wfluid.animation.frame import Frame
from wfluid.animation.loops import Seam

QUEUED_FRAMES = 4
"""Frames that may wait to be written while the next are computed: evens out frames that are slow to write."""

ShownFrame = TypeVar("ShownFrame", bound=Frame)


@dataclass
class RunTimes:
    """Time spent on frames so far [s]."""

    simulate: float = 0.0
    """Stepping the fluid and measuring its map."""
    lookup: float = 0.0
    """Rendering pictures."""


@dataclass(eq=False)
class Run(Generic[ShownFrame]):
    """An iterator of frames, computed as they are asked for, with measurements of this run alone."""

    frames: Iterator[ShownFrame]
    """The frames that are still to come."""
    frame_count: int
    """Frames in all."""
    seconds: RunTimes = field(default_factory=RunTimes)
    """Time spent on the frames so far."""
    seam: Seam | None = None
    """Of a loop: how well its end meets its beginning, measured once all frames are made; else None."""

    def __iter__(self) -> Iterator[ShownFrame]:
        return self

    def __next__(self) -> ShownFrame:
        return next(self.frames)
