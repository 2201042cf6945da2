"""The search for forces that take points of a picture to their keyframes, and its result.

>>> from wfluid import Fluid, write_animation
>>> picture = "examples/images/cat.png"
>>> timeline = Timeline(0.5, fps=12, substeps=4)
>>> animation = Animation(picture, Fluid(viscosity=0.005), [], timeline, cells=32, width=48)
>>> match = match_keyframes(animation, [ParticleKeyframe((0.4, 0.5), (0.45, 0.45), time=0.5)])
>>> match.status
'reached'
>>> write_animation("nose.gif", match.animation.frames())
[PosixPath('nose.gif')]

This is the third technique of Bonilla & Velho, section III: u contains the vectors and centers of Gaussian
forces, and L-BFGS minimises phi(u), half the sum of squared misfits, with the gradient of the adjoint method.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.checks import listed
from wfluid.domain.limits import TOLERANCE
from wfluid.domain.paths import Place
from wfluid.domain.timeline import Timeline
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.variables import Free
from wfluid.keyframes.arrival import Arrival, reason_unreached
from wfluid.keyframes.attempt import Attempt
from wfluid.keyframes.keyframes import ParticleKeyframe, PointTarget, targets_of
from wfluid.keyframes.search import Progress, SearchLog, Stopped
from wfluid.keyframes.spline import Spline
from wfluid.keyframes.trajectories import trajectories
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.step.diffusion import SURE_TOLERANCE

FACTORS = (1.0, 1.4, 0.65)
"""Factors on the radii of forces: wide forces deform least, narrow ones separate near points."""

NEARLY_FOLDED = 0.1
"""Least det J below which other radii are tried."""

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

    def __repr__(self) -> str:
        side = max(self.animation.picture.width, self.animation.picture.height)
        return f"Match({self.status}, {self.residual * side:.2g} px away, {len(self.found)} forces)"

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
    keyframes: ParticleKeyframe | Sequence[ParticleKeyframe],
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
    """Search for forces that take points of an animation's picture to their keyframes.

    The forces of the animation act too. The search adds Gaussian forces for every point, in windows of time
    along its way; with `free` parameters ("forces[0].vector") it varies these instead and adds no forces.

    - `pins`: points that should stay in place until the last keyframe [longer side].
    - `free`: parameters of the animation's forces that vary.
    - `start`: forces of an earlier search. Points that reach their keyframes with these get no new forces. If
      some keyframes remain unreached, the search starts again without them.
    - `tolerance`: largest residual of a keyframe that counts as reached [longer side].
    - `seed`: selects the side on which points pass one another.
    - `progress`: is called after every iteration; a true result stops the search.
    - `side`: longer side of the picture in the unit of error messages, such as pixels.
    - `factors`: factors on the radii of forces, tried in turn; by default `FACTORS`.

    The same arguments give bit-equal results on a CPU.

    Raises:
        ValueError: keyframes that `targets_of` refuses, or with a time between two steps; an animation that
            loops; a tolerance that is not positive.
    """
    began = time.perf_counter()
    if animation.loop is not None:
        raise ValueError(f"a loop ({animation.loop}) goes without keyframes: its end is its beginning")
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance {tolerance}: expected a positive number")
    animation = replace(animation, fluid=_solved_surely(animation.fluid))
    grid, timeline = animation.grid, animation.timeline
    keyframes = listed("keyframes", keyframes, ParticleKeyframe, "ParticleKeyframe objects")
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
    if not (animation.fluid.inertia or free):
        spline, tries, stopped = Spline(animation, particles, tuple(start), tolerance, seed, log), [], False
        best = _measured(spline, False, log, began) if start or _all_stay(particles) else None
        if best is None or best.status != REACHED:
            try:
                spline.run()
            except Stopped:
                stopped = True
            best = _measured(spline, stopped, log, began)
    for factor, before in tries:
        attempt = Attempt(animation, particles, free, before, tolerance, seed, factor, log, graphs)
        if (before or _all_stay(particles)) and (
            best := _measured(attempt, False, log, began)
        ).status == REACHED:
            break  # the initial forces suffice
        try:
            attempt.run()
            stopped = False
        except Stopped:
            stopped = True
        match = _measured(attempt, stopped, log, began)
        if best is None or _rank(match) < _rank(best):
            best = match
        failed = [arrival for arrival in best.arrivals if arrival.residual > tolerance]
        if stopped or not _rank(best)[0] or (failed and all(arrival.reason for arrival in failed)):
            break
    return replace(
        best, history=tuple(log.history), evaluations=log.evaluations, seconds=_seconds(log, began)
    )


def _seconds(log: SearchLog, began: float) -> dict[str, float]:
    """Time spent since the start of the search [s]."""
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
    """Sort key of matches: first those that reach all keyframes and do not nearly fold, then by residual."""
    return match.status != REACHED or match.jacobian[0] < NEARLY_FOLDED, match.residual


def _solved_surely(fluid: Fluid) -> Fluid:
    """The fluid; with a moving viscosity, gradients need a smaller tolerance of diffusion."""
    if not fluid.viscosity_moves:
        return fluid
    return replace(fluid, diffusion_tolerance=min(fluid.diffusion_tolerance, SURE_TOLERANCE))


def _snapped(t: float, timeline: Timeline) -> float:
    """A time [s]; if it differs from the end of a step by rounding only, that end."""
    end = timeline.time_of(max(1, round(t / timeline.dt)))
    return end if abs(end - t) <= 1e-6 * timeline.dt else t


def _check_step(t: float, timeline: Timeline) -> None:
    """Check that a time [s] is the end of a step.

    Raises:
        ValueError: it is not; the message gives the nearest ends.
    """
    if t != timeline.time_of(max(1, round(t / timeline.dt))):
        near = ", ".join(f"{timeline.time_of(int(t / timeline.dt) + n):.6g}" for n in (0, 1))
        raise ValueError(f"a keyframe at {t:g} s falls between two steps, at {near} s")


def _measured(attempt: Attempt | Spline, stopped: bool, log: SearchLog, began: float) -> Match:
    """Run the animation with the forces of an attempt and measure the residuals of its keyframes."""
    animation, particles = attempt.animation, attempt.particles
    given, found = attempt.given, attempt.found
    timeline = animation.timeline
    moved = replace(animation, forces=(*given, *found))
    steps = sorted({round(t / timeline.dt) for particle in particles for t in particle.times})
    points = np.array([particle.point for particle in particles])
    tracks, maps, jacobian = trajectories(moved.solver, timeline, (*given, *found), points, steps)
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
    reached = all(arrival.residual <= attempt.tolerance for arrival in arrivals)
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
        attempt.tolerance,
        REACHED if reached else STOPPED if stopped else UNREACHABLE,
        tuple(log.history),
        log.evaluations,
        _seconds(log, began),
    )
