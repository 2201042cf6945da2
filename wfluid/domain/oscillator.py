"""A sinusoidal envelope, with its integral and derivatives in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from wfluid.domain.envelopes import Envelope, Slopes
from wfluid.domain.piecewise import finite

Scalars = TypeVar("Scalars", float, np.ndarray)


@dataclass(frozen=True, kw_only=True)
class Oscillator(Envelope):
    """A sin(2 pi (s / T + phase)), s = t - start: the oscillator of Bonilla & Velho, section III (k = 1 / T).

    The phase decides where a fluid that starts at rest goes:

    - phase 0, the paper's sine: the velocity never changes its sign, and the picture drifts away;
    - phase 0.25, a cosine: the velocity swings about 0, and the picture moves to one side and back;
    - phase 0.25 and `centred`: the picture swings about its place, in a free flow by A (T / 2 pi)^2 to either
      side. The half amplitude of the first half period brings it to the turning point at rest.

    Raises:
        ValueError: a number that is not finite, a period that is not positive, or an end that is not after
            the start.
    """

    amplitude: float = 1.0
    """Amplitude A: the largest value of the factor."""
    period: float = 1.0
    """Period T [s], above 0."""
    phase: float = 0.25
    """Phase at `start`, as a fraction of a period."""
    start: float = 0.0
    """Start of the window [s]."""
    end: float = math.inf
    """End of the window [s]."""
    centred: bool = True
    """Whether the first half period has half the amplitude; meant for phases 0.25 and 0.75."""

    def __post_init__(self) -> None:
        for name in ("amplitude", "phase", "start"):
            finite(f"Oscillator.{name}", getattr(self, name))
        if not (math.isfinite(self.period) and self.period > 0):
            raise ValueError(f"Oscillator: period {self.period}: expected a positive number")
        if not self.end > self.start:
            raise ValueError(f"Oscillator: end {self.end} is not after start {self.start}")

    @property
    def span(self) -> float:
        """A quarter of the period [s]."""
        return self.period / 4

    def value(self, t: float) -> float:
        """The factor at time t [s]."""
        if not self.start <= t < self.end:
            return 0.0
        s = t - self.start
        gain = self.amplitude * (0.5 if self.centred and s < self.period / 2 else 1.0)
        return gain * math.sin(2 * math.pi * (s / self.period + self.phase))

    def breaks(self) -> tuple[float, ...]:
        """Start and end of the window, and the end of the half amplitude [s]."""
        half = (self.start + self.period / 2,) if self.centred else ()
        return (self.start, *half, self.end)

    def integral(self, start: float, end: float) -> float:
        """The integral over a step [s], in closed form: exact for periods shorter than a step too."""
        return self._between(self._primitive, start, end)

    def _between(self, primitive: Callable[[float], Scalars], start: float, end: float) -> Scalars:
        """The change of a primitive over a step; half of it during the half amplitude."""
        a = max(start, self.start) - self.start
        b = max(a, min(end, self.end) - self.start)
        total = primitive(b) - primitive(a)
        half = self.period / 2 if self.centred else 0.0
        if a < half:
            total -= (primitive(min(b, half)) - primitive(a)) / 2
        return total

    def _primitive(self, s: float) -> float:
        w = 2 * math.pi / self.period
        return -self.amplitude / w * math.cos(w * s + 2 * math.pi * self.phase)

    def value_slopes(self, t: float) -> Slopes:
        """With respect to "amplitude", "period" and "phase"."""
        slopes = np.zeros(3)
        if self.start <= t < self.end:
            s = t - self.start
            angle = 2 * math.pi * (s / self.period + self.phase)
            turned = self.amplitude * 2 * math.pi * math.cos(angle)
            slopes[:] = math.sin(angle), -turned * s / self.period**2, turned
            if self.centred and s < self.period / 2:
                slopes /= 2
        return _by_name(slopes)

    def jumps(self, start: float, end: float) -> Iterator[tuple[float, str, float]]:
        """The end of the half amplitude, whose time changes by half the change of the period."""
        t = self.start + self.period / 2
        if self.centred and start <= t < min(end, self.end):
            yield t, "period", self.amplitude * math.sin(2 * math.pi * self.phase) / 4

    def slopes(self, start: float, end: float) -> Slopes:
        """With respect to "amplitude", "period" and "phase", in closed form."""
        return self._with_jumps(_by_name(self._between(self._primitive_slopes, start, end)), start, end)

    def _primitive_slopes(self, s: float) -> np.ndarray:
        angle = 2 * math.pi * (s / self.period + self.phase)
        cos, sin = math.cos(angle) / (2 * math.pi), self.amplitude * math.sin(angle)
        return np.array(
            [-self.period * cos, -self.amplitude * cos - sin * s / self.period, self.period * sin]
        )


def _by_name(slopes: np.ndarray) -> Slopes:
    """Three derivatives by the names of their parameters."""
    names = ("amplitude", "period", "phase")
    return {name: np.array(slope) for name, slope in zip(names, slopes, strict=True)}
