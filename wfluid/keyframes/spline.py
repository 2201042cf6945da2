"""The gentlest flow through keyframes: a spline of Stokes flows, which needs no search.

In a creeping fluid the displacement of points in a short window of time is linear in the forces of that
window, and later windows do not feel them. So the forces are found window by window: of all forces at the
points that move these by their ways, those of least cost (`responses`), corrected two or three times on the
full grid. Without the part of the cost that smooths it is the field of least dissipation among all that move
the points so, the thin-plate spline's counterpart for fluids. But for errors of the grid it does not fold.
Walls, stiff and frozen parts take part in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.envelopes import Constant
from wfluid.domain.grid import Grid
from wfluid.fields.state import State
from wfluid.keyframes.arrival import FROZEN
from wfluid.keyframes.keyframes import PointTarget
from wfluid.keyframes.responses import Probe
from wfluid.keyframes.search import SPLINE, Progress, SearchLog, Stopped
from wfluid.keyframes.ways import plan_ways, radii_of, spacings, window_edges
from wfluid.model.force import Force, flatten
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.step.march import march, steps_of
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap

WIDEST, NARROWEST = 0.12, 0.012
"""Largest radius of a force, and the least of the narrowest one [longer side]."""

OF_ROOM = 0.3
"""Least radius of a force, as a fraction of the least distance of two ways, or of one to a frozen part."""

ANOTHER = 1.3
"""Least ratio of two radii at one point: nearer ones do nearly the same."""

CELLS_A_RADIUS = 2.0
"""Cells in the least radius, on the animation's grid and on the coarse one."""

CORRECTIONS = 7
"""Most corrections of a window."""

NEAR = 0.1
"""Misfit at which a window's corrections end, as a fraction of the tolerance."""

AIMED = 2
"""Most repetitions with destinations corrected by the residual of the map."""


