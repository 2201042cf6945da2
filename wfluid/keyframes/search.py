"""The search for the forces that take particles to their keyframes.

It minimises phi (`way_misfit`) + weight (effort + smoothness). Effort is half the integral of |f|^2,
divided by that of a typical force. Smoothness is half the sum of squared changes of strength and centre,
from each force to the next one of its point, in units of what moves a point by a radius. Both keep points
slightly away from their keyframes; multipliers remove that misfit, and where they converge too slowly the
weight is lowered.

The search has three stages. The march, on a coarse grid, finds forces window by window, together with the
next window, that keep the points on their ways: one search over all windows would start from a flow that it
does not know yet. Then all windows are optimised together on the coarse grid, for the keyframes alone. Last,
a few evaluations on the full grid are enough. Long timelines are cut at keyframes into spans; each begins
with the fluid at the end of the one before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.fields.state import State
from wfluid.gradient.functional import EvaluationTimes, Functional
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.objectives import Effort
from wfluid.gradient.variables import Free
from wfluid.keyframes.way_misfit import NOTHING, WayMisfit, longest
from wfluid.keyframes.ways import Way
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.optimize.lbfgs import Iterate, minimise
from wfluid.optimize.settings import Settings

MARCH, COARSE, FINE = "march", "coarse", "fine"
"""Stages of a search."""

SPLINE = "spline"
"""The stage of a creeping fluid's keyframes (`spline`)."""

MARCH_WEIGHT, WEIGHT = 1e-3, 1e-4
"""Weight of effort and smoothness: in the march, and then to begin with."""

LOWER, LEAST_WEIGHT = 0.1, 1e-8
"""The factor that lowers the weight, and the least weight."""

EVALUATIONS = {MARCH: 25, COARSE: 30, FINE: 15}
"""Largest number of evaluations of a minimisation; a march has one minimisation for each window."""

CHANGE = {MARCH: 1e-2, COARSE: 1e-3, FINE: 1e-3}
"""Relative decrease at which a minimisation ends."""

ROUNDS = {COARSE: 12, FINE: 8}
"""Largest number of minimisations of a stage."""

NEAR = {COARSE: 0.5, FINE: 0.4}
"""Misfit of keyframes at which a stage ends, as a fraction of the tolerance; not for a march."""

NEAR_ENOUGH = 0.5
"""Misfit at which the weight is not lowered, as a fraction of the tolerance."""

NOISE = 1e-6
"""Relative noise of values computed in single precision."""

MEMORY = 20
"""Number of pairs in the optimiser's memory: their cost is small beside that of a run."""


@dataclass(frozen=True)
class Progress:
    """Progress of a search."""

    stage: str
    """"march", "coarse", "fine" or "spline"."""
    iteration: int
    """Iterations so far, of all stages."""
    evaluations: int
    """Runs with their gradients so far."""
    value: float
    """The objective of this stage: phi, with weighted effort and smoothness."""
    worst: float
    """Longest misfit of a keyframe within the time of this minimisation [longer side]."""


class Stopped(Exception):
    """The search was stopped by the caller; it keeps its best forces."""


@dataclass
class SearchLog:
    """Iterations, evaluations and times of a search."""

    heed: Callable[[Progress], object] = lambda progress: None
    """Called after every iteration; a true result stops the search."""
    history: list[Progress] = field(default_factory=list)
    """Every iteration."""
    evaluations: int = 0
    """Runs with their gradients."""
    seconds: EvaluationTimes = field(default_factory=EvaluationTimes)
    """Time spent on them."""


@dataclass(frozen=True, eq=False)
class TimeSpan:
    """A span of time between keyframes, with its own forces."""

    ways: Sequence[Way]
    """Planned ways of all points."""
    edges: Sequence[int]
    """Steps at which its windows begin and end."""
    forces: Sequence[GaussianForce]
    """The forces to begin with, point by point, in the order of their windows."""
    windows: Sequence[int]
    """Index of the window of each force; -1 for forces that a march does not change."""
    owners: Sequence[int]
    """Index of the point of each force."""
    guided: Sequence[bool]
    """Whether each point is guided along its way in a march."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Everything that all spans share: fluid, given forces, timeline, device."""

    fluid: Fluid
    """The fluid."""
    given: Sequence[Force]
    """The user's forces."""
    free: Sequence[Free]
    """Parameters of the user's forces that may vary."""
    timeline: Timeline
    """The timeline of the animation."""
    device: str | None
    """Name of the device."""
    graphs: GraphCache
    """Captured graphs, which each minimisation reuses from the previous one."""


