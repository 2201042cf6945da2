"""Morphs: one picture flows into another, through points of both (Bonilla & Velho, figure 7).

>>> from wfluid import write_animation
>>> cat, raccoon = (f"examples/images/{name}.png" for name in ("cat", "raccoon_face"))
>>> points = [((0.38, 0.25), (0.34, 0.34)), ((0.7, 0.3), (0.58, 0.39))]
>>> morph_of_two = morph(cat, raccoon, points, duration=0.5, fps=12, cells=32, width=48)
>>> write_animation("morph.gif", morph_of_two.frames())
[PosixPath('morph.gif')]

Keyframes take the points of the first picture a to those of the second picture b within the time of one flow.
At any time of the flow, a is warped by the map to the start and b by the map to the end. Corresponding points
then coincide, and the two pictures are blended.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.animation.run import Run, RunTimes
from wfluid.domain.curves import delayed_part
from wfluid.domain.limits import DELAY, EASE, MORPH_TOLERANCE, MORPH_VISCOSITY
from wfluid.domain.operators import blurred
from wfluid.domain.paths import Place, check_no_pixels
from wfluid.domain.timeline import Timeline
from wfluid.fields.state import State
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.keyframes.match import Match, match_keyframes
from wfluid.keyframes.search import Progress
from wfluid.model.fluid import Fluid
from wfluid.model.painted import Painted, as_weight
from wfluid.morphing.flow_maps import FlowMaps, flow_maps
from wfluid.morphing.frame import MorphFrame
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.blend import blended
from wfluid.pictures.pairing import PicturePair, paired
from wfluid.pictures.picture import PictureLike, picture_of
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import MapQuality, measure_map

FLOW = Timeline(1.0, fps=24.0, substeps=2)
"""Timeline of the flow; the frames of a morph of any duration are spread over it."""

FACTORS = (0.5, 1.0, 0.35)
"""Factors on the radii of forces, smaller than usual: the viscosity spreads their motion."""

LEAST_JACOBIAN = 0.1
"""Least det J of a map with a timing mask, unless the flow has less without the mask."""


@dataclass(frozen=True, eq=False)
class Morph:
    """A morph of two pictures with the flow between them; iterate over `frames()`."""

    match: Match
    """The forces of the flow, and the residuals of its keyframes."""
    pair: PicturePair
    """The two pictures; the first is also that of the match's animation."""
    settings: MorphSettings
    """Timing, curves and blending."""

    def __repr__(self) -> str:
        return f"Morph({self.frame_count} frames, {self.match})"

    @property
    def animation(self) -> Animation:
        """The flow, with the first picture."""
        return self.match.animation

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.settings.order)

    @cached_property
    def passage(self) -> FlowMaps:
        """The maps of the flow, computed at the first access."""
        animation = self.animation
        return flow_maps(animation.solver, animation.forces, animation.timeline)

    @property
    def notes(self) -> tuple[str, ...]:
        """Changes to the timing mask that a user should know; with a mask, the first access runs the flow."""
        sigma, side = self._timing[1], max(self.animation.picture.width, self.animation.picture.height)
        if not sigma:
            return ()
        return (f"the timing mask is softened by {sigma * side:.3g} px for the warp, which would fold",)

    @cached_property
    def _timing(self) -> tuple[np.ndarray | None, float]:
        """The mask on the grid, blurred until no frame's map folds, and the blur's sigma [longer side]."""
        mask, grid = self.settings.mask, self.animation.grid
        if mask is None:
            return None, 0.0
        painted, state = mask.sample(grid), self.animation.solver.rest()
        without = min(self._least_jacobian(None, state), LEAST_JACOBIAN)
        sigma, ahead = 0.0, painted
        while self._least_jacobian(ahead, state) < without and sigma < 1:
            sigma = 2 * sigma or min(grid.hx, grid.hy)
            ahead = blurred(painted, grid, sigma, self.passage.walls.periodic)
        return ahead, sigma

    def _least_jacobian(self, ahead: np.ndarray | None, state: State) -> float:
        """The least det J of both maps over all frames."""
        least = math.inf
        for index in range(self.settings.timeline.frames):
            part = self._warped(index, ahead)
            for warp in (self.passage.since_start(part), self.passage.until_end(part)):
                least = min(least, self._measured(warp, state).jacobian_min)
        return least

    def _measured(self, warp: CoordinateMap, state: State) -> MapQuality:
        """The measures of a map, which `state` takes over."""
        self.animation.solver.set_map(state, warp.displacement)
        return measure_map(state, CoordinateMap.of_state(state, warp.walls))

    def _part(self, index: int) -> float:
        return index / (self.settings.timeline.frames - 1)

    def _warped(self, index: int, ahead: np.ndarray | None) -> np.ndarray:
        """The fraction of the flow's time that a frame shows: a number, or (ny, nx)."""
        part, settings = self._part(index), self.settings
        far = settings.warp_curve.at(part if ahead is None else delayed_part(part, ahead, settings.delay))
        return np.interp(far, self._ways, np.linspace(0.0, 1.0, len(self._ways)))

    @cached_property
    def _ways(self) -> np.ndarray:
        """The fraction of the summed ways of all points that is covered after each step, 0 … 1."""
        steps = np.linalg.norm(np.diff(self.match.tracks, axis=0), axis=2).sum(axis=1)
        if not steps.any():
            steps[:] = 1.0
        far = np.cumsum(steps)
        return np.append(0.0, far / far[-1])

    def _points(self, part: float) -> np.ndarray:
        """Positions of the keyframes' points after a fraction of the flow's time [longer side], (n, 2)."""
        tracks = self.match.tracks
        at = part * (len(tracks) - 1)
        step = min(int(at), len(tracks) - 2)
        return tracks[step] + (at - step) * (tracks[step + 1] - tracks[step])

    def frames(self) -> Run[MorphFrame]:
        """The frames in the order of the settings; the first and the last equal the two pictures."""
        seconds = RunTimes()
        return Run(self._frames(seconds), self.frame_count, self.settings.timeline.fps, seconds)

    def _frames(self, seconds: RunTimes) -> Iterator[MorphFrame]:
        animation, settings, clock = self.animation, self.settings, time.perf_counter
        shown = [animation.look_up(picture) for picture in (self.pair.a, self.pair.b)]
        began = clock()
        state, passage, ahead = animation.solver.rest(), self.passage, self._timing[0]
        seconds.simulate += clock() - began
        mask = settings.mask and settings.mask.resampled(shown[0].width, shown[0].height)
        for number, index in enumerate(settings.order):
            began = clock()
            part = self._warped(index, ahead)
            maps, qualities, pictures = (passage.since_start(part), passage.until_end(part)), [], []
            lookup = 0.0
            for warp, look_up in zip(maps, shown, strict=True):
                qualities.append(self._measured(warp, state))
                looked = clock()
                still = qualities[-1].displacement_max == 0
                pictures.append(look_up.untouched if still else look_up.render(state.d_x, state.d_y))
                lookup += clock() - looked
            own = self._part(index)
            weight = settings.blend_curve.at(own if mask is None else delayed_part(own, mask, settings.delay))
            picture = blended(*pictures, weight, settings.blend)
            seconds.lookup += lookup
            seconds.simulate += clock() - began - lookup
            yield MorphFrame(
                number,
                number / settings.timeline.fps,
                picture,
                maps[0],
                qualities[0],
                None,
                points=self._points(float(part)) if mask is None else np.empty((0, 2)),
                to_map=maps[1],
                to_quality=qualities[1],
            )

    def residuals_of_b(self) -> np.ndarray:
        """Residual of each keyframe in the second picture, by the map at the start [px of that picture]."""
        arrivals, animation = self.match.arrivals, self.animation
        points = np.array([arrival.keyframe.point for arrival in arrivals])
        wanted = np.array([arrival.keyframe.destination for arrival in arrivals])
        residual = self.passage.until_end(0.0).source_at(points) - wanted
        grid = animation.grid
        return np.linalg.norm(residual * self.pair.window.pixels((grid.width, grid.height)), axis=1)

    def inconsistency_px(self) -> tuple[float, float]:
        """Mean and largest error with which the two maps invert each other [px of the first picture]."""
        picture = self.animation.picture
        found = self.passage.inconsistency() * max(picture.width, picture.height)
        return float(found.mean()), float(found.max())


