"""Memory and time of an animation, estimated before it runs.

Memory follows from the arrays that it allocates, time from measurements on one core of a 2 GHz server CPU.
"""

from __future__ import annotations

from dataclasses import dataclass

from wfluid.animation.animation import Animation
from wfluid.animation.run import QUEUED_FRAMES
from wfluid.system.memory import free_memory, readable_size

FIELDS, COUPLED_FIELDS = 77, 114
"""Number of arrays of the finest grid's size in the solver, the multigrid levels and two states, for
diffusion of independent and of coupled components."""

FIELDS_PER_PIXEL = 3
"""Number of arrays of the frames' size: two coordinates, and one channel being copied."""

SECONDS_PER_CELL_STEP, COUPLED_SECONDS = 100e-9, 400e-9
SECONDS_PER_PIXEL = 40e-9

FRAMES_IN_FLIGHT = QUEUED_FRAMES + 2
"""Frames in memory: the queue, the frame being computed and the frame being written."""

PROGRAM = 240e6
"""Memory of Python and the libraries before the first array [bytes]."""

DENSITY_FIELDS = 17
"""Arrays of the grid's size for a density that diffuses."""

LOOP_FRAMES = {"oscillate": (3.0, 6.0), "pingpong": (0.5, 0.5), "crossfade": (0.25, 1.25)}
"""By kind of loop: the fraction of its frames that are kept, and that are simulated."""

FIELDS_A_STEP = 6
"""Arrays for each step of a morph's flow: a velocity and two maps of two components each."""

_REAL = 4


@dataclass(frozen=True)
class Estimate:
    """Rough memory and time of a run."""

    memory: float
    """Peak memory [bytes]."""
    seconds: float
    """Time without compiling and writing [s]."""


def estimate(animation: Animation, frames_kept: int = 0, morph_frames: int | None = None) -> Estimate:
    """Memory and time of an animation, or of a morph with `morph_frames` frames, from sizes alone.

    `frames_kept` is the number of outputs that keep all frames until the last: a GIF's palette needs them.
    """
    grid, picture = animation.grid, animation.picture
    width, height = animation.width or picture.width, animation.height or picture.height
    apart = animation.fluid.separable
    channels = -(-picture.pixels.shape[2] // 4) * 4
    memory = _REAL * (
        (FIELDS if apart else COUPLED_FIELDS) * grid.nx * grid.ny
        + (channels + 2 * picture.pixels.shape[2]) * picture.width * picture.height
        + (channels + FIELDS_PER_PIXEL + FRAMES_IN_FLIGHT * picture.pixels.shape[2]) * width * height
    )
    frames = morph_frames or animation.frame_count
    shown = 2 if morph_frames else 1 + len(animation.layers)
    memory += (
        (shown - 1) * _REAL * (channels + FIELDS_PER_PIXEL + channels * FRAMES_IN_FLIGHT) * width * height
    )
    densities = len(animation.fluid.densities)
    memory += _REAL * grid.nx * grid.ny * (DENSITY_FIELDS * densities)
    if morph_frames:
        memory += _REAL * grid.nx * grid.ny * FIELDS_A_STEP * animation.timeline.steps
    kept, run = LOOP_FRAMES.get(animation.loop, (0.0, 1.0))
    memory += _REAL * grid.nx * grid.ny * (2 + densities) * kept * frames
    memory += PROGRAM + frames_kept * 3 * frames * width * height
    steps = round(run * (frames - (animation.loop is None)) * animation.timeline.steps_per_frame)
    steps = 2 * animation.timeline.steps if morph_frames else steps
    seconds = steps * grid.nx * grid.ny * (SECONDS_PER_CELL_STEP if apart else COUPLED_SECONDS)
    seconds += shown * frames * width * height * SECONDS_PER_PIXEL
    return Estimate(memory, seconds)


def check_memory(animation: Animation, frames_kept: int = 0, morph_frames: int | None = None) -> None:
    """Check that the free memory suffices for an animation.

    Raises:
        ValueError: it does not; the message gives the memory needed, the free memory and the remedy.
    """
    need, there = estimate(animation, frames_kept, morph_frames).memory, free_memory()
    if need > there:
        raise ValueError(
            f"{animation.grid.nx} x {animation.grid.ny} cells and {animation.frame_count} frames "
            f"{animation.width or animation.picture.width} pixels wide need about {readable_size(need)} of "
            f"memory, {readable_size(there)} are free; lower --cells or --width"
            + (", or write a movie or a sequence instead of a GIF" if frames_kept else "")
        )
