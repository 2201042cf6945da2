"""An animation while it runs: its frames, the time spent on them, and how well a loop closes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from wfluid.animation.frame import Frame
from wfluid.animation.loops import Seam
from wfluid.domain.limits import FPS

QUEUED_FRAMES = 4
"""Largest number of frames that wait to be written while the next are computed."""

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
    """An iterator that computes frames on request, with measurements of this run alone."""

    frames: Iterator[ShownFrame]
    """Iterator of the remaining frames."""
    frame_count: int
    """Total number of frames."""
    fps: float = FPS
    """Frame rate [1/s]."""
    seconds: RunTimes = field(default_factory=RunTimes)
    """Time spent on the frames so far."""
    seam: Seam | None = None
    """Difference between end and beginning of a loop, measured after the last frame; None without a loop."""

    def __repr__(self) -> str:
        return f"Run({self.frame_count} frames at {self.fps:g} per second)"

    def __iter__(self) -> Iterator[ShownFrame]:
        return self

    def __next__(self) -> ShownFrame:
        return next(self.frames)
