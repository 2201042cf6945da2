"""The tables of keyframes and of a morph."""

from __future__ import annotations

from typing import Any

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

_NO_TIMES = "not allowed in a morph: its points arrive at its end"


class MoveTable(SceneTable):
    """A keyframe of one point; several keyframes of one point make a path."""

    start: Point = key("place in the untouched picture", POINT, name="from", unit="px", required=True)
    to: Point = key("target", POINT, unit="px", required=True)
    time: float | None = key(
        "time of arrival", number(above=0), unit="s", otherwise="time of [keyframes]", not_in_morph=_NO_TIMES
    )
    weight: float = key("weight of its misfit", number(above=0), default=1.0)


class FoundTable(SceneTable):
    """A force found by an earlier search, where the next one starts; written by --save-scene."""

    center: Point = key("centre", POINT, unit="px", required=True)
    vector: Point = key("acceleration at the centre", POINT, unit="px/s^2", required=True)
    radius: float = key("sigma of the Gaussian", number(above=0), unit="px", required=True)
    start: float = key("start of the window", number(0), unit="s", required=True)
    end: float = key("end of the window", number(above=0), unit="s", required=True)


class KeyframesTable(SceneTable):
    """Keyframes: a search finds forces that move points to their targets."""

    moves: tuple[MoveTable, ...] = array(MoveTable, name="move")
    points: str | None = file_key(
        "CSV file of moves: from x, from y, to x, to y, and optionally time", painting=False
    )
    time: float | None = key(
        "time of arrival of moves without their own",
        number(above=0),
        unit="s",
        otherwise="the duration",
        not_in_morph=_NO_TIMES,
    )
    pins: tuple[Point, ...] = key(
        "points that stay in place until the last keyframe",
        POINTS,
        unit="px",
        default=(),
        form="--pin",
    )
    tolerance: float | None = key(
        "largest residual that counts as reached",
        number(above=0),
        unit="px",
        otherwise=f"{512 * TOLERANCE:g} for a picture of 512 px, of a morph {512 * MORPH_TOLERANCE:g}",
        flag="--tolerance",
    )
    found: tuple[FoundTable, ...] = array(FoundTable, name="force")


Curve = str | tuple[tuple[float, float], ...]
"""A curve's name, or its keys."""


def _curve_key(what: str) -> Any:
    meaning = f"progress of the {what} over time; in a scene file keys are [[s, 0 … 1], …]"
    return key(meaning, curve(CURVES), default=EASE, flag=f"--{what}-curve", metavar="linear|ease|S:PART,…")


class MorphTable(SceneTable):
    """A morph into another picture; keyframes lead from points of the first to points of the second."""

    to: str = file_key("file of the second picture", painting=False, required=True, form="B")
    size: Point | None = key(
        "size of the frame that its pixels refer to", SIZE, unit="px", otherwise="its own"
    )
    fit: str = key("fit of the second picture to the frame", word(*FITS), default=FITS[0], flag="--fit")
    warp_curve: Curve = _curve_key("warp")
    blend_curve: Curve = _curve_key("blend")
    blend: str = key(
        "colour values of the blend",
        word(*BLEND_SPACES),
        default=BLEND_SPACES[0],
        flag="--blend",
    )
    timing: str | None = file_key("mask: black parts morph later than white ones", form="--timing")
    delay: float = key(
        "delay of black in the timing mask, a part of the duration",
        number(0, DELAY_LIMIT),
        default=DELAY,
        form="--timing MASK:DELAY",
    )
    reverse: bool = key(
        "show the frames from the second picture to the first", flag(), default=False, flag="--reverse"
    )
    pingpong: bool = key("show the frames forwards and back", flag(), default=False, flag="--pingpong")
