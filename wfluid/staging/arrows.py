"""The arrows that a scene draws: how far its forces and keyframes should carry the picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from wfluid.scene.forces import ForceTable, PushTable, StrokeTable, WindTable
from wfluid.scene.scene import Scene
from wfluid.staging.aims import Aims


def longest_arrow(scene: Scene, side: float, aims: Aims | None) -> float | None:
    """The longest arrow of a scene, whose longer side is `side` pixels, and of its keyframes [longer side].

    An arrow of a force counts times its strength and that of its group. None if a force without an arrow acts
    too, such as a vortex, or if nothing has one.
    """
    strengths = {group.name: group.strength for group in scene.groups}
    arrows = []
    for force in scene.forces:
        length = _length(force)
        if length is None:
            return None
        arrows.append(length * abs(force.strength * strengths.get(force.group or "", 1.0)) / side)
    return max([*arrows, *_ways(aims)], default=None)


def _length(force: ForceTable) -> float | None:
    """The length of a drawn arrow or line [px]; None if a force has none."""
    match force:
        case PushTable() | WindTable():
            return math.hypot(*force.by)
        case StrokeTable():
            points = force.points or [row[1:] for row in force.path or ()]
            return sum(math.dist(a, b) for a, b in pairwise(points))
    return None


def _ways(aims: Aims | None) -> Iterator[float]:
    """The ways of keyframes from their points to their destinations [longer side]."""
    for keyframe in aims.keyframes if aims else ():
        yield math.dist(keyframe.point, keyframe.destination)
