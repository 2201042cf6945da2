"""Trajectories of points in a run, and its maps at some steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wfluid.domain.timeline import Timeline
from wfluid.model.force import Force
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
    now, then = solver.rest(points), solver.rest(points)
    tracks, found, least, greatest = [now.points], {}, 1.0, 1.0
    for step in range(timeline.steps):
        t, until = timeline.time_of(step), timeline.time_of(step + 1)
        solver.step(now, then, forces, t, timeline.dt, until=until)
        now, then = then, now
        tracks.append(now.points)
        ends_a_frame = bool(maps) and (step + 1) % timeline.steps_per_frame == 0
        if step + 1 not in maps and not ends_a_frame:
            continue
        warp = CoordinateMap.of_state(now, solver.fluid.walls)
        if step + 1 in maps:
            found[step + 1] = warp
        if ends_a_frame:
            quality = measure_map(now, warp)
            least, greatest = min(least, quality.jacobian_min), max(greatest, quality.jacobian_max)
    return np.stack(tracks), found, (least, greatest)
