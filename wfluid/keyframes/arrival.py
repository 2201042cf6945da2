"""Residuals of keyframes, and the reasons of those that cannot be reached."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.grid import Grid
from wfluid.domain.paths import Place
from wfluid.domain.walls import Wall
from wfluid.keyframes.keyframes import ParticleKeyframe

FROZEN = 0.3
"""Value of a freeze mask above which a point cannot be moved."""


@dataclass(frozen=True, eq=False)
class Arrival:
    """The result for one keyframe of a point."""

    keyframe: ParticleKeyframe
    """Its destination and time."""
    pinned: bool
    """Whether the point is pinned: it should stay in place until the last keyframe."""
    particle: Place
    """Position of the point carried by the flow [longer side]."""
    source: Place
    """Source in the picture that the map has for the destination [longer side]."""
    reason: str = ""
    """Why the keyframe cannot be reached, if known."""

    @property
    def residual(self) -> float:
        """The larger of the particle's distance to the destination and the source's to the point."""
        missed = math.dist(self.particle, self.keyframe.destination)
        return max(missed, math.dist(self.source, self.keyframe.point))

    def describe(self, side: float, *, timed: bool = True) -> str:
        """One line with the way, the residual and the reason, in pixels of a picture `side` pixels long."""
        (x, y), (to_x, to_y) = self.keyframe.point, self.keyframe.destination
        way = f"{x * side:g},{y * side:g}"
        way = f"the pin {way}" if self.pinned else f"{way} to {to_x * side:g},{to_y * side:g}"
        why = f": {self.reason}" if self.reason else ""
        when = f" at {self.keyframe.time:g} s" if timed else ""
        return f"{way}{when}: {self.residual * side:.3g} px away{why}"


def _cell(place: np.ndarray, grid: Grid) -> tuple[int, int]:
    """Row and column of the cell that contains a place."""
    x, y = place / (grid.hx, grid.hy)
    return min(int(y), grid.ny - 1), min(int(x), grid.nx - 1)


def reason_unreached(arrival: Arrival, arrivals: Sequence[Arrival], animation: Animation) -> str:
    """The geometric reason why a keyframe cannot be reached; "" if none is known."""
    grid, fluid = animation.grid, animation.fluid
    point, destination = np.array(arrival.keyframe.point), np.array(arrival.keyframe.destination)
    extent, cell = np.array([grid.width, grid.height]), max(grid.hx, grid.hy)
    if arrival.pinned or np.linalg.norm(destination - point) < cell / 100:
        return ""
    walled = [wall is not Wall.PERIODIC for wall in (fluid.walls.x, fluid.walls.y)]
    near, far = (
        [walled[n] and min(place[n], extent[n] - place[n]) < cell for n in (0, 1)]
        for place in (point, destination)
    )
    if all(near):
        return "it lies in a corner, which the fluid cannot leave"
    for n, wall in enumerate((fluid.walls.x, fluid.walls.y)):
        if wall is Wall.NO_SLIP and near[n]:
            return "it lies on a no-slip wall, where the picture stays"
        if near[n] and not far[n]:
            return "it lies on a wall, along which the fluid can slide but not leave it"
        if far[n] and not near[n]:
            return "its destination lies on a wall, which nothing from within reaches"
    if fluid.freeze is not None and fluid.freeze.paint.sample(grid)[_cell(point, grid)] > FROZEN:
        return "it lies where the picture is frozen"
    for other in arrivals:
        same = other.keyframe.time == arrival.keyframe.time and other is not arrival
        if same and math.dist(other.keyframe.destination, arrival.keyframe.destination) < 2 * cell:
            return "another point has a destination within two cells of its own; use more cells"
    return ""
