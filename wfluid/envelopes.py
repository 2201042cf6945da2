"""Courses in time, as frozen descriptions: what a force is multiplied by.

The solver asks an envelope for its integral over a step, so that the impulse of a force does not depend
on the step. Envelopes multiply: `Oscillator(period=0.5) * Fade(rise=0.2)`, `2 * Constant()`.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

_NODES, _WEIGHTS = (tuple(float(x) for x in values) for values in np.polynomial.legendre.leggauss(5))

_PIECES = 1000
"""Most pieces that an interval is cut into to integrate a product."""


class Envelope(ABC):
    """A force's course in time."""

    span: float = math.inf
    """Length over which its value is near a polynomial of low degree [s]."""

    @abstractmethod
    def value(self, t: float) -> float:
        """The factor at time t [s]."""

    def breaks(self) -> tuple[float, ...]:
        """Times [s] at which value or slope jumps."""
        return ()

    def integral(self, start: float, end: float) -> float:
        """Integral over the step from `start` to `end` [s]; an instant on `start` counts, on `end` not.

        By Gauss's rule of five points on pieces no longer than `span`, between the breaks.
        """
        knots = sorted({start, end, *(t for t in self.breaks() if start < t < end)})
        total = 0.0
        for a, b in itertools.pairwise(knots):
            pieces = min(_PIECES, max(1, math.ceil((b - a) / self.span)))
            half = (b - a) / pieces / 2
            for piece in range(pieces):
                middle = a + (2 * piece + 1) * half
                total += half * sum(
                    w * self.value(middle + x * half) for x, w in zip(_NODES, _WEIGHTS, strict=True)
                )
        return total

    def __mul__(self, other: Envelope | float) -> Envelope:
        return product(self, other)

    __rmul__ = __mul__


@dataclass(frozen=True)
class Instantaneous(Envelope):
    """A blow at one moment: the force's vector is the velocity gained [longer side/s] (paper, III)."""

    at: float = 0.0
    """When [s]."""

    def __post_init__(self) -> None:
        finite("Instantaneous.at", self.at)

    def value(self, t: float) -> float:
        """Zero: a moment has no length."""
        return 0.0

    def integral(self, start: float, end: float) -> float:
        """1 for the step that begins at or before the moment and ends after it, else 0."""
        return 1.0 if start <= self.at < end else 0.0


@dataclass(frozen=True)
class Constant(Envelope):
    """A steady force from `start` to `end` (paper, III)."""

    start: float = 0.0
    """When it begins [s]."""
    end: float = math.inf
    """When it ends [s]."""

    def __post_init__(self) -> None:
        finite("Constant.start", self.start)
        if not self.end > self.start:
            raise ValueError(f"Constant: end {self.end} is not after start {self.start}")

    def value(self, t: float) -> float:
        """1 inside the window, 0 outside."""
        return 1.0 if self.start <= t < self.end else 0.0

    def breaks(self) -> tuple[float, ...]:
        """Both ends of the window."""
        return self.start, self.end

    def integral(self, start: float, end: float) -> float:
        """The part of the step inside the window [s]."""
        return max(0.0, min(end, self.end) - max(start, self.start))


@dataclass(frozen=True)
class Fade(Envelope):
    """1 from `start` to `end`, rising smoothly at the beginning and falling smoothly at the end.

    The ramps are 3 s^2 - 2 s^3 and lie inside the window.
    """

    rise: float = 0.0
    """Length of the rise [s]."""
    fall: float = 0.0
    """Length of the fall [s]; needs an end."""
    start: float = 0.0
    """When it begins [s]."""
    end: float = math.inf
    """When it has ended [s]."""

    def __post_init__(self) -> None:
        for name in ("rise", "fall", "start"):
            finite(f"Fade.{name}", getattr(self, name))
        if min(self.rise, self.fall) < 0:
            raise ValueError(f"Fade: rise {self.rise} and fall {self.fall}: expected 0 or more")
        if self.fall > 0 and not math.isfinite(self.end):
            raise ValueError("Fade: a fall needs an end")
        if not self.end > self.start or self.rise + self.fall > self.end - self.start + 1e-12:
            raise ValueError(
                f"Fade: a rise of {self.rise} and a fall of {self.fall} do not fit between "
                f"{self.start} and {self.end}"
            )

    def value(self, t: float) -> float:
        """The factor, 0 … 1."""
        if not self.start <= t < self.end:
            return 0.0
        up = _smoothstep((t - self.start) / self.rise) if self.rise else 1.0
        down = _smoothstep((self.end - t) / self.fall) if self.fall else 1.0
        return up * down

    def breaks(self) -> tuple[float, ...]:
        """The ends of the ramps."""
        return self.start, self.start + self.rise, self.end - self.fall, self.end


