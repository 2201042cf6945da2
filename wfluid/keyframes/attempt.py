"""One attempt of a keyframe search: forces with one factor on their radii, searched span by span."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.grid import Grid
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.variables import Free
from wfluid.keyframes.keyframes import PointTarget
from wfluid.keyframes.search import COARSE, FINE, GridStart, Problem, Search, SearchLog, TimeSpan
from wfluid.keyframes.trajectories import trajectories
from wfluid.keyframes.ways import forces_along, plan_ways, radii_of, window_edges
from wfluid.model.force import Force, flatten
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap

COARSE_CELLS, CELLS_A_RADIUS = 64, 2.0
"""Least cells of the coarse grid along the longer side, and least cells within the smallest radius."""

SPAN_SECONDS = 0.5
"""Smallest length of a time span [s]; spans are searched one after the other and end at keyframes."""

AIMED = 2
"""Largest number of corrections of the destinations for the residual of the map."""


class Attempt:
    """A search with one factor on the radii of forces; `run` fills `given` and `found`."""

    def __init__(
        self,
        animation: Animation,
        particles: Sequence[PointTarget],
        free: Sequence[Free],
        start: tuple[GaussianForce, ...],
        tolerance: float,
        seed: int,
        factor: float,
        log: SearchLog,
        graphs: GraphCache,
    ):
        self.animation, self.particles, self.tolerance = animation, particles, tolerance
        self._free, self._start, self._log, self._graphs = free, start, log, graphs
        grid = animation.grid
        self.ways = plan_ways(particles, (grid.width, grid.height), seed)
        self._radii = radii_of(self.ways, factor)
        self._edges = window_edges(self.ways, self._radii, animation.timeline)
        self.given: tuple[Force, ...] = flatten(animation.forces)
        """The forces of the animation, with the free parameters found so far."""
        self._searches: list[Search] = []

    @property
    def found(self) -> tuple[GaussianForce, ...]:
        """The forces found so far; before the first search, the initial forces."""
        if not self._searches:
            return self._start
        return tuple(force for search in self._searches for force in search.forces)

    def run(self) -> None:
        """Search all time spans in order.

        Raises:
            Stopped: the caller's `progress` stopped the search.
        """
        least = min(self._radii)
        points = np.array([particle.point for particle in self.particles])
        cells = min(self.animation.cells, max(COARSE_CELLS, math.ceil(CELLS_A_RADIUS / least)))
        picture = self.animation.picture
        coarse = GridStart(Grid.for_picture(picture.width, picture.height, cells), None, points)
        fine = GridStart(self.animation.grid, None, points)
        for edges in self._spans():
            coarse, fine = self._search(edges, coarse, fine)

    def _spans(self) -> list[list[int]]:
        """The steps at which windows begin and end, for each time span."""
        if self._free or self._start:
            return [self._edges]  # these forces may act at any time
        dt = self.animation.timeline.dt
        stops = sorted({round(t / dt) for particle in self.particles for t in particle.times})
        cuts = [0]
        for stop, following in pairwise(stops):
            if (following - cuts[-1]) * dt > SPAN_SECONDS:
                cuts.append(stop)
        cuts.append(stops[-1])
        return [[e for e in self._edges if a <= e <= b] for a, b in pairwise(cuts)]

    def _search(self, edges: list[int], coarse: GridStart, fine: GridStart) -> tuple[GridStart, GridStart]:
        """Search one time span; returns the start of the next one on both grids."""
        animation = self.animation
        scene = Problem(
            animation.fluid, self.given, self._free, animation.timeline, animation.device, self._graphs
        )
        span = self._span(edges, coarse, scene)
        search = Search(scene, span, self.tolerance, self._log)
        self._searches.append(search)
        try:
            if any(span.guided) and not self._start:
                search.march(coarse)
            if coarse.grid != fine.grid:
                search.settle(COARSE, coarse)
            search.settle(FINE, fine)
            self._aim_for_the_picture(search, fine)
        finally:
            self.given = search.given
        last = edges[-1] == self._edges[-1]
        return (coarse, fine) if last else (search.after(coarse), search.after(fine))

    def _span(self, edges: list[int], level: GridStart, scene: Problem) -> TimeSpan:
        """A time span with its initial forces: `start`, and new ones for points that miss their keyframes."""
        forces, windows, owners = list(self._start), [-1] * len(self._start), []
        owners += range(len(self.ways), len(self.ways) + len(self._start))  # a separate chain for each
        guided = [not self._free] * len(self.ways)
        if self._start:
            guided = self._missing(level, scene)
        for n, (way, radius) in enumerate(zip(self.ways, self._radii, strict=True)):
            if guided[n]:
                for window, force in forces_along(way, radius, edges, scene.timeline):
                    windows.append(window)
                    forces.append(force)
                    owners.append(n)
        return TimeSpan(self.ways, edges, forces, windows, owners, guided)

    def _missing(self, level: GridStart, scene: Problem) -> list[bool]:
        """Whether each point misses its keyframes with the initial forces."""
        solver = Solver(level.grid, scene.fluid, self.animation.solver.device)
        tracks = trajectories(solver, scene.timeline, (*scene.given, *self._start), level.points)[0]
        missing = []
        for n, particle in enumerate(self.particles):
            steps = [round(t / scene.timeline.dt) for t in particle.times]
            residuals = np.linalg.norm(tracks[steps, n] - particle.destinations, axis=1)
            missing.append(bool(residuals.max() > 4 * self.tolerance))
        return missing

    def _aim_for_the_picture(self, search: Search, level: GridStart) -> None:
        """Correct destinations by half the residual of the map, if that exceeds the tolerance.

        Particles and map follow the same flow with different interpolations, and differ by a discretisation
        error. A target in the middle leaves half of the error to each.
        """
        dt, time_of = self.animation.timeline.dt, self.animation.timeline.time_of
        corrections: dict[float, np.ndarray] = {}
        for _ in range(AIMED):
            missed = 0.0
            for step in search.keyed_steps:
                state = search.after(level, step).begin[1]
                warp = CoordinateMap.of_state(state, self.animation.fluid.walls)
                by = corrections.setdefault(time_of(step), np.zeros((len(self.particles), 2)))
                for n, particle in enumerate(self.particles):
                    steps = [round(t / dt) for t in particle.times]
                    if step in steps:
                        place = particle.destinations[steps.index(step)]
                        residual = warp.source_at(place[None])[0] - particle.point
                        missed = max(missed, float(np.linalg.norm(residual)))
                        by[n] += 0.5 * np.linalg.solve(warp.slope_at(place), residual)
            if missed <= self.tolerance:
                return
            search.settle(FINE, level, corrections=corrections)
