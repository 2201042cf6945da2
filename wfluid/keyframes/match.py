"""Particle keyframes: the search for forces that take points of a picture to their destinations in time.

>>> from wfluid import Fluid, read_picture, write_animation
>>> picture = read_picture("examples/images/cat.png")
>>> timeline = Timeline(0.5, fps=12, substeps=4)
>>> animation = Animation(picture, Fluid(viscosity=0.005), [], timeline, cells=32, width=48)
>>> match = match_keyframes(animation, [ParticleKeyframe((0.4, 0.5), (0.45, 0.45), time=0.5)])
>>> match.status
'reached'
>>> write_animation("nose.gif", match.animation.frames(), fps=12)
[PosixPath('nose.gif')]

The paper's third technique (Bonilla & Velho, section III): u holds the strengths, directions and places of
Gaussian forces; phi(u), half the squares of the misfits, is minimised by L-BFGS with the adjoint's gradient.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.grid import Grid
from wfluid.domain.limits import TOLERANCE
from wfluid.domain.paths import Place
from wfluid.domain.timeline import Timeline
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.variables import Free
from wfluid.keyframes.arrival import Arrival, reason_unreached
from wfluid.keyframes.keyframes import ParticleKeyframe, PointTarget, targets_of
from wfluid.keyframes.search import (
    COARSE,
    FINE,
    GridStart,
    Problem,
    Progress,
    Search,
    SearchLog,
    Stopped,
    TimeSpan,
)
from wfluid.keyframes.ways import forces_along, plan_ways, radii_of, window_edges
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, flatten
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.step.diffusion import SURE_TOLERANCE
from wfluid.step.march import march, steps_of
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import measure_map

COARSE_CELLS, CELLS_A_RADIUS = 64, 2.0
"""Least cells of the coarse grid along the longer side, and least cells within the smallest radius."""

FACTORS = (1.0, 1.4, 0.65)
"""Factors on the radii of forces: wide forces deform least, narrow ones separate near points."""

NEARLY_FOLDED = 0.1
"""Least det J below which other radii are tried."""

SPAN_SECONDS = 0.5
"""Length of the spans of time that are searched one after the other; they end at keyframes [s]."""

AIMED = 2
"""Number of corrections of destinations for the residual of the map."""

REACHED, UNREACHABLE, STOPPED = "reached", "unreachable", "stopped"


@dataclass(frozen=True, eq=False)
class Match:
    """The result of a search: forces that take points to their keyframes, and the residuals."""

    animation: Animation
    """The animation with the forces found."""
    found: tuple[GaussianForce, ...]
    """The forces found; the animation has them in addition to its own."""
    arrivals: tuple[Arrival, ...]
    """The results for all keyframes: those of one point together, in the order given, pins last."""
    tracks: np.ndarray
    """Position of each point at the start and after every step [longer side], (steps + 1, points, 2)."""
    jacobian: tuple[float, float]
    """Least and greatest determinant of the map's Jacobian over all frames."""
    tolerance: float
    """Largest residual of a keyframe that counts as reached [longer side]."""
    status: str
    """"reached", "unreachable" or "stopped"."""
    history: tuple[Progress, ...]
    """Progress of the search, an entry for each iteration."""
    evaluations: int
    """Number of gradients computed, on both grids and over spans of any length."""
    seconds: dict[str, float]
    """Time spent [s]: simulation, adjoint, optimiser (with all other host code), total."""

    @property
    def residual(self) -> float:
        """The largest residual [longer side]."""
        return max(arrival.residual for arrival in self.arrivals)

    @property
    def iterations(self) -> int:
        """Iterations of the optimiser, in all stages."""
        return len(self.history)


