"""Stages on a `wp.Tape`: each stage of a step records its own transpose, next to its launches.

    with recording() as tape:
        step.advance(before, after, forcing)
    tape.backward()

`x.grad` is x_bar, the gradient of an objective with respect to the cells of x. The transpose of a stage reads
the gradients of the stage's outputs and computes those of its inputs:

* An input that several stages read (the state, the velocity after forces, the feet): its gradient is 0 when
  the tape begins to play (`Step.advance` records that last), and every transpose adds to it.
* An input that one stage reads (the velocities from the advection to the projection, the points): the
  transpose overwrites its gradient. For these velocities it also fills the gradient's ghosts.

Ghosts are no unknowns. A transpose that scatters into the ghosts of a gradient then folds them: it adds
their values to the cells they copy.

Every array is written by one stage. A stage may add in place to an array that it has just written (forces to
a velocity, sources to a density or to a divergence). That is linear and part of the stage: the transpose of
y = x + s passes y_bar to both x and s.

Without a tape nothing is recorded or allocated. `allow_gradients` of a stage allocates its gradients and
the scratch arrays of its transpose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

import warp as wp

from wfluid.fields.arrays import Vector, field
from wfluid.kernels.cell.layout import Layout

_TAPE: ContextVar[wp.Tape | None] = ContextVar("tape", default=None)
"""The tape that is recording in this thread. Warp's own `with tape` holds for all threads."""


@contextmanager
def recording() -> Iterator[wp.Tape]:
    """A new tape. Stages that launch within the block record their transposes on it."""
    tape = wp.Tape()
    token = _TAPE.set(tape)
    try:
        yield tape
    finally:
        _TAPE.reset(token)


def record(backward: Callable[[], None], reads: Iterable[wp.array], writes: Iterable[wp.array]) -> None:
    """Put the transpose of a stage that has just launched on the tape, if one is recording.

    `reads` and `writes` are the stage's arrays, which Warp checks for overwriting if
    `wp.config.verify_autograd_array_access` is set.

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


def attach_gradients(fields: Sequence[wp.array], layout: Layout, device: wp.Device) -> None:
    """Allocate the gradients of fields that have none yet."""
    for f in fields:
        if f.grad is None:
            f.grad = field(layout, device)
