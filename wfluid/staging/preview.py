"""The controls of a scene drawn on its picture, without running it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.limits import RADIUS
from wfluid.model.force import flatten
from wfluid.model.painted import Freeze, Painted
from wfluid.pictures.picture import Picture, resample
from wfluid.scene.forces import (
    ForceTable,
    GrowTable,
    Point,
    PushTable,
    Row,
    Spot,
    StrokeTable,
    VortexTable,
    WindTable,
)
from wfluid.scene.scene import Scene
from wfluid.staging.aims import Aims

Line = Sequence[Point]
"""A polyline [px]."""

Colour = tuple[float, float, float]
"""Red, green and blue, linear light."""

COLOURS: tuple[Colour, ...] = ((1.0, 0.75, 0.0), (0.0, 0.8, 1.0), (1.0, 0.2, 0.6), (0.4, 1.0, 0.2))
"""Colours of forces and keyframes, in turn."""

STIFF, FROZEN = (1.0, 0.35, 0.0), (0.0, 0.35, 1.0)
"""Tints of stiff parts, in proportion to the largest viscosity, and of frozen parts."""

_TINT = 0.6
"""Opacity of a full tint."""


def draw_controls(scene: Scene, animation: Animation, aims: Aims | None = None) -> Picture:
    """The picture with its controls: forces and keyframes as arrows, radii (one sigma) as circles, paths as
    lines, pins and followed points as crosses.

    Stiff parts are tinted orange, frozen parts blue; parts outside the effect mask are dark.
    """
    picture, fluid = animation.picture, animation.fluid
    weights = {id(force.weight): force.weight for force in flatten(animation.forces) if force.weight}
    canvas = _Canvas(_tinted(picture, fluid.viscosity, fluid.freeze, list(weights.values())))
    frame_width, frame_height = scene.picture.size or (picture.width, picture.height)
    side = max(frame_width, frame_height)
    stretch = picture.width / frame_width, picture.height / frame_height

    def draw(lines: Iterable[Line], colour: Colour) -> None:
        for line in lines:
            canvas.draw([(x * stretch[0], y * stretch[1]) for x, y in line], colour)

    shapes = [_force(force, side) for force in scene.forces]
    for density in scene.densities:
        shapes += [_spot(source, side) for source in density.sources if source.image is None]
    for number, lines in enumerate(shapes):
        draw(lines, COLOURS[number % len(COLOURS)])
    for number, keyframe in enumerate(aims.keyframes if aims else ()):
        (x, y), (to_x, to_y) = keyframe.point, keyframe.destination
        arrow = _arrow((side * x, side * y), (side * to_x, side * to_y), side)
        draw(arrow, COLOURS[number % len(COLOURS)])
    pins = [(x * side, y * side) for x, y in aims.pins] if aims else []
    for x, y in [*scene.tracks.points, *pins]:
        arm = 0.01 * side
        draw([[(x - arm, y), (x + arm, y)], [(x, y - arm), (x, y + arm)]], (1.0, 1.0, 1.0))
    return Picture(canvas.pixels(), None, "uint8", None)


def _force(force: ForceTable, side: float) -> Iterator[Line]:
    """The lines that draw a force."""
    if isinstance(force, StrokeTable):
        points = _places(force.path) if force.points is None else force.points
        yield points
        yield from _head(points[-2], points[-1], side)
    elif isinstance(force, WindTable):
        at = (0.05 * side, 0.05 * side)
        yield from _arrow(at, (at[0] + force.by[0], at[1] + force.by[1]), side)
    elif isinstance(force, PushTable | VortexTable | GrowTable):
        yield from _spot(force, side)
        yield from _at_spot(force, side)


def _at_spot(force: PushTable | VortexTable | GrowTable, side: float) -> Iterator[Line]:
    """The motion at a spot: an arrow, an arc, arrows outwards or inwards."""
    (x, y), radius = _first(force), _radius(force, side)
    if isinstance(force, PushTable):
        yield from _arrow((x, y), (x + force.by[0], y + force.by[1]), side)
    elif isinstance(force, VortexTable):
        turn = math.radians(force.turn)
        arc = [
            (x + 0.6 * radius * math.cos(a), y + 0.6 * radius * math.sin(a))
            for a in np.linspace(0, max(-6.0, min(6.0, turn)), 49)
        ]
        yield arc
        yield from _head(arc[-2], arc[-1], side)
    else:
        ends = (0.5, 1.0) if force.factor >= 1 else (1.0, 0.5)
        for a in np.arange(4) * math.pi / 2 + math.pi / 4:
            c, s = radius * math.cos(a), radius * math.sin(a)
            yield from _arrow((x + ends[0] * c, y + ends[0] * s), (x + ends[1] * c, y + ends[1] * s), side)


def _spot(spot: Spot, side: float) -> Iterator[Line]:
    """A circle at a spot's radius, and its path."""
    (x, y), radius = _first(spot), _radius(spot, side)
    turn = np.linspace(0, 2 * math.pi, 73)
    yield list(zip(x + radius * np.cos(turn), y + radius * np.sin(turn), strict=True))
    if spot.path is not None:
        yield _places(spot.path)