def match_keyframes(
    animation: Animation,
    keyframes: Sequence[ParticleKeyframe],
    *,
    pins: Sequence[Place] = (),
    free: Sequence[Free] = (),
    start: Sequence[GaussianForce] = (),
    tolerance: float = TOLERANCE,
    seed: int = 0,
    progress: Callable[[Progress], object] = lambda progress: None,
    side: float = 1.0,
    factors: Sequence[float] | None = None,
) -> Match:
    """The forces that take points of an animation's picture to their keyframes.

    The animation's own forces act too. Forces are made for every point, in windows of time along its
    way; or none, if something of the animation's own forces is `free` instead ("forces[0].vector").
    `pins` are points that should stay where they are until the last keyframe.

    `start` are forces found before: points that they already bring home get no further ones; where that
    does not lead to all keyframes, the search begins anew. `seed` chooses on which side points pass one
    another. `progress` is told of every iteration; what it returns, if true, stops the search. Refusals
    speak of lengths in parts of `side`. `factors` on the radii of forces are tried in turn (`FACTORS`). The
    same input and seed give the same bits on a CPU.

    Raises:
        ValueError: keyframes that contradict, see `targets_of`; one that falls between two steps; an
            animation that loops; a tolerance that is not positive.
    """
    began = time.perf_counter()
    if animation.loop is not None:
        raise ValueError(f"a loop ({animation.loop}) goes without keyframes: its end is its beginning")
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance {tolerance}: expected a positive number")
    animation = replace(animation, fluid=_solved_surely(animation.fluid))
    grid, timeline = animation.grid, animation.timeline
    keyframes = [replace(keyframe, time=_snapped(keyframe.time, timeline)) for keyframe in keyframes]
    particles = targets_of(keyframes, pins, (grid.width, grid.height), timeline.end, side)
    for t in sorted({t for particle in particles for t in particle.times}):
        _check_step(t, timeline)
    log = SearchLog(progress)
    best: Match | None = None
    factors = FACTORS if factors is None else factors
    tries = [(factors[0], tuple(start))] if free or start else []
    tries += [] if free else [(factor, ()) for factor in factors]
    graphs = GraphCache()
    for factor, before in tries:
        matcher = _Matcher(animation, particles, free, before, tolerance, seed, factor, log, graphs)
        if (before or _all_stay(particles)) and (
            best := _measured(matcher, False, log, began)
        ).status == REACHED:
            break  # they do it as they are
        try:
            matcher.run()
            stopped = False
        except Stopped:
            stopped = True
        match = _measured(matcher, stopped, log, began)
        if best is None or _rank(match) < _rank(best):
            best = match
        failed = [arrival for arrival in best.arrivals if arrival.residual > tolerance]
        if stopped or not _rank(best)[0] or (failed and all(arrival.reason for arrival in failed)):
            break
    return replace(
        best, history=tuple(log.history), evaluations=log.evaluations, seconds=_seconds(log, began)
    )


def _seconds(log: SearchLog, began: float) -> dict[str, float]:
    """Time spent since the start of the search."""
    total, spent = time.perf_counter() - began, log.seconds
    return {
        "simulation": spent.forward,
        "adjoint": spent.backward,
        "optimiser": total - spent.forward - spent.backward,
        "total": total,
    }


def _all_stay(particles: Sequence[PointTarget]) -> bool:
    """Whether every point should stay where it is."""
    return all(np.all(particle.destinations == particle.point) for particle in particles)


def _rank(match: Match) -> tuple[bool, float]:
    """The order of matches: those that reach all keyframes without nearly folding first, then by residual."""
    return match.status != REACHED or match.jacobian[0] < NEARLY_FOLDED, match.residual


def _solved_surely(fluid: Fluid) -> Fluid:
    """The fluid; if its viscosity moves, with the tolerance of diffusion that gradients need."""
    if not fluid.viscosity_moves:
        return fluid
    return replace(fluid, diffusion_tolerance=min(fluid.diffusion_tolerance, SURE_TOLERANCE))


def _snapped(t: float, timeline: Timeline) -> float:
    """The end of a step, for a time that differs from it by rounding only."""
    end = timeline.time_of(max(1, round(t / timeline.dt)))
    return end if abs(end - t) <= 1e-6 * timeline.dt else t


def _check_step(t: float, timeline: Timeline) -> None:
    if t != timeline.time_of(max(1, round(t / timeline.dt))):
        near = ", ".join(f"{timeline.time_of(int(t / timeline.dt) + n):.6g}" for n in (0, 1))
        raise ValueError(f"a keyframe at {t:g} s falls between two steps, at {near} s")


