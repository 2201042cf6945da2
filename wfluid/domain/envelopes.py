"""Envelopes: factors over time that forces and sources are multiplied by, as frozen descriptions.

The solver uses an envelope's integral over a step, so that the impulse of a force does not depend on the
length of the steps. Envelopes can be multiplied: `Oscillator(period=0.5) * Fade(rise=0.2)`, `2 * Constant()`.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wfluid.domain.piecewise import ease, finite, hats, lerp_at

Slopes = dict[str, np.ndarray]
"""Derivatives with respect to parameters: attribute path ("factors[0].period") to array of its shape."""

_NODES, _WEIGHTS = (tuple(float(x) for x in values) for values in np.polynomial.legendre.leggauss(5))

_PIECES = 1000
"""Largest number of pieces for the quadrature of an interval."""


class Envelope(ABC):
    """A factor over time, without unit. Subclasses define `value`; the integrals follow by quadrature."""

    @property
    def span(self) -> float:
        """Length of a piece on which a polynomial of low degree approximates the value well [s]."""
        return math.inf

    @abstractmethod
    def value(self, t: float) -> float:
        """The factor at time t [s]."""

    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""
        return ()

    def integral(self, start: float, end: float) -> float:
        """The integral of the value over a step from `start` to `end` [s].

        An instant at `start` belongs to the step, an instant at `end` to the next one. Computed by
        five-point Gauss quadrature on pieces that contain no break and are no longer than `span`.
        """
        total = 0.0
        for middle, half in self._pieces(start, end):
            total += half * sum(
                w * self.value(middle + x * half) for x, w in zip(_NODES, _WEIGHTS, strict=True)
            )
        return total

    def _pieces(self, start: float, end: float) -> Iterator[tuple[float, float]]:
        """The middle and half the length of each piece of the quadrature [s]."""
        knots = sorted({start, end, *(t for t in self.breaks() if start < t < end)})
        for a, b in itertools.pairwise(knots):
            pieces = min(_PIECES, max(1, math.ceil((b - a) / self.span)))
            half = (b - a) / pieces / 2
            for piece in range(pieces):
                yield a + (2 * piece + 1) * half, half

    def value_slopes(self, t: float) -> Slopes:
        """Derivatives of `value(t)` with respect to the parameters that may vary; none by default."""
        return {}

    def jumps(self, start: float, end: float) -> Iterator[tuple[float, str, float]]:
        """Jumps of the value whose times depend on a parameter.

        Yields the time [s], the parameter's name and the jump's share of the derivative of the integral: the
        value before minus the value after, times the derivative of the time. A jump at `start` belongs to
        the interval, a jump at `end` does not.
        """
        return iter(())

    def slopes(self, start: float, end: float) -> Slopes:
        """Derivatives of `integral(start, end)` with respect to the parameters that may vary.

        Computed by the quadrature of `integral`, plus the shares of moving jumps (`jumps`).
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
        """Whether the integral over a step, or its derivative with respect to any parameter, is not 0."""
        if self.integral(start, end) != 0:
            return True
        return any(np.any(slope != 0) for slope in self.slopes(start, end).values())

    def __mul__(self, other: Envelope | float) -> Envelope:
        return product(self, other)

    __rmul__ = __mul__


@dataclass(frozen=True)
class Instantaneous(Envelope):
    """An impulse at one moment: the force's vector is the velocity gained [longer side/s].

    Source: Bonilla & Velho, section III.

    Raises:
        ValueError: a time that is not finite.
    """

    at: float = 0.0
    """Time of the impulse [s]."""

    def __post_init__(self) -> None:
        finite("Instantaneous.at", self.at)

    def value(self, t: float) -> float:
        """0 everywhere: only the integral of an instant is not 0."""
        return 0.0

    def integral(self, start: float, end: float) -> float:
        """1 for the step with start <= at < end, 0 for all others (no unit)."""
        return 1.0 if start <= self.at < end else 0.0


