"""When frames are shown, and how many steps lie between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

STEPS_PER_SECOND = 96
"""Steps a second when `substeps` is not given: a step of 1/96 s keeps the splitting error small."""

KEYFRAME_STEPS = 48
"""Least steps a second of a scene with keyframes that does not say how many a frame has."""

FPS = 24.0
"""Frames a second of a `Timeline`, and of `animate`, that name none: the cinema's."""

SCENE_FPS = 15.0
"""The same of scenes and command lines, which mostly write a GIF: its size grows with every frame."""

LEAST_FPS, FPS_LIMIT = 0.01, 1000.0
"""Frame rates that make sense."""

FRAME_LIMIT = 100_000
"""Most frames of one animation."""

SUBSTEPS_LIMIT = 100_000
"""Most steps a frame that a scene may ask for."""

MOST_FACTOR = 8
"""Times the least steps that may be taken so that a time falls on one."""


def substeps_for(times: Sequence[float], fps: float, least: float) -> int:
    """The fewest steps a frame, `least` a second or more, with which every time falls on a step.

    Where 8 times as many do not do it either, the fewest there are.
    """
    fewest = math.ceil(least / fps - 1e-9)
    for substeps in range(fewest, MOST_FACTOR * fewest + 1):
        steps = [t * fps * substeps for t in times]
        if all(abs(step - round(step)) < 1e-6 and round(step) > 0 for step in steps):
            return substeps
    return fewest


@dataclass(frozen=True)
class Timeline:
    """Frames at n / fps for n = 0 … round(duration fps), each `substeps` steps after the one before."""

    duration: float
    """Length [s], positive."""
    fps: float = FPS
    """Frames a second."""
    substeps: int | None = None
    """Steps a frame; by default so many that a step is no longer than 1/96 s."""

    def __post_init__(self) -> None:
        for name in ("duration", "fps"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} {value}: expected a positive number")
        if self.substeps is not None and not (isinstance(self.substeps, int) and self.substeps >= 1):
            raise ValueError(f"substeps {self.substeps}: expected a whole number from 1 on")
        if not 0.5 <= self.duration * self.fps <= FRAME_LIMIT:
            raise ValueError(
                f"{self.duration:g} s at {self.fps:g} fps is {self.duration * self.fps:g} frames: "
                f"expected 1 … {FRAME_LIMIT}"
            )
        if not LEAST_FPS <= self.fps <= FPS_LIMIT:
            raise ValueError(f"fps {self.fps:g}: expected {LEAST_FPS:g} … {FPS_LIMIT:g}")
        if self.dt > STEP_LIMIT:
            raise ValueError(f"steps of {self.dt:g} s: expected at most {STEP_LIMIT:g}; use more substeps")

    @property
    def frames(self) -> int:
        """Frames shown, both ends included."""
        return max(1, round(self.duration * self.fps)) + 1

    @property
    def steps_per_frame(self) -> int:
        """Steps between two frames."""
        return self.substeps or math.ceil(STEPS_PER_SECOND / self.fps)

    @property
    def steps(self) -> int:
        """Steps to the last frame."""
        return (self.frames - 1) * self.steps_per_frame

    @property
    def end(self) -> float:
        """When the last frame is shown [s]."""
        return self.time_of(self.steps)

    @property
    def dt(self) -> float:
        """Length of a step [s]."""
        return self.time_of(1)

    def time_of(self, step: int) -> float:
        """When a step begins [s]: the same number as the end of the one before."""
        return step / (self.fps * self.steps_per_frame)


STEP_LIMIT = 10.0
"""Longest step the solver is tested with [s]."""

LOOPS = ("oscillate", "pingpong", "crossfade")
