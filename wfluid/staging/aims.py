"""The keyframes of a scene in domain units, and the forces that were found for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from wfluid.domain.envelopes import Constant
from wfluid.domain.limits import MORPH_TOLERANCE, TOLERANCE
from wfluid.domain.paths import Place
from wfluid.domain.timeline import Timeline
from wfluid.files.points import read_points
from wfluid.keyframes.keyframes import ParticleKeyframe, check_time, targets_of
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.scene.keyframes import FoundTable, KeyframesTable
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SchemaError, blame
from wfluid.staging.drawing import Drawing


@dataclass(frozen=True)
class Aims:
    """Keyframes, and the settings of the search for their forces."""

    keyframes: tuple[ParticleKeyframe, ...]
    """Destinations of points."""
    pins: tuple[Place, ...]
    """Points that stay in place [longer side]."""
    found: tuple[GaussianForce, ...]
    """Forces of an earlier search, where this one starts."""
    tolerance: float
    """Largest residual that counts as reached [longer side]."""
    seed: int
    """Random seed of the search."""
    side: float
    """The longer side in the scene's pixels."""


class Move(NamedTuple):
    """A move of the scene, or a row of its file of points."""

    key: tuple[str | int, ...]
    """Path of its key in the scene."""
    start: Place
    """Place in the untouched picture [px]."""
    to: Place
    """Destination [px]."""
    time: float
    """Time of arrival [s]."""
    weight: float
    """Weight of its misfit."""


def moves_of(scene: Scene, keyframes: KeyframesTable, duration: float) -> Iterator[Move]:
    """Every move of a scene and of its file of points; `duration` is the default time [s].

    Raises:
        FileError: the file of points cannot be read.
        SchemaError: a time in the file of points of a morph.
    """
    default = duration if keyframes.time is None else keyframes.time
    for n, move in enumerate(keyframes.moves):
        time = default if move.time is None else move.time
        yield Move(("keyframes", "move", n), move.start, move.to, time, move.weight)
    if keyframes.points is None:
        return
    key = ("keyframes", "points")
    for row in read_points(scene.folder / keyframes.points):
        if scene.morph and row.time is not None:
            raise SchemaError(key, "times are not allowed in a morph: its points arrive at its end")
        yield Move(key, row.source, row.target, default if row.time is None else row.time, 1.0)


def aims_of(
    scene: Scene,
    keyframes: KeyframesTable,
    moves: Sequence[Move],
    drawing: Drawing,
    timeline: Timeline,
    destination: Callable[[Place], Place],
    note: Callable[[str], None],
) -> Aims:
    """The keyframes of a scene's moves, each at the end of a step.

    `destination` turns the end of a move into domain units; `note` is called where a time is changed.

    Raises:
        SchemaError: a place outside the picture, with its key.
        ValueError: keyframes that contradict each other; a loop.
    """
    particles = []
    for move in moves:
        with blame(*move.key):
            to, start = destination(move.to), drawing.place("from", move.start)
            time = _on_step(timeline, move.time, note)
            check_time(time, timeline.end)
            particles.append(ParticleKeyframe(start, to, time, move.weight))
    side, tolerance = drawing.side, MORPH_TOLERANCE if scene.morph else TOLERANCE
    aims = Aims(
        tuple(particles),
        tuple(drawing.place("a pin", pin) for pin in keyframes.pins),
        tuple(_found(force, side) for force in keyframes.found),
        tolerance if keyframes.tolerance is None else keyframes.tolerance / side,
        scene.seed,
        side,
    )
    with blame("keyframes", "move"):
        targets_of(aims.keyframes, aims.pins, drawing.extent, timeline.end, side)
    if scene.time.loop:
        raise SchemaError(
            ("time", "loop"),
            f"a loop ({scene.time.loop}) ends as it begins, so no keyframe is reached: leave out loop",
        )
    return aims


def _on_step(timeline: Timeline, time: float, note: Callable[[str], None]) -> float:
    """The end of the step nearest to a time [s], notes a change; within the duration, at most the last frame.

    A time after the duration is returned as it is.
    """
    near = timeline.time_of(max(1, round(time / timeline.dt)))
    if time > timeline.end:
        if time > timeline.duration or math.isclose(time, timeline.end, rel_tol=1e-9):
            return time
        near = timeline.end
    if abs(near - time) > 1e-6 * timeline.dt:
        note(f"a keyframe at {time:g} s is moved to {near:.6g} s, the end of a step")
    return near


def _found(force: FoundTable, side: float) -> GaussianForce:
    """A force of an earlier search."""
    (x, y), (a, b) = force.center, force.vector
    window = Constant(force.start, force.end)
    return GaussianForce((x / side, y / side), (a / side, b / side), force.radius / side, window)


def found_table(force: GaussianForce, side: float) -> dict[str, Any]:
    """The table of a force that was found; the inverse of reading it.

    Raises:
        TypeError: a force that moves, or whose envelope is not constant.
    """
    center, window = force.center, force.envelope
    if not (isinstance(center, tuple) and isinstance(window, Constant)):
        raise TypeError("only a force at one place, with a constant envelope, is saved in a scene")
    return {
        "center": [value * side for value in center],
        "vector": [value * side for value in force.vector],
        "radius": force.radius * side,
        "start": window.start,
        "end": window.end,
    }


def with_found(scene: Scene, found: Sequence[GaussianForce], side: float) -> Scene:
    """The scene with the forces that were found for its keyframes."""
    keyframes = {**scene.tables["keyframes"], "force": [found_table(force, side) for force in found]}
    return scene.with_tables({**scene.tables, "keyframes": keyframes})
