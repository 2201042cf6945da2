"""Paths: positions of points over time, such as the center of a force."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.domain.envelopes import Slopes
from wfluid.domain.piecewise import finite, hats, interval

FARTHEST = 10.0
"""Coordinate beyond which a place looks like pixels [longer side]: a picture ends at 1."""

Place = tuple[float, float]
"""x and y [longer side]."""


@dataclass(frozen=True)
class Path:
    """A moving point: places at given times, interpolated linearly, constant before and after.

    Raises:
        ValueError: fewer than two places, different numbers of times and places, times that do not
            increase, or a number that is not finite.
    """

    times: Sequence[float]
    """Times [s], increasing, (n,)."""
    places: Sequence[Place]
    """Places x, y at `times` [longer side], (n, 2)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        object.__setattr__(self, "places", tuple(position("Path.places", at) for at in self.places))
        if len(self.times) != len(self.places) or len(self.times) < 2:
            raise ValueError(
                f"Path: {len(self.times)} times and {len(self.places)} places: need equal, 2 or more"
            )
        for t in self.times:
            finite("Path.times", t)
        if any(b <= a for a, b in itertools.pairwise(self.times)):
            raise ValueError("Path: expected times that increase")

    @classmethod
    def along(cls, places: Sequence[Place], start: float, end: float) -> Path:
        """A path along a polyline at constant speed, from `start` to `end` [s].

        Raises:
            ValueError: fewer than two places, two equal places in a row, or an end that is not after the
                start.
        """
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(places)]
        if not lengths or min(lengths) == 0:
            raise ValueError("Path: expected two or more places, each different from the one before")
        if not end > start:
            raise ValueError(f"Path: end {end} is not after start {start}")
        way = list(itertools.accumulate(lengths, initial=0.0))
        return cls([*(start + (end - start) * s / way[-1] for s in way[:-1]), end], places)

    def at(self, t: float) -> Place:
        """The place at time t [s]."""
        n, m, s = interval(self.times, t)
        (x0, y0), (x1, y1) = self.places[n], self.places[m]
        return x0 + s * (x1 - x0), y0 + s * (y1 - y0)


Center = Place | Path | Callable[[float], Place]
"""Center of a force: a fixed place, a `Path`, or a function of the time [s] that returns a place."""


def as_center(name: str, center: Center) -> Center:
    """A checked center; `name` is what messages call it.

    Raises:
        TypeError: a center that is no place.
        ValueError: a fixed place that is not two finite numbers, or that looks like pixels.
    """
    return center if isinstance(center, Path) or callable(center) else position(name, center)


def place_at(center: Center, t: float) -> Place:
    """The place of a center at time t [s].

    Raises:
        ValueError: a function returned something other than two finite numbers.
    """
    if isinstance(center, Path):
        return center.at(t)
    return position(f"the center at {t:g} s", center(t)) if callable(center) else center


def center_slopes(center: Center, t: float, bar: Place) -> Slopes:
    """The gradient with respect to a center's parameters, from `bar`, the gradient with respect to its place.

    The place is that at t [s]. The names are "center" (2,), or "center.places" (k, 2) for a path; a function
    has none, as its parameters are unknown.
    """
    if isinstance(center, Path):
        return {"center.places": np.outer(hats(center.times, t), bar)}
    return {} if callable(center) else {"center": np.array(bar, dtype=np.float64)}


def place(name: str, values: Sequence[float]) -> Place:
    """Two finite numbers as floats; `name` is what messages call them.

    Raises:
        TypeError: something other than numbers.
        ValueError: another count, or a number that is not finite.
    """
    try:
        values = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected two numbers x, y, got {values!r}") from None
    if len(values) != 2:
        raise ValueError(f"{name}: expected two numbers, got {len(values)}")
    for value in values:
        finite(name, value)
    return values


def position(name: str, values: Sequence[float]) -> Place:
    """A place [longer side]; `name` is what messages call it.

    Raises:
        TypeError: something other than numbers.
        ValueError: another count, a number that is not finite, or numbers that look like pixels.
    """
    at = place(name, values)
    check_no_pixels(name, at)
    return at


def check_no_pixels(name: str, at: Place) -> None:
    """Check that a place [longer side] does not look like pixels.

    Raises:
        ValueError: it does; the message has the conversion.
    """
    x, y = at
    if max(abs(x), abs(y)) > FARTHEST:
        raise ValueError(f"{name} ({x:g}, {y:g}) looks like pixels: {CONVERSION}")


CONVERSION = "write (x / side, y / side), with side the longer side of the picture in pixels"
"""From pixels to the unit of places."""
