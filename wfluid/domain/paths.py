"""Points that move: where a force is at a time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.domain.envelopes import Slopes
from wfluid.domain.piecewise import finite, hats, interval

Place = tuple[float, float]
"""x and y [longer side]."""


@dataclass(frozen=True)
class Path:
    """A place at each of some times, straight lines between them, at rest before and after.

    Raises:
        ValueError: fewer than two places, as many times as places not given, times that do not
            increase, or a number that is not finite.
    """

    times: Sequence[float]
    """When [s], increasing."""
    places: Sequence[Place]
    """Where (x, y) [longer side]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        object.__setattr__(self, "places", tuple(place("Path.places", at) for at in self.places))
        if len(self.times) != len(self.places) or len(self.times) < 2:
            raise ValueError(
                f"Path: {len(self.times)} times and {len(self.places)} places: need equal, 2 or more"
            )
        for t in self.times:
            finite("Path.times", t)
        if any(b <= a for a, b in itertools.pairwise(self.times)):
            raise ValueError("Path: times do not increase")

    @classmethod
    def along(cls, places: Sequence[Place], start: float, end: float) -> Path:
        """Along a polyline from `start` to `end` at one speed.

        Raises:
            ValueError: fewer than two places, two equal ones in a row, or an end that is not after the start.
        """
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(places)]
        if not lengths or min(lengths) == 0:
            raise ValueError("Path: expected two places or more, each other than the one before")
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
"""Where a force is: one place, a `Path`, or a function of the time [s]."""


def as_center(name: str, center: Center) -> Center:
    """A center, checked.

    Raises:
        ValueError: not two finite numbers.
    """
    return center if isinstance(center, Path) or callable(center) else place(name, center)


def place_at(center: Center, t: float) -> Place:
    """Where a center is at time t [s].

    Raises:
        ValueError: a function gave no two finite numbers.
    """
    if isinstance(center, Path):
        return center.at(t)
    return place(f"the center at {t:g} s", center(t)) if callable(center) else center


def center_slopes(center: Center, t: float, bar: Place) -> Slopes:
    """The gradient with respect to a center's numbers, from `bar`, that to where it is at time t [s].

    "center" (2,), or "center.places" (k, 2) of a path; a function's numbers are its own.
    """
    if isinstance(center, Path):
        return {"center.places": np.outer(hats(center.times, t), bar)}
    return {} if callable(center) else {"center": np.array(bar, dtype=np.float64)}


def place(name: str, values: Sequence[float]) -> Place:
    """Two finite numbers, as floats.

    Raises:
        ValueError: naming what they are for.
    """
    values = tuple(float(value) for value in values)
    if len(values) != 2:
        raise ValueError(f"{name}: expected two numbers, got {len(values)}")
    for value in values:
        finite(name, value)
    return values
