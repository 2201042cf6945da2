"""What an animation will take, before it is run.

Memory follows from the arrays it makes, time from figures measured on one core of a 2 GHz server CPU.
"""

from __future__ import annotations

from dataclasses import dataclass

from wfluid.animation import Animation
from wfluid.files import free_memory, readable_size

FIELDS = 75
"""Fields of the finest grid that a solver, two states and their hierarchies hold."""

FIELDS_PER_PIXEL = 3
"""Fields of the frames' size: two coordinates and what is being copied out."""

SECONDS_PER_CELL_STEP = 100e-9
SECONDS_PER_PIXEL = 40e-9

QUEUED_FRAMES = 6
"""Frames in flight between computing and writing."""

_REAL = 4


@dataclass(frozen=True)
class Estimate:
    """What a run takes, roughly."""

    memory: float
    """Bytes at the peak."""
    seconds: float
    """Time without compiling and writing."""


def estimate(animation: Animation) -> Estimate:
    """Memory and time of an animation, from its sizes alone."""
    grid, picture = animation.grid, animation.picture
    width, height = animation.width or picture.width, animation.height or picture.height
    channels = -(-picture.pixels.shape[2] // 4) * 4
    memory = _REAL * (
        FIELDS * grid.nx * grid.ny
        + (channels + 2 * picture.pixels.shape[2]) * picture.width * picture.height
        + (channels + FIELDS_PER_PIXEL + QUEUED_FRAMES * picture.pixels.shape[2]) * width * height
    )
    steps = (animation.timeline.frames - 1) * animation.timeline.steps_per_frame
    seconds = steps * grid.nx * grid.ny * SECONDS_PER_CELL_STEP
    seconds += animation.timeline.frames * width * height * SECONDS_PER_PIXEL
    return Estimate(memory, seconds)


def check_memory(animation: Animation) -> None:
    """Refuse an animation that will not fit.

    Raises:
        ValueError: with what it needs and what there is.
    """
    need, there = estimate(animation).memory, free_memory()
    if need > there:
        raise ValueError(
            f"{animation.grid.nx} x {animation.grid.ny} cells and frames of {animation.picture.width} x "
            f"{animation.picture.height} pixels need about {readable_size(need)} of memory, "
            f"{readable_size(there)} are free; lower --cells or --width"
        )
