"""A flow's maps between any of its times and its two ends.

The solver itself carries the map to the start. The map to the end is computed backward: the displacement to
the end is carried against each step's own velocity, from the last step to the first. Both use the same
velocities and the same scheme, so that one map inverts the other up to interpolation errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import clone, copy
from wfluid.fields.state import State
from wfluid.model.force import Force
from wfluid.step.march import march, steps_of
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap


@dataclass(frozen=True, eq=False)
class FlowMaps:
    """Maps of a flow to its start and to its end, at every step."""

    grid: Grid
    """The grid of the maps."""
    walls: Walls
    """The walls, which say how the maps continue beyond the edges."""
    from_start: np.ndarray
    """Place at the start minus the place itself [longer side], (steps + 1, ny, nx, 2), float32."""
    to_end: np.ndarray
    """Place at the end minus the place itself, the same."""

    def since_start(self, part: float | np.ndarray) -> CoordinateMap:
        """The map to the start after a fraction of the time, 0 … 1: one number, or (ny, nx)."""
        return CoordinateMap(self.grid, self.walls, _between(self.from_start, part))

    def until_end(self, part: float | np.ndarray) -> CoordinateMap:
        """The map to the end after a fraction of the time, 0 … 1: one number, or (ny, nx)."""
        return CoordinateMap(self.grid, self.walls, _between(self.to_end, part))

    def inconsistency(self) -> np.ndarray:
        """Distance from each cell's centre to its image under both maps [longer side], (ny, nx)."""
        there, back = self.until_end(0.0), self.since_start(1.0)
        ends = there.source_of.reshape(-1, 2)
        extent = np.array([self.grid.width, self.grid.height])
        inside = np.where(self.walls.periodic, ends % extent, np.clip(ends, 0.0, extent))
        again = back.source_at(inside) - inside + ends
        start = there.source_of - there.displacement
        return np.linalg.norm(again.reshape(start.shape) - start, axis=2)


def _between(maps: np.ndarray, part: float | np.ndarray) -> np.ndarray:
    """The displacement after a fraction of the time, interpolated linearly between steps."""
    steps = len(maps) - 1
    at = np.clip(np.asarray(part, dtype=np.float64), 0.0, 1.0) * steps
    step = np.minimum(at.astype(int), steps - 1)
    rest = (at - step)[..., None].astype(maps.dtype)
    if step.ndim == 0:
        before, after = maps[step], maps[step + 1]
    else:
        rows, columns = np.indices(step.shape)
        before, after = maps[step, rows, columns], maps[step + 1, rows, columns]
    return (1 - rest) * before + rest * after


def flow_maps(solver: Solver, forces: Sequence[Force], timeline: Timeline) -> FlowMaps:
    """Run a flow from rest, and back: its maps after every step."""
    walls, steps = solver.fluid.walls, range(timeline.steps)
    shape = (timeline.steps + 1, solver.grid.ny, solver.grid.nx, 2)
    from_start, to_end = (np.zeros(shape, dtype=np.float32) for _ in range(2))
    velocities = []
    forward = steps_of(solver, timeline, forces)

    def there(now: State, then: State, step: int) -> None:
        forward(now, then, step)
        mover = then if solver.transports_with_new_velocity else now
        velocities.append([clone(f) for f in (mover.u, mover.v)])

    def back(now: State, then: State, step: int) -> None:
        for f, kept in zip((now.u, now.v), velocities.pop(), strict=True):
            copy(kept, f)
        solver.carry(now, then, -timeline.dt)

    for step, (now, _) in zip(steps, march(solver.rest(), solver.rest(), steps, there), strict=True):
        from_start[step + 1] = CoordinateMap.of_state(now, walls).displacement
    if not np.all(np.isfinite(from_start[-1])):
        raise FloatingPointError("the flow is no longer finite; use smaller forces or more steps")
    backward = steps[::-1]
    for step, (now, _) in zip(backward, march(solver.rest(), solver.rest(), backward, back), strict=True):
        to_end[step] = CoordinateMap.of_state(now, walls).displacement
    return FlowMaps(solver.grid, walls, from_start, to_end)