@dataclass(frozen=True)
class Constant(Envelope):
    """1 from `start` to `end`, 0 before and after (Bonilla & Velho, section III).

    Raises:
        ValueError: a start that is not finite, or an end that is not after the start.
    """

    start: float = 0.0
    """Start of the window [s]."""
    end: float = math.inf
    """End of the window [s]."""

    def __post_init__(self) -> None:
        finite("Constant.start", self.start)
        if not self.end > self.start:
            raise ValueError(f"Constant: end {self.end} is not after start {self.start}")

    def value(self, t: float) -> float:
        """1 for start <= t < end, 0 outside."""
        return 1.0 if self.start <= t < self.end else 0.0

    def breaks(self) -> tuple[float, ...]:
        """Start and end of the window [s]."""
        return self.start, self.end

    def integral(self, start: float, end: float) -> float:
        """The length of the part of the step inside the window [s]."""
        return max(0.0, min(end, self.end) - max(start, self.start))


@dataclass(frozen=True)
class Fade(Envelope):
    """1 from `start` to `end`, with a smooth rise at the start and a smooth fall at the end.

    Both ramps are 3 s^2 - 2 s^3 and lie inside the window.

    Raises:
        ValueError: a negative or infinite length, a fall without an end, or ramps longer than the window.
    """

    rise: float = 0.0
    """Length of the rise [s]."""
    fall: float = 0.0
    """Length of the fall [s]; above 0 only with a finite `end`."""
    start: float = 0.0
    """Start of the rise [s]."""
    end: float = math.inf
    """End of the fall [s]."""

    def __post_init__(self) -> None:
        for name in ("rise", "fall", "start"):
            finite(f"Fade.{name}", getattr(self, name))
        if min(self.rise, self.fall) < 0:
            raise ValueError(f"Fade: rise {self.rise} and fall {self.fall}: expected 0 or more")
        if self.fall > 0 and not math.isfinite(self.end):
            raise ValueError(f"Fade: a fall of {self.fall} without an end: give a finite end")
        if not self.end > self.start or self.rise + self.fall > self.end - self.start + 1e-12:
            raise ValueError(
                f"Fade: a rise of {self.rise} and a fall of {self.fall} do not fit between "
                f"{self.start} and {self.end}"
            )

    def value(self, t: float) -> float:
        """The factor at time t [s], 0 … 1."""
        if not self.start <= t < self.end:
            return 0.0
        up = ease(min((t - self.start) / self.rise, 1.0)) if self.rise else 1.0
        down = ease(min((self.end - t) / self.fall, 1.0)) if self.fall else 1.0
        return up * down

    def breaks(self) -> tuple[float, ...]:
        """Start and end of both ramps [s]."""
        return self.start, self.start + self.rise, self.end - self.fall, self.end


@dataclass(frozen=True)
class Arbitrary(Envelope):
    """A function of time, or samples with linear interpolation (Bonilla & Velho, section III).

    Raises:
        ValueError: both or neither of `function` and samples; fewer than two samples, `times` and `values` of
            different lengths, times that do not increase, or a number that is not finite.
    """

    function: Callable[[float], float] | None = None
    """Maps a time [s] to a factor; integrated over a step by Simpson's rule."""
    times: Sequence[float] = ()
    """Times of the samples [s], increasing, (n,); the factor is 0 before the first and after the last."""
    values: Sequence[float] = ()
    """Factors at `times`, (n,)."""

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
            raise ValueError("Arbitrary: expected times that increase")
        for value in (*self.times, *self.values):
            finite("Arbitrary sample", value)

    def value(self, t: float) -> float:
        """The value of the function, or of the linear interpolation, at time t [s]."""
        if self.function is not None:
            return self.function(t)
        if not self.times[0] <= t <= self.times[-1]:
            return 0.0
        return lerp_at(self.times, self.values, t)

    def value_slopes(self, t: float) -> Slopes:
        """The weight of each sample, "values" (n,); nothing for a function, whose parameters are unknown."""
        if self.function is not None:
            return {}
        inside = self.times[0] <= t <= self.times[-1]
        return {"values": hats(self.times, t) if inside else np.zeros(len(self.times))}

    def breaks(self) -> tuple[float, ...]:
        """The times of the samples [s]."""
        return tuple(self.times)

    def integral(self, start: float, end: float) -> float:
        """The integral over a step [s]: exact for samples, of fourth order in the step for a function."""
        if self.function is not None:
            middle = self.function((start + end) / 2)
            return (end - start) / 6 * (self.function(start) + 4 * middle + self.function(end))
        knots = sorted({start, end, *(t for t in self.times if start < t < end)})
        return sum((b - a) * self.value((a + b) / 2) for a, b in itertools.pairwise(knots))


