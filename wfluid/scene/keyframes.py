"""The tables of a scene's keyframes, and of a morph."""

from __future__ import annotations

from wfluid.domain.limits import (
    BLEND_SPACES,
    CURVES,
    DELAY,
    DELAY_LIMIT,
    EASE,
    FITS,
    MORPH_TOLERANCE,
    TOLERANCE,
)
from wfluid.scene.forces import POINT, POINTS, SIZE, Point
from wfluid.scene.schema import SceneTable, array, file_key, key
from wfluid.scene.types import curve, flag, number, word

_NO_TIMES = "a morph goes without: its points arrive at its end"


class MoveTable(SceneTable):
    """A point that should be somewhere; several of one point make a path."""

    start: Point = key("its place in the untouched picture", POINT, name="from", unit="px", required=True)
    to: Point = key("where it should be", POINT, unit="px", required=True)
    time: float | None = key(
        "when", number(above=0), unit="s", otherwise="that of all", not_in_morph=_NO_TIMES
    )
    weight: float = key("how much it counts beside others", number(above=0), default=1.0)


class FoundTable(SceneTable):
    """A force found before, as a saved scene has it: the search goes on from there."""

    center: Point = key("where it acts", POINT, unit="px", required=True)
    vector: Point = key("acceleration at its centre", POINT, unit="px/s^2", required=True)
    radius: float = key("sigma of its Gaussian", number(above=0), unit="px", required=True)
    start: float = key("when it begins", number(0), unit="s", required=True)
    end: float = key("when it ends", number(above=0), unit="s", required=True)


class KeyframesTable(SceneTable):
    """Where points arrive: forces are found that take them there."""

    moves: tuple[MoveTable, ...] = array(MoveTable, name="move")
    points: str | None = file_key("moves in a CSV file: from x, y, to x, y, perhaps time", painting=False)
    time: float | None = key(
        "time of moves that name none",
        number(above=0),
        unit="s",
        otherwise="the duration",
        not_in_morph=_NO_TIMES,
    )
    pins: tuple[Point, ...] = key(
        "points that stay in their place until the last keyframe",
        POINTS,
        unit="px",
        default=(),
        form="--pin",
    )
    tolerance: float | None = key(
        "how far a point may end from its keyframe",
        number(above=0),
        unit="px",
        otherwise=f"{512 * TOLERANCE:g}, of a picture of 512; a morph's {512 * MORPH_TOLERANCE:g}",
        flag="--tolerance",
    )
    found: tuple[FoundTable, ...] = array(FoundTable, name="force")


Curve = str | tuple[tuple[float, float], ...]
"""A curve's name, or its keys."""


class MorphTable(SceneTable):
    """Another picture, into which this one flows; keyframes lead from points of this to points of it."""

    to: str = file_key("the other picture", painting=False, required=True, form="B")
    size: Point | None = key("frame size that its pixels refer to", SIZE, unit="px", otherwise="its own")
    fit: str = key("how it covers the frame", word(*FITS), default=FITS[0], flag="--fit")
    warp_curve: Curve = key(
        "how far points are on their ways: linear, ease, or [[s, 0 … 1], …]",
        curve(CURVES),
        default=EASE,
        flag="--warp-curve",
        metavar="CURVE",
    )
    blend_curve: Curve = key(
        "how much of it is seen, the same",
        curve(CURVES),
        default=EASE,
        flag="--blend-curve",
        metavar="CURVE",
    )
    blend: str = key(
        "what is mixed: light, or display values",
        word(*BLEND_SPACES),
        default=BLEND_SPACES[0],
        flag="--blend",
    )
    timing: str | None = file_key("a mask, white where it happens first", form="--timing")
    delay: float = key(
        "how much later it happens where the mask is black, a part of the duration",
        number(0, DELAY_LIMIT),
        default=DELAY,
        form="--timing MASK:DELAY",
    )
    reverse: bool = key("from the other picture to this", flag(), default=False, flag="--reverse")
    pingpong: bool = key("there and back", flag(), default=False, flag="--pingpong")