def morph(
    a: PictureLike,
    b: PictureLike,
    points: Sequence[tuple[Place, Place]] | np.ndarray,
    duration: float = 2.0,
    fps: float = 24.0,
    *,
    fluid: Fluid | None = None,
    pins: Sequence[Place] = (),
    fit: str = "fill",
    warp_curve: str | Mapping[float, float] = EASE,
    blend_curve: str | Mapping[float, float] = EASE,
    blend: str = "linear",
    mask: Painted | PictureLike | None = None,
    delay: float = DELAY,
    reverse: bool = False,
    pingpong: bool = False,
    tolerance: float = MORPH_TOLERANCE,
    seed: int = 0,
    progress: Callable[[Progress], object] = lambda progress: None,
    **settings,
) -> Morph:
    """A morph of picture a into picture b. The search for its flow takes minutes on a large grid.

    `a` and `b` are anything that `Picture.of` takes, such as paths.

    - `points`: corresponding points, (n, 2, 2) or (n, 4): x, y in a [longer side of a], x, y in b [longer
      side of b].
    - `pins`: points of a that stay in place [longer side of a].
    - `fit`: fit of b to the frame of a: "fill" (cropped), "fit" (with bars) or "stretch".
    - `settings`: those of `Animation`: cells, width, height, filter, edge, device. Frames have the size of a
      by default.

    `MorphSettings` and `match_keyframes` document the other arguments.

    Raises:
        ValueError: no points, or points that are not pairs of two numbers; points outside a, or outside the
            visible part of b; arguments that `MorphSettings`, `paired` or `match_keyframes` refuse.
    """
    a, b = picture_of("a", a), picture_of("b", b)
    mask = as_weight("mask", mask)
    shape = MorphSettings(
        Timeline(duration, fps), warp_curve, blend_curve, blend, mask, delay, reverse, pingpong
    )
    pair = paired(a, b, fit)
    fluid = Fluid(viscosity=MORPH_VISCOSITY, inertia=False) if fluid is None else fluid
    animation = Animation(a, fluid, [], FLOW, **settings)
    extent, side = (animation.grid.width, animation.grid.height), max(b.width, b.height)
    keyframes = [
        ParticleKeyframe(start, pair.place((x * side, y * side), extent), FLOW.end)
        for start, (x, y) in _pairs(points)
    ]
    found = match_keyframes(
        animation, keyframes, pins=pins, tolerance=tolerance, seed=seed, progress=progress, factors=FACTORS
    )
    return Morph(found, pair, shape)


def _pairs(points: Sequence | np.ndarray) -> list[tuple[Place, Place]]:
    """Corresponding points as pairs of places.

    Raises:
        ValueError: an array that is not (n, 2, 2) or (n, 4), or numbers that look like pixels.
    """
    try:
        rows = np.asarray(points, dtype=np.float64).reshape(max(1, len(points)), -1)
    except (TypeError, ValueError) as error:
        raise ValueError(
            "points: expected x, y in the one picture and x, y in the other, for each"
        ) from error
    if not len(rows) or rows.shape[1] != 4:
        raise ValueError("points: expected x, y in the one picture and x, y in the other, for at least one")
    for x, y, to_x, to_y in rows.tolist():
        check_no_pixels("a point of the first picture", (x, y))
        check_no_pixels("a point of the second picture", (to_x, to_y))
    return [((x, y), (to_x, to_y)) for x, y, to_x, to_y in rows.tolist()]
