"""The start of a keyframe search: ways that keep apart, and forces along them.

A point's way is a straight line, bent to one side where it would come near another way or a wall. Without
the bend, two points that change places could pass each other on either side, and the gradient between the two
is 0. Forces are Gaussians at the expected positions of the points, in windows of time that all points share,
as wide as the distance of the points allows: wide forces deform the picture least.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wfluid.domain.envelopes import Constant
from wfluid.domain.timeline import Timeline
from wfluid.keyframes.keyframes import PointTarget
from wfluid.model.gaussian_forces import GaussianForce

BENDS = (0.0, 0.1, 0.25, 0.4, 0.55, 0.7)
"""Bends that are tried, as fractions of a way's length; the least that keeps ways apart is taken."""

APART = 0.75
"""Distance that ways should keep, as a fraction of their distance at the ends."""

WALL_ROOM = 0.01
"""Added to distances from walls [longer side], so that ways of points near a wall may come nearer to it."""

WIDEST, NARROWEST = 0.12, 0.006
"""Radii of forces [longer side]."""

OF_SPACING = 0.5
"""Radius of a force, as a fraction of the least distance to another point's way."""

LEAST_WINDOWS = 5
"""Least number of windows until the last keyframe."""

LEAST_STEPS = 2
"""Least number of steps of a window."""

SAMPLES = 33
"""Number of times between two keyframes at which ways are compared."""


@dataclass(frozen=True, eq=False)
class Way:
    """The planned way of a particle."""

    particle: PointTarget
    """The particle and its keyframes."""
    bend: float
    """Bend to the left, as a fraction of the distance between two keyframes."""

    def at(self, t: float | np.ndarray) -> np.ndarray:
        """Planned position at a time [longer side], (…, 2); after the last keyframe, its destination."""
        t = np.asarray(t, dtype=np.float64)
        out = np.broadcast_to(self.particle.point, (*t.shape, 2)).copy()
        for n, (start, end, a, b) in enumerate(self._legs()):
            part = np.clip((t - start) / (end - start), 0, 1)
            if n == 0:
                part = part * part * (2 - part)  # it begins at rest
            d = b - a
            aside = 4 * part * (1 - part) * self.bend
            place = a + part[..., None] * d + aside[..., None] * np.array([d[1], -d[0]])
            out = np.where((t >= start)[..., None], place, out)
        return out

    def length(self, start: float, end: float) -> float:
        """Length between two times [longer side]."""
        places = self.at(np.linspace(start, end, SAMPLES))
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())

    def _legs(self) -> Iterator[tuple[float, float, np.ndarray, np.ndarray]]:
        """From keyframe to keyframe: start and end [s], places there [longer side]."""
        own = self.particle
        stops = [(0.0, np.array(own.point)), *zip(own.times, own.destinations, strict=True)]
        for (start, a), (end, b) in pairwise(stops):
            yield start, end, a, b


def plan_ways(particles: Sequence[PointTarget], extent: tuple[float, float], seed: int) -> list[Way]:
    """Ways that keep apart from one another and from walls, as far as bends achieve that.

    The seed chooses the side to bend to, if both are equally good.
    """
    side = 1.0 if np.random.default_rng(seed).random() < 0.5 else -1.0
    best, widest = [], -math.inf
    for bend in BENDS:
        for sign in (side, -side):
            ways = [Way(particle, sign * bend) for particle in particles]
            room = _room(ways, extent)
            if room > widest + 0.02:
                best, widest = ways, room
            if widest >= APART:
                return best
    return best


def _room(ways: Sequence[Way], extent: tuple[float, float]) -> float:
    """The least distance between two ways at one time, or to walls, relative to that at their ends."""
    times, room = _moments(ways), 1.0
    places = [way.at(times) for way in ways]
    stops = [np.searchsorted(times, [0.0, *way.particle.times]) for way in ways]
    for n, own in enumerate(places):
        inside = np.minimum(own, np.array(extent) - own).min(axis=1) + WALL_ROOM
        room = min(room, inside.min() / inside[stops[n]].min())
        for m in range(n):
            distance = np.linalg.norm(own - places[m], axis=1)
            at_ends = min(distance[stops[n]].min(), distance[stops[m]].min())
            room = min(room, distance.min() / max(at_ends, 1e-9))
    return room


def _moments(ways: Sequence[Way]) -> np.ndarray:
    """Times of all keyframes, and some between."""
    stops = sorted({0.0, *(t for way in ways for t in way.particle.times)})
    return np.unique(np.concatenate([np.linspace(a, b, SAMPLES) for a, b in pairwise(stops)]))


def radii_of(ways: Sequence[Way], factor: float = 1.0) -> list[float]:
    """The radius of each way's forces [longer side], times a factor within the limits."""
    return [min(WIDEST, max(NARROWEST, factor * OF_SPACING * spacing)) for spacing in spacings(ways)]


def spacings(ways: Sequence[Way]) -> list[float]:
    """The least distance of each way to another one at one time [longer side]."""
    times = _moments(ways)
    places = [way.at(times) for way in ways]
    found = []
    for n, own in enumerate(places):
        others = [np.linalg.norm(own - other, axis=1).min() for m, other in enumerate(places) if m != n]
        found.append(float(min(others, default=math.inf)))
    return found


def window_edges(ways: Sequence[Way], radii: Sequence[float], timeline: Timeline) -> list[int]:
    """The steps at which windows begin and end: at keyframes, and between them about a radius apart."""
    times = sorted({t for way in ways for t in way.particle.times})
    stops = [0, *(round(t / timeline.dt) for t in times)]
    edges = [0]
    for first, last in pairwise(stops):
        count = LEAST_WINDOWS * (last - first) / stops[-1]
        for way, radius in zip(ways, radii, strict=True):
            length = way.length(timeline.time_of(first), timeline.time_of(last))
            count = max(count, length / radius)
        count = max(1, min(math.ceil(count - 1e-6), (last - first) // LEAST_STEPS))
        edges += [round(edge) for edge in np.linspace(first, last, count + 1)[1:]]
    return edges


def forces_along(
    way: Way, radius: float, edges: Sequence[int], timeline: Timeline
) -> Iterator[tuple[int, GaussianForce]]:
    """A force without strength for each window until a way's end, with the window's number."""
    for window, (first, last) in enumerate(pairwise(edges)):
        start, end = timeline.time_of(first), timeline.time_of(last)
        if start >= way.particle.times[-1] - 0.5 * timeline.dt:
            return
        x, y = way.at((start + end) / 2)
        yield window, GaussianForce((float(x), float(y)), (0.0, 0.0), radius, Constant(start, end))
