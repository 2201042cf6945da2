"""Forces and their course in time, as frozen descriptions.

A force is a shape in space times an envelope in time. The solver asks an envelope for its integral
over a step, so that the impulse of a force does not depend on the step.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from wfluid.painted import Painted

FORCE_LIMIT = 1e4
"""Largest force the solver is tested with [longer side/s^2]."""


class Envelope(Protocol):
    """A force's course in time."""

    def integral(self, start: float, end: float) -> float:
        """Integral over the step from `start` to `end` [s]; an instant on `start` counts, on `end` not."""
        ...


@dataclass(frozen=True)
class Instantaneous:
    """A blow at one moment: the force's vector is the velocity gained [longer side/s] (paper, III)."""

    at: float = 0.0
    """When [s]."""

    def __post_init__(self) -> None:
        _finite("Instantaneous.at", self.at)

    def integral(self, start: float, end: float) -> float:
        """1 for the step that begins at or before the moment and ends after it, else 0."""
        return 1.0 if start <= self.at < end else 0.0


@dataclass(frozen=True)
class Constant:
    """A steady force from `start` to `end` (paper, III)."""

    start: float = 0.0
    """When it begins [s]."""
    end: float = math.inf
    """When it ends [s]."""

    def __post_init__(self) -> None:
        _finite("Constant.start", self.start)
        if not self.end > self.start:
            raise ValueError(f"Constant: end {self.end} is not after start {self.start}")

    def integral(self, start: float, end: float) -> float:
        """The part of the step inside the window [s]."""
        return max(0.0, min(end, self.end) - max(start, self.start))


@dataclass(frozen=True)
class Arbitrary:
    """Any course in time: a function of the time, or samples with straight lines between (paper, III)."""

    function: Callable[[float], float] | None = None
    """Factor at a time [s]; integrated over a step by Simpson's rule."""
    times: Sequence[float] = ()
    """Times of the samples [s], increasing; zero before the first and after the last."""
    values: Sequence[float] = ()
    """Factors at `times`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        object.__setattr__(self, "values", tuple(float(v) for v in self.values))
        if (self.function is None) == (not self.times):
            raise ValueError("Arbitrary: expected either a function or samples")
        if len(self.times) != len(self.values) or len(self.times) == 1:
            raise ValueError(
                f"Arbitrary: {len(self.times)} times and {len(self.values)} values: need equal, 2 or more"
            )
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise ValueError("Arbitrary: times do not increase")
        for value in (*self.times, *self.values):
            _finite("Arbitrary sample", value)

    def integral(self, start: float, end: float) -> float:
        """Exact for samples; fourth order in the step for a function."""
        if self.function is not None:
            middle = self.function((start + end) / 2)
            return (end - start) / 6 * (self.function(start) + 4 * middle + self.function(end))
        knots = sorted({start, end, *(t for t in self.times if start < t < end)})
        return sum((b - a) * self._at((a + b) / 2) for a, b in itertools.pairwise(knots))

    def _at(self, t: float) -> float:
        if not self.times[0] <= t <= self.times[-1]:
            return 0.0
        n = min(bisect_right(self.times, t), len(self.times) - 1)
        t0, t1, v0, v1 = self.times[n - 1], self.times[n], self.values[n - 1], self.values[n]
        return v0 + (v1 - v0) * (t - t0) / (t1 - t0)


@dataclass(frozen=True, kw_only=True)
class Oscillator:
    """A sin(2 pi (t / T + phase)), the paper's oscillator (its k is 1 / T).

    Phase 0 is the paper's sine: from rest it gives a velocity that never turns back, and the picture
    walks away from its place. A quarter (a cosine) gives one that swings, from the place to one side;
    `centred` then makes it swing about the place, by A (T / 2 pi)^2 to either side in a free flow: half
    the force for the first half period brings it to the turning point at rest.
    """

    amplitude: float = 1.0
    """A: the factor's largest value."""
    period: float = 1.0
    """T [s]."""
    phase: float = 0.25
    """Part of a period by which it is ahead, 0 … 1."""
    start: float = 0.0
    """When it begins [s]; the phase counts from there."""
    end: float = math.inf
    """When it ends [s]."""
    centred: bool = True
    """Whether the first half period has half the amplitude. Meant for the phases 0.25 and 0.75."""

    def __post_init__(self) -> None:
        for name in ("amplitude", "phase", "start"):
            _finite(f"Oscillator.{name}", getattr(self, name))
        if not (math.isfinite(self.period) and self.period > 0):
            raise ValueError(f"Oscillator: period {self.period} is not positive")
        if not self.end > self.start:
            raise ValueError(f"Oscillator: end {self.end} is not after start {self.start}")

    def integral(self, start: float, end: float) -> float:
        """Closed form, so right for periods shorter than a step too."""
        a, b = max(start, self.start) - self.start, min(end, self.end) - self.start
        if b <= a:
            return 0.0
        total = self._primitive(b) - self._primitive(a)
        half = self.period / 2 if self.centred else 0.0
        if a < half:
            total -= (self._primitive(min(b, half)) - self._primitive(a)) / 2
        return total

    def _primitive(self, s: float) -> float:
        w = 2 * math.pi / self.period
        return -self.amplitude / w * math.cos(w * s + 2 * math.pi * self.phase)


@dataclass(frozen=True)
class GaussianForce:
    """A push around a point: vector exp(-|x - center|^2 / 2 radius^2) times the envelope.

    Raises:
        ValueError: a value that is not finite, a radius that is not positive, or a vector beyond
            1e4 longer sides/s^2.
    """

    center: tuple[float, float]
    """Point (x, y) [longer side]."""
    vector: tuple[float, float]
    """Acceleration at the center [longer side/s^2]; for `Instantaneous` the velocity gained."""
    radius: float
    """Sigma of the Gaussian [longer side]."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        for name in ("center", "vector"):
            values = tuple(float(value) for value in getattr(self, name))
            if len(values) != 2:
                raise ValueError(f"GaussianForce.{name}: expected two numbers, got {len(values)}")
            for value in values:
                _finite(f"GaussianForce.{name}", value)
            object.__setattr__(self, name, values)
        if math.hypot(*self.vector) > FORCE_LIMIT:
            raise ValueError(
                f"force of {math.hypot(*self.vector):g}: the limit is {FORCE_LIMIT:g} longer sides/s^2"
            )
        if not (math.isfinite(self.radius) and self.radius > 0):
            raise ValueError(f"GaussianForce.radius {self.radius}: expected a positive number")

    @property
    def reach(self) -> float:
        """Largest acceleration [longer side/s^2], at the center."""
        return math.hypot(*self.vector)


def _finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: expected a finite number")
