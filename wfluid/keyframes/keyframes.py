"""Particle keyframes: destinations of points of the picture in time (Bonilla & Velho, section III)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from wfluid.domain.checks import check_number
from wfluid.domain.paths import CONVERSION, Place, check_no_pixels

COINCIDENT = 1e-6
"""Places closer than this are the same [longer side]."""


@dataclass(frozen=True)
class ParticleKeyframe:
    """The destination of a point of the picture at a time; several of one point make a path.

    Raises:
        TypeError: a place, time or weight that is no number.
        ValueError: numbers that are not finite, places that look like pixels, a time or a weight that is not
            positive.
    """

    point: Place
    """Place of the point in the untouched picture [longer side]."""
    destination: Place
    """Its destination [longer side]."""
    time: float
    """Time of arrival [s], after 0."""
    weight: float = 1.0
    """Weight of its misfit in the objective."""

    def __post_init__(self) -> None:
        for name in ("point", "destination"):
            place = _two_numbers(f"ParticleKeyframe.{name}", getattr(self, name))
            if len(place) != 2 or not all(map(math.isfinite, place)):
                raise ValueError(f"ParticleKeyframe.{name} {place}: expected two finite numbers")
            check_no_pixels(f"ParticleKeyframe.{name}", place)
            object.__setattr__(self, name, place)
        for name in ("time", "weight"):
            value = getattr(self, name)
            check_number(f"ParticleKeyframe.{name}", value)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"ParticleKeyframe.{name} {value}: expected a positive number")


def _two_numbers(name: str, given: object) -> Place:
    """A place, whose numbers may be wrong.

    Raises:
        TypeError: something other than numbers.
    """
    try:
        return tuple(float(value) for value in given)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected two numbers x, y, got {given!r}") from None


@dataclass(frozen=True, eq=False)
class PointTarget:
    """A point with its keyframes in order of time."""

    point: Place
    """Place in the untouched picture [longer side]."""
    times: tuple[float, ...]
    """Times of the keyframes [s]."""
    destinations: np.ndarray
    """Destinations [longer side], (keyframes, 2)."""
    weights: tuple[float, ...]
    """Weights of the misfits."""
    pinned: bool = False
    """Whether it should stay in its place all the time."""


def check_time(time: float, end: float) -> None:
    """Check that a keyframe is not after the end [s].

    Raises:
        ValueError: it is.
    """
    if time > end * (1 + 1e-9):
        raise ValueError(f"a keyframe at {time:g} s: expected at most the duration, {end:g} s")


def targets_of(
    keyframes: Sequence[ParticleKeyframe],
    pins: Sequence[Place],
    extent: tuple[float, float],
    end: float,
    side: float = 1.0,
) -> list[PointTarget]:
    """The points of keyframes, and pins, which stay until the last keyframe.

    `side` is the longer side in the unit that messages use.

    Raises:
        ValueError: no keyframes; a place outside the picture; a time after the end; one point sent to two
            places at once, two points to one place at once, or to where a pin is; a point that is pinned
            and moved.
    """
    if not keyframes:
        raise ValueError("no keyframes: say where at least one point should be")
    pins = [_two_numbers("a pin", pin) for pin in pins]
    moved: dict[Place, list[ParticleKeyframe]] = {}
    for keyframe in keyframes:
        for what, place in (("point", keyframe.point), ("destination", keyframe.destination)):
            _check_inside(f"the {what}", place, extent, side)
        check_time(keyframe.time, end)
        moved.setdefault(_known(keyframe.point, moved), []).append(keyframe)
    for pin in pins:
        _check_inside("the pin", pin, extent, side)
        if _known(pin, moved) in moved:
            raise ValueError(f"the point {_shown(pin, side)} is pinned and moved")
    pins = [pin for n, pin in enumerate(pins) if all(math.dist(pin, one) >= COINCIDENT for one in pins[:n])]
    found = [_particle(point, own, side) for point, own in moved.items()]
    _refuse_meetings(found, pins, side)
    times = tuple(sorted({keyframe.time for keyframe in keyframes}))
    weights = (1.0,) * len(times)
    found += [PointTarget(pin, times, np.tile(pin, (len(times), 1)), weights, True) for pin in pins]
    return found


def _check_inside(what: str, place: Place, extent: tuple[float, float], side: float) -> None:
    if not all(0 <= value <= size for value, size in zip(place, extent, strict=True)):
        shown = f"{extent[0] * side:g} x {extent[1] * side:g}"
        unit = f" longer sides: {CONVERSION}" if side == 1 else ""
        raise ValueError(f"{what} {_shown(place, side)} lies outside the picture, {shown}{unit}")


def _known(place: Place, moved: dict[Place, list[ParticleKeyframe]]) -> Place:
    """The known point at this place, or the place itself."""
    return next((other for other in moved if math.dist(place, other) < COINCIDENT), place)


def _particle(point: Place, own: Sequence[ParticleKeyframe], side: float) -> PointTarget:
    own = sorted(own, key=lambda keyframe: keyframe.time)
    for one, other in pairwise(own):
        if one.time == other.time:
            same = math.dist(one.destination, other.destination) < COINCIDENT
            raise ValueError(
                f"the point {_shown(point, side)} has "
                + ("the same keyframe twice" if same else "two destinations")
                + f" at {one.time:g} s"
            )
    return PointTarget(
        point,
        tuple(keyframe.time for keyframe in own),
        np.array([keyframe.destination for keyframe in own]),
        tuple(keyframe.weight for keyframe in own),
    )


def _refuse_meetings(found: Sequence[PointTarget], pins: Sequence[Place], side: float) -> None:
    """No flow brings two points to one place."""
    for one, other in combinations(found, 2):
        for n, time in enumerate(one.times):
            if time not in other.times:
                continue
            place = one.destinations[n]
            if math.dist(place, other.destinations[other.times.index(time)]) < COINCIDENT:
                both = f"{_shown(one.point, side)} and {_shown(other.point, side)}"
                raise ValueError(
                    f"the points {both} have one destination, {_shown(place, side)}, at {time:g} s"
                )
    for one in found:
        for place in one.destinations:
            if any(math.dist(place, pin) < COINCIDENT for pin in pins):
                raise ValueError(
                    f"the point {_shown(one.point, side)} is sent to {_shown(place, side)}, which is pinned"
                )


def _shown(place: Sequence[float], side: float) -> str:
    return f"{place[0] * side:.6g},{place[1] * side:.6g}"