@dataclass(frozen=True)
class Arbitrary(Envelope):
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
            finite("Arbitrary sample", value)

    def value(self, t: float) -> float:
        """The function's value, or that of the line between two samples."""
        if self.function is not None:
            return self.function(t)
        if not self.times[0] <= t <= self.times[-1]:
            return 0.0
        n = min(bisect_right(self.times, t), len(self.times) - 1)
        t0, t1, v0, v1 = self.times[n - 1], self.times[n], self.values[n - 1], self.values[n]
        return v0 + (v1 - v0) * (t - t0) / (t1 - t0)

    def breaks(self) -> tuple[float, ...]:
        """The samples' times."""
        return tuple(self.times)

    def integral(self, start: float, end: float) -> float:
        """Exact for samples; fourth order in the step for a function."""
        if self.function is not None:
            middle = self.function((start + end) / 2)
            return (end - start) / 6 * (self.function(start) + 4 * middle + self.function(end))
        knots = sorted({start, end, *(t for t in self.times if start < t < end)})
        return sum((b - a) * self.value((a + b) / 2) for a, b in itertools.pairwise(knots))


@dataclass(frozen=True, kw_only=True)
class Oscillator(Envelope):
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
            finite(f"Oscillator.{name}", getattr(self, name))
        if not (math.isfinite(self.period) and self.period > 0):
            raise ValueError(f"Oscillator: period {self.period} is not positive")
        if not self.end > self.start:
            raise ValueError(f"Oscillator: end {self.end} is not after start {self.start}")

    @property
    def span(self) -> float:
        """A quarter of the period."""
        return self.period / 4

    def value(self, t: float) -> float:
        """The factor at time t."""
        if not self.start <= t < self.end:
            return 0.0
        s = t - self.start
        gain = self.amplitude * (0.5 if self.centred and s < self.period / 2 else 1.0)
        return gain * math.sin(2 * math.pi * (s / self.period + self.phase))

    def breaks(self) -> tuple[float, ...]:
        """The ends of the window, and of the half amplitude."""
        half = (self.start + self.period / 2,) if self.centred else ()
        return (self.start, *half, self.end)

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
class Product(Envelope):
    """The product of envelopes, times a number; made by multiplying them."""

    factors: tuple[Envelope, ...]
    """What is multiplied; at most one is an instant."""
    gain: float = 1.0
    """The number."""

    def __post_init__(self) -> None:
        finite("Product.gain", self.gain)
        if sum(isinstance(factor, Instantaneous) for factor in self.factors) > 1:
            raise ValueError("two instants cannot be multiplied")

    @property
    def span(self) -> float:
        """The shortest of its factors'."""
        return min((factor.span for factor in self.factors), default=math.inf)

    def value(self, t: float) -> float:
        """The product at time t."""
        return self.gain * math.prod(factor.value(t) for factor in self.factors)

    def breaks(self) -> tuple[float, ...]:
        """Those of all factors."""
        return tuple(t for factor in self.factors for t in factor.breaks())

    def integral(self, start: float, end: float) -> float:
        """Exact for one factor within windows; an instant takes the others' value at its moment."""
        rest = []
        for n, factor in enumerate(self.factors):
            if isinstance(factor, Instantaneous):
                others = self.factors[:n] + self.factors[n + 1 :]
                there = math.prod(other.value(factor.at) for other in others)
                return self.gain * there * factor.integral(start, end)
            if isinstance(factor, Constant):
                start, end = max(start, factor.start), min(end, factor.end)
            else:
                rest.append(factor)
        if end <= start:
            return 0.0
        if len(rest) > 1:
            return super().integral(start, end)
        return self.gain * (rest[0].integral(start, end) if rest else end - start)


def product(*factors: Envelope | float) -> Envelope:
    """The product of envelopes and numbers; a lone envelope stays what it is.

    Raises:
        ValueError: two instants, or a number that is not finite.
        TypeError: something that is neither.
    """
    gain, envelopes = 1.0, []
    for factor in factors:
        if isinstance(factor, Product):
            gain *= factor.gain
            envelopes += factor.factors
        elif isinstance(factor, Envelope):
            envelopes.append(factor)
        elif isinstance(factor, int | float | np.number):
            gain *= float(factor)
        else:
            raise TypeError(f"an envelope times {type(factor).__name__}: expected an envelope or a number")
    if len(envelopes) == 1 and gain == 1.0:
        return envelopes[0]
    return Product(tuple(envelopes), gain)


def finite(name: str, value: float) -> None:
    """Refuse what is no finite number.

    Raises:
        ValueError: with the name and the value.
    """
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: expected a finite number")


def _smoothstep(s: float) -> float:
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)