@dataclass(frozen=True)
class Product(Envelope):
    """The product of envelopes and a number; `product` and `*` make it.

    Raises:
        ValueError: two instants, or a gain that is not finite.
    """

    factors: tuple[Envelope, ...]
    """The envelopes multiplied; at most one `Instantaneous`."""
    gain: float = 1.0
    """The number multiplied."""

    def __post_init__(self) -> None:
        finite("Product.gain", self.gain)
        if sum(isinstance(factor, Instantaneous) for factor in self.factors) > 1:
            raise ValueError("two instants cannot be multiplied: keep one Instantaneous")

    @property
    def span(self) -> float:
        """The shortest span of the factors [s]."""
        return min((factor.span for factor in self.factors), default=math.inf)

    def value(self, t: float) -> float:
        """The product at time t [s]."""
        return self.gain * math.prod(factor.value(t) for factor in self.factors)

    def breaks(self) -> tuple[float, ...]:
        """The breaks of all factors [s]."""
        return tuple(t for factor in self.factors for t in factor.breaks())

    def integral(self, start: float, end: float) -> float:
        """The integral over a step [s].

        Exact where at most one factor is not a `Constant`. An instant gives the product of the other
        factors at its time.
        """
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
        """The product with instant n replaced by a factor that is 1 from its time on."""
        return Product((*self.factors[:n], Constant(instant.at), *self.factors[n + 1 :]), self.gain)

    def _within(self, start: float, end: float) -> tuple[float, float, list[int]]:
        """The part of a step inside all `Constant` windows [s], and the indices of the other factors."""
        rest = []
        for n, factor in enumerate(self.factors):
            if isinstance(factor, Constant):
                start, end = max(start, factor.start), min(end, factor.end)
            else:
                rest.append(n)
        return start, max(start, end), rest

    def value_slopes(self, t: float) -> Slopes:
        """With respect to "gain", and to the factors' parameters as "factors[n].name"."""
        slopes = {"gain": np.array(math.prod((factor.value(t) for factor in self.factors), start=1.0))}
        for n, factor in enumerate(self.factors):
            slopes |= scaled(factor.value_slopes(t), self._others(n, t), f"factors[{n}].")
        return slopes

    def jumps(self, start: float, end: float) -> Iterator[tuple[float, str, float]]:
        """The jumps of each factor, times the value of all others."""
        for n, factor in enumerate(self.factors):
            for t, name, slope in factor.jumps(start, end):
                yield t, f"factors[{n}].{name}", slope * self._others(n, t)

    def _others(self, n: int, t: float) -> float:
        """The product at time t without factor n."""
        return self.gain * math.prod(other.value(t) for m, other in enumerate(self.factors) if m != n)

    def slopes(self, start: float, end: float) -> Slopes:
        """With respect to "gain", and to the factors' parameters as "factors[n].name".

        Exact where `integral` is.
        """
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
    """The product of envelopes and numbers; a single envelope is returned unchanged.

    Raises:
        ValueError: two instants, or a number that is not finite.
        TypeError: a factor that is neither an envelope nor a number.
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
    """Derivatives times a factor, as new arrays; `prefix` is put before each name."""
    return {prefix + name: np.array(factor * slope) for name, slope in slopes.items()}
