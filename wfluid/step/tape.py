"""Stages on a `wp.Tape`: each stage of a step records its own transpose, right where it launches.

    with recording() as tape:
        step.advance(before, after, forcing)
    tape.backward()

x_bar, the gradient of an objective with respect to the cells of x, is kept in `x.grad`. The transpose of a
stage reads the gradients of what the stage wrote. To the gradients of what it read it adds:

* Where several stages read an array (the state, the velocity after forces, the feet), its gradient is 0
  when the tape begins to play (`Step.advance` records that last) and every reader adds its part.
* From the advection to the projection each velocity has one reader, and so has a point: there the
  transpose writes the gradient over. These velocities' gradients come with their ghosts filled.

Ghosts are no unknowns. A transpose that scatters into the ghosts of a gradient folds them into the cells
that they copy before it ends.

Every array is written by one stage. What a stage adds in place to an array that it has just written
(forces to a velocity, sources to a density or to a divergence) is part of that stage, and linear: the
transpose of y = x + s hands y_bar on to both x and s.

Without a tape nothing is recorded and nothing allocated. A stage's gradients, and what its transpose works
with, are allocated by `allow_gradients`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

import warp as wp

from wfluid.fields.arrays import Vector, vector
from wfluid.kernels.cell.layout import Layout

_TAPE: ContextVar[wp.Tape | None] = ContextVar("tape", default=None)
"""The tape that is recording in this thread. Warp's own `with tape` holds for all threads."""


@contextmanager
def recording() -> Iterator[wp.Tape]:
    """A new tape, on which stages that launch within leave their transposes."""
    tape = wp.Tape()
    token = _TAPE.set(tape)
    try:
        yield tape
    finally:
        _TAPE.reset(token)


def record(backward: Callable[[], None], reads: Iterable[wp.array], writes: Iterable[wp.array]) -> None:
    """Put the transpose of a stage that has just launched on the tape that is recording, if any.

    Warp learns what the stage read and wrote (`wp.config.verify_autograd_array_access`).

    Raises:
        RuntimeError: an array has no gradient.
    """
    tape = _TAPE.get()
    if tape is None:
        return
    reads, writes = ([a for a in arrays if a.size] for arrays in (reads, writes))
    if wp.config.verify_autograd_array_access:
        for a in writes:
            a.mark_write(operation="a stage", filename=__file__, lineno=0)
        for a in reads:
            a.mark_read()
    tape.record_func(backward, [*reads, *writes])


def bars(arrays: Sequence[wp.array]) -> Vector:
    """The gradient of each array."""
    return tuple(a.grad for a in arrays)


def attach_gradients(arrays: Sequence[wp.array], layout: Layout) -> None:
    """Allocate the gradients of fields that have none yet."""
    for a in arrays:
        if a.grad is None:
            (a.grad,) = vector(layout, a.device, 1)
