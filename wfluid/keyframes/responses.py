"""How far unit forces move points in a creeping fluid, and what they cost, measured on a coarse grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wfluid.domain.envelopes import Constant
from wfluid.domain.timeline import Timeline
from wfluid.fields.arrays import assign
from wfluid.fields.state import State
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import sample_at
from wfluid.step.solver import Solver

SMOOTH_WITHIN = 0.1
"""Length l of the cost [longer side]: a force of a radius far below l costs more by its density than by the
flow it makes. Among forces with this cost a single arrow gets wide ones, crowded arrows narrow ones."""

SLACK = 1e-6
"""Price of a misfit of weight 1, relative to the mean response: repeated corrections remove the misfit."""

MOVABLE = 1e-3
"""Least response of a point that can be moved, relative to the largest."""

LEAST_VISCOSITY = 1e-9
"""Least viscosity that counts in the mean [longer side^2/s]."""

PROBE = 1e-2
"""Acceleration of a unit force [longer side/s^2]: small, so that points hardly move while it is measured."""


@dataclass(frozen=True, eq=False)
class Responses:
    """What forces do, linearised: a column for each force's x and y."""

    moved: np.ndarray
    """Displacement of every point in a step, x and y, by unit forces [longer side], (2 points, 2 forces)."""
    cost: np.ndarray
    """Matrix of the cost: the dissipation, plus l^2 / mu times the integral of the squared force density."""

    def gentlest(self, moved: np.ndarray, wanted: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The forces of least cost that move points as `wanted`, (2 points,), by the responses `moved`.

        Where no forces achieve that, for points that nearly touch, `weights` (2 points,) share the misfit.
        """
        rows = self.movable
        if not rows.any():
            return np.zeros(moved.shape[1])
        spread = np.linalg.solve(self.cost, moved[rows].T)
        gram = moved[rows] @ spread
        slack = SLACK * np.trace(gram) / len(gram) / weights[rows]
        return spread @ np.linalg.solve(gram + np.diag(slack), wanted[rows])

    @cached_property
    def movable(self) -> np.ndarray:
        """Whether each point can be moved along x and y, (2 points,): not on a wall, nor in a frozen part."""
        reach = np.abs(self.moved).max(axis=1)
        return reach > MOVABLE * reach.max()


class Probe:
    """Measures responses on a coarse grid, in a fluid that moves along with the one on the fine grid."""

    def __init__(self, solver: Solver, timeline: Timeline, radii: Sequence[float], points: np.ndarray):
        """`radii` are the radii of the forces at every point [longer side]."""
        self.solver, self.timeline, self.radii = solver, timeline, radii
        self._rest, self._now, self._next = (solver.rest(points) for _ in range(3))
        grid = solver.grid
        self._u = (np.arange(grid.nx + 1) * grid.hx, (np.arange(grid.ny) + 0.5) * grid.hy)
        self._v = ((np.arange(grid.nx) + 0.5) * grid.hx, np.arange(grid.ny + 1) * grid.hy)
        mu = np.maximum(sample_at(solver.fluid.viscosity, grid, 0.0), LEAST_VISCOSITY)
        self._price = SMOOTH_WITHIN**2 * float(np.mean(1 / mu))

    def measure(self, points: np.ndarray, centers: np.ndarray, step: int) -> Responses:
        """The responses of points (n, 2) to forces around `centers` (n, 2) in a step."""
        grid, radii = self.solver.grid, self.radii
        assign(points[:, 0] / grid.hx, self._now.p_x)
        assign(points[:, 1] / grid.hy, self._now.p_y)
        count = 2 * len(centers) * len(radii)
        rest, _ = self._response((), step)
        moved, flows, shapes = np.empty((2 * len(points), count)), [], []
        column = 0
        for center in centers:
            for radius in radii:
                shape = self._shape(center, radius)
                for axis in (0, 1):
                    vector = (PROBE, 0.0) if axis == 0 else (0.0, PROBE)
                    force = GaussianForce(tuple(center), vector, radius, self._window(step))
                    there, velocity = self._response((force,), step)
                    moved[:, column] = (there - rest) / PROBE
                    flows.append(np.concatenate([f.ravel() for f in velocity]).astype(np.float32))
                    shapes.append((axis, shape[axis]))
                    column += 1
        return Responses(moved, self._cost(flows, shapes))

    def begin(self) -> None:
        """Go back to rest."""
        self._rest.copy_into(self._now)

    def advance(self, forces: Sequence[Force], steps: range) -> None:
        """Take the steps under the forces that were found."""
        for step in steps:
            self._step(self._now, self._next, forces, step)
            self._next.copy_into(self._now)  # not exchanged: a graph is captured for each pair of states

    def _window(self, step: int) -> Constant:
        return Constant(self.timeline.time_of(step), self.timeline.time_of(step + 1))

    def _step(self, now: State, after: State, forces: Sequence[Force], step: int) -> None:
        timeline = self.timeline
        t, until = timeline.time_of(step), timeline.time_of(step + 1)
        self.solver.step(now, after, forces, t, timeline.dt, until=until)

    def _response(self, forces: Sequence[Force], step: int) -> tuple[np.ndarray, tuple]:
        """Places of the points after a step, and its velocity."""
        self._step(self._now, self._next, forces, step)
        return self._next.points.ravel(), self._next.velocity

    def _shape(self, center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """A Gaussian on the x-faces and on the y-faces."""
        found = []
        for x, y in (self._u, self._v):
            across, down = (
                np.exp(-(((s - c) / radius) ** 2) / 2) for s, c in zip((x, y), center, strict=True)
            )
            found.append(np.outer(down, across).astype(np.float32).ravel())
        return found[0], found[1]

    def _cost(self, flows: Sequence[np.ndarray], shapes: Sequence[tuple[int, np.ndarray]]) -> np.ndarray:
        """The matrix of the cost, from the velocity and the shape of each unit force."""
        grid, count = self.solver.grid, len(flows)
        area, split = grid.hx * grid.hy, self._u[0].size * self._u[1].size
        velocity, cost = np.stack(flows) / PROBE, np.zeros((count, count))
        for axis, part in ((0, slice(split)), (1, slice(split, None))):
            own = [n for n, (along, _) in enumerate(shapes) if along == axis]
            density = np.stack([shapes[n][1] for n in own])
            cost[own] += density @ velocity[:, part].T * area
            cost[np.ix_(own, own)] += self._price * (density @ density.T) * area
        cost = (cost + cost.T) / 2
        return cost + 1e-9 * np.trace(cost) / count * np.eye(count)
