"""The timeline: times of frames, and the number of solver steps between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from wfluid.domain.checks import check_number
from wfluid.domain.limits import FPS, FPS_LIMIT, LEAST_FPS, STEPS_PER_SECOND

FRAME_LIMIT = 100_000
"""Largest number of frames of an animation."""

MOST_FACTOR = 8
"""Largest factor by which `substeps_for` raises the number of steps per frame."""


def substeps_for(times: Sequence[float], fps: float, least: float) -> int:
    """The smallest number of steps per frame for which every one of `times` [s] is the end of a step.

    At least `least` steps per second are taken. If no number up to 8 times the smallest suits, it is the
    smallest.
    """
    fewest = math.ceil(least / fps - 1e-9)
    for substeps in range(fewest, MOST_FACTOR * fewest + 1):
        steps = [t * fps * substeps for t in times]
        if all(abs(step - round(step)) < 1e-6 and round(step) > 0 for step in steps):
            return substeps
    return fewest


_NTSC = {
    round(nominal / 1.001, digits): Fraction(nominal * 1000, 1001)
    for nominal in (24, 30, 48, 60, 120, 240)
    for digits in (2, 3)
}
"""Exact frame rates of American television (SMPTE ST 12), by the rounded numbers that stand for them."""


def exact_rate(fps: float) -> Fraction:
    """A frame rate as a fraction: 29.97 is 30000/1001, 23.976 and 23.98 are 24000/1001."""
    return _NTSC.get(fps) or Fraction(fps).limit_denominator(1001)


@dataclass(frozen=True)
class Timeline:
    """Frames at times n / fps for n = 0 … round(duration fps), with `substeps` solver steps between two.

    Raises:
        TypeError: a duration or rate that is no number.
        ValueError: a duration or rate that is not positive and finite, a rate outside 0.01 … 1000, more than
            100 000 frames, substeps that are no integer from 1 on, or steps longer than 10 s.
    """

    duration: float
    """Duration [s], above 0."""
    fps: float = FPS
    """Frame rate [1/s]; 29.97 and its like become 30000/1001, see `exact_rate`."""
    substeps: int | None = None
    """Steps per frame; by default the smallest number for which a step is at most 1/96 s."""

    def __post_init__(self) -> None:
        for name in ("duration", "fps"):
            value = getattr(self, name)
            check_number(name, value)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} {value}: expected a positive number")
        if self.substeps is not None and not (isinstance(self.substeps, int) and self.substeps >= 1):
            raise ValueError(f"substeps {self.substeps}: expected a whole number from 1 on")
        if not 0.5 <= self.duration * self.fps <= FRAME_LIMIT:
            raise ValueError(
                f"{self.duration:g} s at {self.fps:g} fps is {self.duration * self.fps:g} frames: "
                f"expected 1 … {FRAME_LIMIT}"
            )
        if self.fps in _NTSC:
            object.__setattr__(self, "fps", float(_NTSC[self.fps]))
        if not LEAST_FPS <= self.fps <= FPS_LIMIT:
            raise ValueError(f"fps {self.fps:g}: expected {LEAST_FPS:g} … {FPS_LIMIT:g}")
        if self.dt > STEP_LIMIT:
            raise ValueError(f"steps of {self.dt:g} s: expected at most {STEP_LIMIT:g}; use more substeps")

    @property
    def frames(self) -> int:
        """Number of frames, first and last included."""
        return max(1, round(self.duration * self.fps)) + 1

    @property
    def steps_per_frame(self) -> int:
        """Number of steps between two frames."""
        return self.substeps or math.ceil(STEPS_PER_SECOND / self.fps)

    @property
    def steps(self) -> int:
        """Number of steps to the last frame."""
        return (self.frames - 1) * self.steps_per_frame

    @property
    def end(self) -> float:
        """Time of the last frame [s]."""
        return self.time_of(self.steps)

    @property
    def dt(self) -> float:
        """Length of a step [s]."""
        return self.time_of(1)

    def time_of(self, step: int) -> float:
        """Start of a step [s], bit-equal to the end of the step before."""
        return step / (self.fps * self.steps_per_frame)


STEP_LIMIT = 10.0
"""Largest step that the solver is tested with [s]."""