class _Matcher:
    """One attempt, with one factor on the radii of forces."""

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
        self._searches: list[Search] = []

    @property
    def found(self) -> tuple[GaussianForce, ...]:
        """The forces found so far; the initial ones before the first search."""
        if not self._searches:
            return self._start
        return tuple(force for search in self._searches for force in search.forces)

    def run(self) -> None:
        """Search span after span.

        Raises:
            Stopped: as asked for.
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
        """The edges of windows, cut into spans at keyframes where the time is long."""
        if self._free or self._start:
            return [self._edges]  # forces that may act all the time
        dt = self.animation.timeline.dt
        stops = sorted({round(t / dt) for particle in self.particles for t in particle.times})
        cuts = [0]
        for stop, following in pairwise(stops):
            if (following - cuts[-1]) * dt > SPAN_SECONDS:
                cuts.append(stop)
        cuts.append(stops[-1])
        return [[e for e in self._edges if a <= e <= b] for a, b in pairwise(cuts)]

    def _search(self, edges: list[int], coarse: GridStart, fine: GridStart) -> tuple[GridStart, GridStart]:
        """Search one span; returns the start of the next on both grids."""
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
        """The span with its initial forces: `start`, and new ones for points that those do not take home."""
        forces, windows, owners = list(self._start), [-1] * len(self._start), []
        owners += range(len(self.ways), len(self.ways) + len(self._start))  # chains of their own
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
        """Which points miss their keyframes with the initial forces."""
        solver = Solver(level.grid, scene.fluid, self.animation.solver.device)
        tracks = _tracks(solver, scene.timeline, (*scene.given, *self._start), level.points)[0]
        missing = []
        for n, particle in enumerate(self.particles):
            steps = [round(t / scene.timeline.dt) for t in particle.times]
            residuals = np.linalg.norm(tracks[steps, n] - particle.destinations, axis=1)
            missing.append(bool(residuals.max() > 4 * self.tolerance))
        return missing

    def _aim_for_the_picture(self, search: Search, level: GridStart) -> None:
        """Correct destinations by half the residual of the map, where that exceeds the tolerance.

        Particle and map follow the same flow with different interpolations, so that they differ by a
        discretisation error; an aim in the middle leaves half of it to each.
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
                        by[n] += 0.5 * np.linalg.solve(_slope(warp, place), residual)
            if missed <= self.tolerance:
                return
            search.settle(FINE, level, corrections=corrections)


def _slope(warp: CoordinateMap, place: np.ndarray) -> np.ndarray:
    """The Jacobian of a map at a place, (2, 2): rows are components of the source; one-sided at an edge."""
    grid, step = warp.grid, np.diag([warp.grid.hx, warp.grid.hy])
    ahead, behind = (np.clip(place + by, 0.0, (grid.width, grid.height)) for by in (step, -step))
    return ((warp.source_at(ahead) - warp.source_at(behind)) / np.diag(ahead - behind)[:, None]).T


def _tracks(
    solver: Solver, timeline: Timeline, forces: Sequence[Force], points: np.ndarray, maps: Sequence[int] = ()
) -> tuple[np.ndarray, dict[int, CoordinateMap], tuple[float, float]]:
    """Where points are after every step (steps + 1, n, 2), the map after some of them, and its det J."""
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


def _measured(matcher: _Matcher, stopped: bool, log: SearchLog, began: float) -> Match:
    """Run the animation and measure the residuals of its keyframes."""
    animation, particles = matcher.animation, matcher.particles
    given, found = matcher.given, matcher.found
    timeline = animation.timeline
    moved = replace(animation, forces=(*given, *found))
    steps = sorted({round(t / timeline.dt) for particle in particles for t in particle.times})
    points = np.array([particle.point for particle in particles])
    tracks, maps, jacobian = _tracks(moved.solver, timeline, (*given, *found), points, steps)
    arrivals = []
    for n, particle in enumerate(particles):
        for t, destination, weight in zip(
            particle.times, particle.destinations, particle.weights, strict=True
        ):
            step = round(t / timeline.dt)
            x, y = (float(value) for value in tracks[step, n])
            source = tuple(float(value) for value in maps[step].source_at(destination[None])[0])
            keyframe = ParticleKeyframe(particle.point, tuple(map(float, destination)), t, weight)
            arrivals.append(Arrival(keyframe, particle.pinned, (x, y), source))
    reached = all(arrival.residual <= matcher.tolerance for arrival in arrivals)
    if not reached:
        arrivals = [
            replace(arrival, reason=reason_unreached(arrival, arrivals, animation)) for arrival in arrivals
        ]
    return Match(
        moved,
        found,
        tuple(arrivals),
        tracks,
        jacobian,
        matcher.tolerance,
        REACHED if reached else STOPPED if stopped else UNREACHABLE,
        tuple(log.history),
        log.evaluations,
        _seconds(log, began),
    )