def _radius(spot: Spot, side: float) -> float:
    return RADIUS * side if spot.radius is None else spot.radius


def _first(spot: Spot) -> Point:
    return _places(spot.path)[0] if spot.center is None else spot.center


def _places(path: Sequence[Row] | None) -> list[Point]:
    """The places of a path, which a table without a point has."""
    return [(x, y) for _, x, y in path or ()]


def _arrow(start: Point, tip: Point, side: float) -> Iterator[Line]:
    yield [start, tip]
    yield from _head(start, tip, side)


def _head(start: Point, tip: Point, side: float) -> Iterator[Line]:
    """The two wings of an arrow's head."""
    back, wing = math.atan2(start[1] - tip[1], start[0] - tip[0]), max(6.0, 0.02 * side)
    for spread in (0.45, -0.45):
        end = tip[0] + wing * math.cos(back + spread), tip[1] + wing * math.sin(back + spread)
        yield [(tip[0], tip[1]), end]


def _tinted(
    picture: Picture, viscosity: object, freeze: Freeze | None, weights: Sequence[Painted]
) -> np.ndarray:
    """The picture's colours, a little darker, under the tints of painted controls."""
    height, width, channels = picture.pixels.shape
    colours = picture.pixels[..., :3] if channels >= 3 else np.repeat(picture.pixels[..., :1], 3, axis=2)
    colours = np.clip(colours, 0, 1) * 0.8
    for painted, tint in (
        (viscosity if isinstance(viscosity, Painted) else None, STIFF),
        (freeze.paint if freeze else None, FROZEN),
    ):
        if painted is not None and painted.values.max() > 0:
            part = resample((painted.values / painted.values.max()).astype(np.float32), width, height)
            colours += _TINT * part[..., None] * (np.array(tint, dtype=np.float32) - colours)
    if weights:
        most = np.max([resample(_clipped(weight), width, height) for weight in weights], axis=0)
        colours *= 0.3 + 0.7 * most[..., None]
    return colours


def _clipped(weight: Painted) -> np.ndarray:
    return np.minimum(weight.values, 1.0).astype(np.float32)


class _Canvas:
    """Draws lines on colours."""

    def __init__(self, colours: np.ndarray):
        import OpenImageIO as oiio

        self._oiio, self._shape = oiio, colours.shape
        self._image = oiio.ImageBuf(np.ascontiguousarray(colours, dtype=np.float32))
        self._thick = max(1, max(colours.shape[:2]) // 400)

    def draw(self, points: Line, colour: Colour) -> None:
        """Draw a polyline."""
        for (x0, y0), (x1, y1) in pairwise(points):
            for shift in range(self._thick):
                a = (round(x0) + shift, round(y0)), (round(x1) + shift, round(y1))
                b = (round(x0), round(y0) + shift), (round(x1), round(y1) + shift)
                for start, end in (a, b):
                    self._oiio.ImageBufAlgo.render_line(self._image, *start, *end, (*colour, 1.0))

    def pixels(self) -> np.ndarray:
        """The drawing, (height, width, 3)."""
        pixels = np.asarray(self._image.get_pixels(self._oiio.FLOAT), dtype=np.float32)
        return pixels.reshape(self._shape)
