"""Courses in time, as frozen descriptions: what a force is multiplied by.

The solver asks an envelope for its integral over a step, so that the impulse of a force does not depend
on the step. Envelopes multiply: `Oscillator(period=0.5) * Fade(rise=0.2)`, `2 * Constant()`.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from wfluid.domain.piecewise import ease, finite, hats, lerp_at

Slopes = dict[str, np.ndarray]
"""Derivatives by numbers: each under its number's attribute path, "factors[0].period", and in its shape."""

Scalars = TypeVar("Scalars", float, np.ndarray)

_NODES, _WEIGHTS = (tuple(float(x) for x in values) for values in np.polynomial.legendre.leggauss(5))

_PIECES = 1000
"""Most pieces that an interval is cut into to integrate a product."""


class Envelope(ABC):
    """A force's course in time."""

    @property
    def span(self) -> float:
        """Length over which its value is near a polynomial of low degree [s]."""
        return math.inf

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
        total = 0.0
        for middle, half in self._pieces(start, end):
            total += half * sum(
                w * self.value(middle + x * half) for x, w in zip(_NODES, _WEIGHTS, strict=True)
            )
        return total

    def _pieces(self, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Middle and half the length of each piece that Gauss's rule takes [s]."""
        knots = sorted({start, end, *(t for t in self.breaks() if start < t < end)})
        for a, b in itertools.pairwise(knots):
            pieces = min(_PIECES, max(1, math.ceil((b - a) / self.span)))
            half = (b - a) / pieces / 2
            for piece in range(pieces):
                yield a + (2 * piece + 1) * half, half

    def value_slopes(self, t: float) -> Slopes:
        """Derivatives of `value(t)` with respect to the numbers that may vary; none by default."""
        return {}

    def jumps(self, start: float, end: float) -> Iterator[tuple[float, str, float]]:
        """Jumps of the value that move with a number: when [s], its name, the integral's slope by it.

        That is the value before less the one after, times the moment's derivative. A jump on `start`
        counts, on `end` not.
        """
        return iter(())

    def slopes(self, start: float, end: float) -> Slopes:
        """Derivatives of `integral(start, end)` with respect to the numbers that may vary.

        By Gauss's rule, as `integral`, and the jumps that move.
        """
        total = {name: np.zeros_like(slope) for name, slope in self.value_slopes((start + end) / 2).items()}
        if not total:
            return total
        for middle, half in self._pieces(start, end):
            for x, w in zip(_NODES, _WEIGHTS, strict=True):
                for name, slope in self.value_slopes(middle + x * half).items():
                    total[name] += half * w * slope
        return self._with_jumps(total, start, end)

    def _with_jumps(self, slopes: Slopes, start: float, end: float) -> Slopes:
        for _, name, slope in self.jumps(start, end):
            slopes[name] += slope
        return slopes

    def acts(self, start: float, end: float) -> bool:
        """Whether the integral over a step is other than 0, or would be for other numbers of the envelope."""
        if self.integral(start, end) != 0:
            return True
        return any(np.any(slope != 0) for slope in self.slopes(start, end).values())

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
        up = ease(min((t - self.start) / self.rise, 1.0)) if self.rise else 1.0
        down = ease(min((self.end - t) / self.fall, 1.0)) if self.fall else 1.0
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
        return lerp_at(self.times, self.values, t)

    def value_slopes(self, t: float) -> Slopes:
        """How much each sample counts, "values" (n,); the numbers of a function are its own."""
        if self.function is not None:
            return {}
        inside = self.times[0] <= t <= self.times[-1]
        return {"values": hats(self.times, t) if inside else np.zeros(len(self.times))}

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
        return self._between(self._primitive, start, end)

    def _between(self, primitive: Callable[[float], Scalars], start: float, end: float) -> Scalars:
        """What a primitive gains over a step, half of it in the half period of half the amplitude."""
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
        """The end of the half amplitude, which moves by half of what the period does."""
        t = self.start + self.period / 2
        if self.centred and start <= t < min(end, self.end):
            yield t, "period", self.amplitude * math.sin(2 * math.pi * self.phase) / 4

    def slopes(self, start: float, end: float) -> Slopes:
        """Closed form, with respect to "amplitude", "period" and "phase"."""
        return self._with_jumps(_by_name(self._between(self._primitive_slopes, start, end)), start, end)

    def _primitive_slopes(self, s: float) -> np.ndarray:
        angle = 2 * math.pi * (s / self.period + self.phase)
        cos, sin = math.cos(angle) / (2 * math.pi), self.amplitude * math.sin(angle)
        return np.array(
            [-self.period * cos, -self.amplitude * cos - sin * s / self.period, self.period * sin]
        )


def _by_name(slopes: np.ndarray) -> Slopes:
    """An oscillator's three slopes, named."""
    names = ("amplitude", "period", "phase")
    return {name: np.array(slope) for name, slope in zip(names, slopes, strict=True)}


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
        for n, factor in enumerate(self.factors):
            if isinstance(factor, Instantaneous):
                return self._without(n, factor).value(factor.at) * factor.integral(start, end)
        start, end, rest = self._within(start, end)
        if end <= start:
            return 0.0
        if len(rest) > 1:
            return super().integral(start, end)
        return self.gain * (self.factors[rest[0]].integral(start, end) if rest else end - start)

    def _without(self, n: int, instant: Instantaneous) -> Product:
        """The product where instant n is but a 1, from its moment on."""
        return Product((*self.factors[:n], Constant(instant.at), *self.factors[n + 1 :]), self.gain)

    def _within(self, start: float, end: float) -> tuple[float, float, list[int]]:
        """The part of a step within the windows [s], and which factors are none."""
        rest = []
        for n, factor in enumerate(self.factors):
            if isinstance(factor, Constant):
                start, end = max(start, factor.start), min(end, factor.end)
            else:
                rest.append(n)
        return start, max(start, end), rest

    def value_slopes(self, t: float) -> Slopes:
        """With respect to "gain", and the factors' own as "factors[n].name"."""
        slopes = {"gain": np.array(math.prod((factor.value(t) for factor in self.factors), start=1.0))}
        for n, factor in enumerate(self.factors):
            slopes |= scaled(factor.value_slopes(t), self._others(n, t), f"factors[{n}].")
        return slopes

    def jumps(self, start: float, end: float) -> Iterator[tuple[float, str, float]]:
        """Those of all factors, times the others' values."""
        for n, factor in enumerate(self.factors):
            for t, name, slope in factor.jumps(start, end):
                yield t, f"factors[{n}].{name}", slope * self._others(n, t)

    def _others(self, n: int, t: float) -> float:
        """The product at time t without factor n."""
        return self.gain * math.prod(other.value(t) for m, other in enumerate(self.factors) if m != n)

    def slopes(self, start: float, end: float) -> Slopes:
        """Exact where `integral` is; with respect to "gain", and the factors' own as "factors[n].name"."""
        for n, factor in enumerate(self.factors):
            if isinstance(factor, Instantaneous):
                return scaled(self._without(n, factor).value_slopes(factor.at), factor.integral(start, end))
        start, end, rest = self._within(start, end)
        if len(rest) > 1 and end > start:
            return super().slopes(start, end)
        slopes = {"gain": np.array(replace(self, gain=1.0).integral(start, end))}
        for n in rest:
            slopes |= scaled(self.factors[n].slopes(start, end), self.gain, f"factors[{n}].")
        return slopes


def product(*factors: Envelope | float) -> Envelope:
    """The product of envelopes and numbers; a lone envelope stays what it is.

    Raises:
        ValueError: two instants, or a number that is not finite.
        TypeError: something that is neither.
    """
    gain = 1.0
    envelopes: list[Envelope] = []
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


def scaled(slopes: Mapping[str, np.ndarray], factor: float, prefix: str = "") -> Slopes:
    """Slopes times a factor, as new arrays, under names that begin with a prefix."""
    return {prefix + name: np.array(factor * slope) for name, slope in slopes.items()}