class Spline:
    """Finds the forces of the gentlest flow; `run` fills `found`."""

    def __init__(
        self,
        animation: Animation,
        particles: Sequence[PointTarget],
        start: tuple[GaussianForce, ...],
        tolerance: float,
        seed: int,
        log: SearchLog,
    ):
        self.animation, self.particles, self.tolerance, self._log = animation, particles, tolerance, log
        grid, timeline = animation.grid, animation.timeline
        self.ways = plan_ways(particles, (grid.width, grid.height), seed)
        radii = radii_of(self.ways)
        self._edges = window_edges(self.ways, radii, timeline)
        self.radii = self._radii()
        self.given: tuple[Force, ...] = flatten(animation.forces)
        self.found = start
        self._points = np.array([particle.point for particle in particles])
        self._corrections: dict[int, np.ndarray] = {}

    given: tuple[Force, ...]
    """The forces of the animation."""
    found: tuple[GaussianForce, ...]
    """The forces found so far."""

    def _radii(self) -> tuple[float, ...]:
        """The radii of the forces at every point, from the widest to the one that the least room needs."""
        animation = self.animation
        room = min(*spacings(self.ways), self._room_within_frozen())
        least = max(OF_ROOM * room, NARROWEST, CELLS_A_RADIUS / animation.cells)
        least = min(least, WIDEST)
        found = [WIDEST, math.sqrt(WIDEST * least), least]
        return tuple(r for n, r in enumerate(found) if n == 2 or r > ANOTHER * found[n + 1])

    def _room_within_frozen(self) -> float:
        """The least distance of a point, or of a destination, to a frozen part [longer side]."""
        grid, freeze = self.animation.grid, self.animation.fluid.freeze
        if freeze is None:
            return math.inf
        rows, columns = np.nonzero(freeze.paint.sample(grid) > FROZEN)
        if not len(rows):
            return math.inf
        frozen = np.stack([(columns + 0.5) * grid.hx, (rows + 0.5) * grid.hy], axis=1)
        places = [place for p in self.particles for place in (p.point, *p.destinations) if not p.pinned]
        return min(float(np.linalg.norm(frozen - place, axis=1).min()) for place in places)

    def run(self) -> None:
        """Find the forces of all windows, and correct the destinations for the residual of the map.

        Raises:
            Stopped: the caller's `progress` stopped the search.
        """
        best: tuple[float, tuple[GaussianForce, ...]] = (math.inf, ())
        states = [self.animation.solver.rest(self._points) for _ in range(4)]
        probe = self._probe()
        try:
            for _ in range(1 + AIMED):
                missed, longest = self._aim(*self._steer(probe, states))
                if missed < best[0]:
                    best = missed, self.found
                if longest <= self.tolerance:
                    break
        finally:  # also where it is stopped within a later pass
            self.found = best[1] or self.found

    def _steer(
        self, probe: Probe, states: Sequence[State]
    ) -> tuple[Mapping[int, CoordinateMap], Mapping[int, np.ndarray]]:
        """Find the forces of all windows; returns the maps and the points at keyframes, by step.

        The first of `states` is at rest and stays so; the others are worked in.
        """
        rest, *states = states
        rest.copy_into(states[0])
        probe.begin()
        keyed, maps, places = set(self._keyed_steps()), {}, {}
        self.found = ()
        for first, last in pairwise(self._edges):
            forces = self._window(probe, states, first, last)
            self.found += forces
            probe.advance((*self.given, *forces), range(first, last))
            if last in keyed:
                maps[last] = CoordinateMap.of_state(states[0], self.animation.fluid.boundary)
                places[last] = states[0].points
        return maps, places

    def _probe(self) -> Probe:
        """The coarse grid's solver, or the animation's where that is as coarse."""
        animation = self.animation
        cells = math.ceil(CELLS_A_RADIUS / self.radii[-1])
        solver = animation.solver
        if cells < animation.cells:
            grid = Grid.for_picture(animation.picture.width, animation.picture.height, cells)
            solver = Solver(grid, animation.fluid, solver.device)
        return Probe(solver, animation.timeline, self.radii, self._points)

    def _window(
        self, probe: Probe, states: Sequence[State], first: int, last: int
    ) -> tuple[GaussianForce, ...]:
        """The forces from step `first` to `last`; takes the first of `states` there."""
        now, *spare = states
        places, end = now.points, self.animation.timeline.time_of(last)
        aims = np.array([way.at(end) for way in self.ways]) + self._corrections.get(last, 0.0)
        centers = (places + aims) / 2
        responses = probe.measure(places, centers, first)
        moved, weights = responses.moved * (last - first), self._weights(end)
        best: tuple[float, np.ndarray] = (math.inf, np.zeros(moved.shape[1]))
        drifted = self._taken(now, spare, (), first, last).points if self.given else places
        before = None
        vectors = responses.gentlest(moved, (aims - drifted).ravel(), weights)
        for n in range(1 + CORRECTIONS):
            forces = self._forces(centers, vectors, first, last)
            misfit = self._taken(now, spare, forces, first, last).points - aims
            movable = np.where(responses.movable.reshape(-1, 2), misfit, 0.0)
            worst = float(np.linalg.norm(movable, axis=1).max())
            missed = float(np.sum(weights * movable.ravel() ** 2))
            if missed < best[0]:
                best = missed, vectors
            self._report(responses.cost, vectors, worst)
            if worst <= NEAR * self.tolerance or n == CORRECTIONS:
                break
            if before is not None:  # Broyden's update, in the norm of the cost
                change = vectors - before[0]
                along = responses.cost @ change
                error = misfit.ravel() - before[1] - moved @ change
                moved = moved + np.outer(error, along) / (change @ along)
            before = vectors, misfit.ravel()
            vectors = vectors - responses.gentlest(moved, misfit.ravel(), weights)
        forces = self._forces(centers, best[1], first, last)
        self._taken(now, spare, forces, first, last).copy_into(now)
        return forces

    def _taken(
        self, now: State, spare: Sequence[State], forces: Sequence[Force], first: int, last: int
    ) -> State:
        """The state after the steps of a window, one of the two `spare`; `now` stays.

        Steps are taken between the two only: a graph is captured for each pair of states.
        """
        begin, other = spare
        now.copy_into(begin)
        advance = steps_of(self.animation.solver, self.animation.timeline, (*self.given, *forces))
        *_, (end, _) = march(begin, other, range(first, last), advance)
        return end

    def _forces(
        self, centers: np.ndarray, vectors: np.ndarray, first: int, last: int
    ) -> tuple[GaussianForce, ...]:
        """The forces of a window: for each point one of every radius."""
        time_of, rows = self.animation.timeline.time_of, iter(vectors.reshape(-1, 2).tolist())
        window = Constant(time_of(first), time_of(last))
        return tuple(
            GaussianForce(tuple(center), tuple(next(rows)), radius, window)
            for center in centers.tolist()
            for radius in self.radii
        )

    def _weights(self, end: float) -> np.ndarray:
        """The weight of each point's x and y: that of its next keyframe, or of its last."""
        found = []
        for particle in self.particles:
            number = min(int(np.searchsorted(particle.times, end - 1e-9)), len(particle.times) - 1)
            found.append(particle.weights[number])
        return np.repeat(found, 2)

    def _report(self, cost: np.ndarray, vectors: np.ndarray, worst: float) -> None:
        """Log a run of a window, and show it.

        Raises:
            Stopped: the caller wants to stop.
        """
        log = self._log
        log.evaluations += 1
        value = 0.5 * float(vectors @ cost @ vectors)
        log.history.append(Progress(SPLINE, len(log.history) + 1, log.evaluations, value, worst))
        if log.heed(log.history[-1]):
            raise Stopped

    def _keyed_steps(self) -> list[int]:
        """The steps that end at keyframes."""
        dt = self.animation.timeline.dt
        return sorted({round(t / dt) for particle in self.particles for t in particle.times})

    def _aim(
        self, maps: Mapping[int, CoordinateMap], places: Mapping[int, np.ndarray]
    ) -> tuple[float, float]:
        """Correct destinations by the residual of the maps.

        Returns the weighted sum of squared residuals, and the longest one [longer side]: of each keyframe the
        larger of the map's and the particle's.

        Particles and map follow the same flow with different interpolations. A target in the middle leaves
        half of their difference to each.
        """
        dt, missed, longest = self.animation.timeline.dt, 0.0, 0.0
        for step, warp in maps.items():
            by = self._corrections.setdefault(step, np.zeros((len(self.particles), 2)))
            for n, particle in enumerate(self.particles):
                steps = [round(t / dt) for t in particle.times]
                if step in steps:
                    place = particle.destinations[steps.index(step)]
                    residual = warp.source_at(place[None])[0] - particle.point
                    off = float(np.linalg.norm(places[step][n] - place))
                    worst = max(off, float(np.linalg.norm(residual)))
                    missed += particle.weights[steps.index(step)] * worst**2
                    longest = max(longest, worst)
                    by[n] += 0.5 * np.linalg.solve(warp.slope_at(place), residual)
        return missed, longest
