"""Cases of keyframe tests: points, destinations and fluids."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from viscous_media import disc

from wfluid import Animation, Fluid, GaussianForce, Grid, Timeline
from wfluid.gradient.variables import Free
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.keyframes.match import Match, match_keyframes
from wfluid.pictures.picture import Picture

SIDE = 512
"""Longer side of the pictures [px], in which residuals are given."""

FPS, SUBSTEPS = 24, 2


@dataclass(frozen=True, kw_only=True)
class Case:
    """Arrows of one duration, or keyframes with times, in a fluid."""

    arrows: Sequence[tuple] = ()
    """Points and their destinations at the end."""
    paths: Sequence[tuple] = ()
    """Points and their destinations by time."""
    pins: Sequence[tuple] = ()
    fluid: dict = field(default_factory=dict)
    forces: Sequence[GaussianForce] = ()
    free: Sequence[Free] = ()
    cells: int = 64
    duration: float = 0.5
    fps: float = FPS
    height: int = SIDE

    def animation(self, device):
        """The animation without the forces to be found."""
        picture = Picture(np.zeros((self.height, SIDE, 3), np.float32))
        fluid = Fluid(**{"viscosity": 0.005, **self.fluid})
        timeline = Timeline(self.duration, self.fps, SUBSTEPS)
        return Animation(picture, fluid, self.forces, timeline, cells=self.cells, device=device)

    @property
    def keyframes(self):
        """All keyframes, without pins."""
        found = [ParticleKeyframe(point, to, self.duration) for point, to in self.arrows]
        for point, stops in self.paths:
            found += [ParticleKeyframe(point, to, time) for time, to in stops.items()]
        return found

    def match(self, device="cpu", **settings) -> Match:
        """The result of the search."""
        return match_keyframes(
            self.animation(device), self.keyframes, pins=self.pins, free=self.free, side=SIDE, **settings
        )


def scattered(count, spacing, seed, margin=0.1):
    """Arrows from random points with a least distance, no longer than half the distance to the next point."""
    rng = np.random.default_rng(seed)
    points = []
    while len(points) < count:
        place = rng.uniform(margin, 1 - margin, 2)
        if all(math.dist(place, other) >= spacing for other in points):
            points.append(place)
    arrows = []
    for place in points:
        room = min(math.dist(place, other) for other in points if other is not place)
        angle, length = rng.uniform(0, 2 * math.pi), rng.uniform(0.2, 0.5) * room
        to = place + length * np.array([math.cos(angle), math.sin(angle)])
        arrows.append((tuple(place), tuple(np.clip(to, 0.05, 0.95))))
    return arrows


def around(place, distance, count=4):
    """Places on a circle."""
    angles = 2 * math.pi * (np.arange(count) + 0.5) / count
    return [(place[0] + distance * math.cos(a), place[1] + distance * math.sin(a)) for a in angles]


def honey(contrast):
    """A painted disc of higher viscosity."""
    return np.where(disc(Grid(128, 128), 0.45, 0.5, 0.12), 0.002 * contrast, 0.002)


ARROW = ((0.4, 0.5), (0.5, 0.42))
BESIDE = ((0.62, 0.58), (0.58, 0.5))
PAIR = (ARROW, ((0.66, 0.6), (0.6, 0.7)))

CASES = {
    "one arrow": Case(arrows=[ARROW]),
    "a smile": Case(
        arrows=[
            ((0.38, 0.62), (0.34, 0.57)),
            ((0.5, 0.66), (0.5, 0.69)),
            ((0.62, 0.62), (0.66, 0.57)),
        ]
    ),
    "crossing": Case(arrows=[((0.38, 0.5), (0.6, 0.5)), ((0.54, 0.66), (0.44, 0.4))], cells=128),
    "opposite, side by side": Case(
        arrows=[((0.37, 0.44), (0.63, 0.44)), ((0.63, 0.56), (0.37, 0.56))], cells=96
    ),
    "a swap": Case(arrows=[((0.41, 0.5), (0.59, 0.5)), ((0.59, 0.5), (0.41, 0.5))], cells=128),
    "twenty at random": Case(arrows=scattered(20, 0.13, 7), cells=128),
    "a third of the picture": Case(arrows=[((0.3, 0.52), (0.3 + 1 / 3, 0.47))], cells=96),
    "pins around": Case(arrows=[((0.5, 0.5), (0.54, 0.47))], pins=around((0.5, 0.5), 0.12), duration=1.0),
    "a path, one pinned": Case(
        paths=[((0.4, 0.45), {0.25: (0.46, 0.4), 0.5: (0.53, 0.43)})], pins=[(0.66, 0.6)]
    ),
    "a stiff disc": Case(arrows=[((0.42, 0.5), (0.48, 0.46))], fluid={"viscosity": honey(50)}),
    "a stiff disc that moves": Case(
        arrows=[((0.42, 0.5), (0.48, 0.46))], fluid={"viscosity": honey(50), "viscosity_moves": True}
    ),
    "no-slip": Case(arrows=PAIR, fluid={"walls": "no-slip"}),
    "periodic": Case(arrows=PAIR, fluid={"walls": "periodic"}),
    "periodic and no-slip": Case(arrows=PAIR, fluid={"walls": "periodic,no-slip"}),
    "not square": Case(arrows=[((0.4, 0.3), (0.5, 0.24)), ((0.66, 0.36), (0.6, 0.44))], height=320),
    "the user's own forces": Case(
        arrows=[ARROW],
        forces=[GaussianForce((0.42, 0.48), (1.0, 0.0), 0.1), GaussianForce((0.7, 0.7), (0.5, 1.0), 0.08)],
        free=[Free("forces[0].vector"), Free("forces[0].center", 0.1)],
    ),
    "a long scene": Case(
        paths=[
            ((0.4, 0.5), {2.0: (0.5, 0.42), 4.0: (0.6, 0.5), 5.5: (0.52, 0.58)}),
            ((0.7, 0.3), {2.0: (0.65, 0.25), 5.5: (0.7, 0.36)}),
        ],
        duration=5.5,
        fps=12,
    ),
}