@dataclass(frozen=True, eq=False)
class GridStart:
    """A grid, and the fluid on it at the beginning of a span."""

    grid: Grid
    """The grid."""
    begin: tuple[float, State] | None
    """Time at which the span begins [s] and the state then; None at rest."""
    points: np.ndarray
    """Positions of the points then [longer side], (n, 2)."""


class Search:
    """The search for the forces of one span.

    `given` and `forces` are the best forces so far, however the search ends.
    """

    def __init__(self, scene: Problem, span: TimeSpan, tolerance: float, log: SearchLog):
        self._scene, self._span, self._tolerance, self._log = scene, span, tolerance, log
        self.given, self.forces = tuple(scene.given), tuple(span.forces)
        self._time_of = scene.timeline.time_of
        self._unit = float(np.mean([force.radius for force in span.forces])) if span.forces else 0.05
        self._scales = [self._scale(force) for force in span.forces]
        typical = [
            0.5 * scale**2 * math.pi * force.radius**2 * (force.envelope.end - force.envelope.start)
            for scale, force in zip(self._scales, span.forces, strict=True)
        ]
        self._typical_effort = float(np.mean(typical)) if typical else 1.0
        self._weight = WEIGHT
        self._multipliers: dict[float, np.ndarray] = {}

    given: tuple[Force, ...]
    """The user's forces."""
    forces: tuple[GaussianForce, ...]
    """The forces that are searched for."""

    @staticmethod
    def _scale(force: GaussianForce) -> float:
        """The strength that moves a point by a radius within two windows; projection removes half of it."""
        window = force.envelope.end - force.envelope.start
        return 2 * force.radius / window**2

    def march(self, level: GridStart) -> None:
        """Find forces that keep the points on their ways, window by window."""
        edges, windows = self._span.edges, self._span.windows
        for first in range(len(edges) - 1):
            last = min(first + 2, len(edges) - 1)
            near = [n for n, window in enumerate(windows) if first <= window < last]
            if not near:
                return
            free = [Free(self._name(n, "vector"), self._scales[n]) for n in near]
            self._minimise(MARCH, level, (edges[first], edges[last]), free)
            if first + 2 < len(edges):
                level = self.after(level, edges[first + 1])

    def settle(
        self, stage: str, level: GridStart, corrections: Mapping[float, np.ndarray] = NOTHING
    ) -> float:
        """Minimise over all windows; returns the longest misfit of a keyframe [longer side].

        After each minimisation the misfits are subtracted from the aims: the method of multipliers (Nocedal &
        Wright, 17.3). If that does not halve the longest misfit, the weight is lowered too. `corrections` are
        added to the destinations of keyframes, by time, (n, 2) [longer side].
        """
        edges, before = self._span.edges, math.inf
        for _ in range(ROUNDS[stage]):
            worst, misfits = self._minimise(
                stage, level, (edges[0], edges[-1]), self._all_free(), corrections
            )
            if worst <= NEAR_ENOUGH * self._tolerance:
                break
            lower = 1.0 if worst < 0.5 * before else LOWER
            if self._weight * lower < LEAST_WEIGHT:
                break
            self._weight, before = self._weight * lower, worst
            for t, by in misfits.items():
                self._multipliers[t] = (self._multipliers.get(t, 0.0) - by) * lower
        return worst

    def after(self, level: GridStart, step: int | None = None) -> GridStart:
        """The fluid and the points at the end of the span, or at a step."""
        step = self._span.edges[-1] if step is None else step
        misfit = WayMisfit(self._span.ways, level.points, [self._time_of(step)], self._unit)
        functional = self._functional(level, step, misfit, self._all_free(), self._weight)
        state = functional.state_after(functional.start)
        return GridStart(level.grid, (self._time_of(step), state), state.points)

    @property
    def keyed_steps(self) -> list[int]:
        """The span's steps that end at keyframes."""
        edges, dt = self._span.edges, self._scene.timeline.dt
        steps = {round(t / dt) for way in self._span.ways for t in way.particle.times}
        return sorted(step for step in steps if edges[0] < step <= edges[-1])

    def _name(self, n: int, key: str) -> str:
        return f"forces[{len(self._scene.given) + n}].{key}"

    def _all_free(self) -> list[Free]:
        found = list(self._scene.free)
        for n, (force, scale) in enumerate(zip(self.forces, self._scales, strict=True)):
            found += [Free(self._name(n, "vector"), scale), Free(self._name(n, "center"), force.radius)]
        return found

    def _functional(
        self, level: GridStart, last: int, misfit: WayMisfit, free: Sequence[Free], weight: float
    ) -> Functional:
        scene, edges = self._scene, self._span.edges
        return Functional(
            level.grid,
            scene.fluid,
            (*self.given, *self.forces),
            scene.timeline,
            misfit + (weight / self._typical_effort) * Effort(),
            free,
            begin=level.begin,
            end=self._time_of(last),
            device=scene.device,
            graphs=scene.graphs,
            room=self._time_of(edges[-1]) - self._time_of(edges[0]),
        )

    def _moments(self, first: int, last: int) -> list[float]:
        """Times at which misfits count: keyframes, and ends and middles of windows between them."""
        edges = self._span.edges
        steps = {*edges, *((a + b) // 2 for a, b in pairwise(edges)), *self.keyed_steps}
        return [self._time_of(step) for step in sorted(steps) if first < step <= last]

    def _minimise(
        self,
        stage: str,
        level: GridStart,
        steps: tuple[int, int],
        free: Sequence[Free],
        corrections: Mapping[float, np.ndarray] = NOTHING,
    ) -> tuple[float, Mapping[float, np.ndarray]]:
        """Minimise over the free parameters, keep the best point; returns the longest and all misfits."""
        log, span = self._log, self._span
        moments, marches = self._moments(*steps), stage == MARCH
        guided = span.guided if marches else ()
        multipliers, weight = (NOTHING, MARCH_WEIGHT) if marches else (self._multipliers, self._weight)
        misfit = WayMisfit(span.ways, level.points, moments, self._unit, guided, corrections, multipliers)
        functional = self._functional(level, steps[1], misfit, free, weight)
        smooth = Smoothness(self._chains(functional), weight)
        done, stopped = log.evaluations, False

        def evaluate(m: np.ndarray) -> tuple[float, np.ndarray, Mapping[float, np.ndarray]]:
            try:
                found = functional.evaluate(m)
            except ValueError as error:  # a force beyond the limit
                raise FloatingPointError(str(error)) from error
            return *smooth.added(found.value, found.gradient, m), misfit.misfits(found.places)

        def heed(at: Iterate) -> bool:
            nonlocal stopped
            log.evaluations = done + at.evaluations
            (misfits,) = at.point.details
            progress = Progress(stage, len(log.history) + 1, log.evaluations, at.value, longest(misfits))
            log.history.append(progress)
            stopped = bool(log.heed(progress))
            near = not marches and progress.worst <= NEAR[stage] * self._tolerance
            return stopped or near

        settings = Settings(
            memory=MEMORY,
            gradient_tolerance=0.0,
            change_tolerance=CHANGE[stage],
            evaluations=EVALUATIONS[stage],
            noise=NOISE,
        )
        minimum = minimise(evaluate, functional.start, settings, heed)
        log.evaluations = done + minimum.evaluations
        log.seconds.forward += functional.seconds.forward
        log.seconds.backward += functional.seconds.backward
        forces = functional.setup(minimum.x).forces
        self.given, self.forces = forces[: len(self.given)], forces[len(self.given) :]
        if stopped:
            raise Stopped
        if not minimum.point.details:
            return math.inf, {}  # not even the start could be evaluated
        (misfits,) = minimum.point.details
        return longest(misfits), misfits

    def _chains(self, functional: Functional) -> list[Chain]:
        """The entries of each point's forces that vary, in the order of their windows."""
        entries = {one.name: one.entries for one in functional.variables.slices}
        rows: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        for n, (owner, force) in enumerate(zip(self._span.owners, self._span.forces, strict=True)):
            expected = {"vector": np.zeros(2), "center": np.array(force.center) / force.radius}
            keys = [key for key in expected if self._name(n, key) in entries]
            if keys:
                slices = [entries[self._name(n, key)] for key in keys]
                own = np.concatenate([np.arange(one.start, one.stop) for one in slices])
                rows.setdefault(owner, []).append((own, np.concatenate([expected[key] for key in keys])))
        return [tuple(np.stack(column) for column in zip(*own, strict=True)) for own in rows.values()]


Chain = tuple[np.ndarray, np.ndarray]
"""Indices of entries of a vector, a row for each force, and their expected values."""


class Smoothness:
    """Half the sum of squared changes, from row to row, of entries minus their expected values."""

    def __init__(self, chains: Sequence[Chain], weight: float):
        self._chains, self._weight = chains, weight

    def added(self, value: float, gradient: np.ndarray, m: np.ndarray) -> tuple[float, np.ndarray]:
        """A value and its gradient at m, with the weighted smoothness and its gradient added."""
        gradient = gradient.copy()
        for entries, expected in self._chains:
            change = np.diff(m[entries] - expected, axis=0)
            value += 0.5 * self._weight * float(np.sum(change * change))
            gradient[entries[1:]] += self._weight * change
            gradient[entries[:-1]] -= self._weight * change
        return value, gradient
