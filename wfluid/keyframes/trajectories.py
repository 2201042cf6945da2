"""Trajectories of points in a run, and its maps at some steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wfluid.domain.timeline import Timeline
from wfluid.model.force import Force
from wfluid.step.march import march, steps_of
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import measure_map


def trajectories(
    solver: Solver, timeline: Timeline, forces: Sequence[Force], points: np.ndarray, maps: Sequence[int] = ()
) -> tuple[np.ndarray, dict[int, CoordinateMap], tuple[float, float]]:
    """Run an animation from rest and follow points.

    Returns the positions at the start and after every step (steps + 1, n, 2) [longer side], the maps after
    the steps `maps`, and the least and greatest det J over all frames if `maps` are given.
    """
    states = solver.rest(points), solver.rest(points)
    tracks, found, least, greatest = [states[0].points], {}, 1.0, 1.0
    advance = steps_of(solver, timeline, forces)
    for step, (now, _) in enumerate(march(*states, range(timeline.steps), advance), start=1):
        tracks.append(now.points)
        ends_a_frame = bool(maps) and step % timeline.steps_per_frame == 0
        if step not in maps and not ends_a_frame:
            continue
        warp = CoordinateMap.of_state(now, solver.fluid.walls)
        if step in maps:
            found[step] = warp
        if ends_a_frame:
            quality = measure_map(now, warp)
            least, greatest = min(least, quality.jacobian_min), max(greatest, quality.jacobian_max)
    return np.stack(tracks), found, (least, greatest)
