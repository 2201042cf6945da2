"""Tables of rows, one a step, in a loop whose steps are counted on the device.

A graph bakes in pointers, so that one captured step serves a run of any length only if it finds by a number
in device memory which state to begin with, what acts, and where to leave the next: step[0] is the row,
step[1] where the loop ends. Rows are copied in chunks, one a line.
"""

import warp as wp
from wfluid.kernels.cell.program import adjoint_lines
from wfluid.kernels.cell.real import Field, Indices

_COPY = """
    const long long begin = (long long)t * chunk, left = size - begin;
    const long long count = left < chunk ? left : chunk;
    memcpy({to} + begin, {source} + begin, count * sizeof(*{to}));
"""


@wp.func_native(_COPY.format(to="out.data", source="(table.data + (long long)row * size)"))
def copy_from(t: int, table: Field, row: int, size: int, chunk: int, out: Field):
    """Chunk t of a row of `size` entries."""
    ...


@wp.func_native(_COPY.format(to="out.data", source="(table.data + (long long)row * size)"))
def copy_indices_from(t: int, table: Indices, row: int, size: int, chunk: int, out: Indices):
    """Chunk t of a row of `size` indices."""
    ...


@wp.func_native(_COPY.format(to="(table.data + (long long)row * size)", source="f.data"))
def copy_to(t: int, f: Field, row: int, size: int, chunk: int, table: Field):
    """Chunk t of a row of `size` entries."""
    ...


@adjoint_lines
def take(
    t: int,
    table: Field,
    step: Indices,
    ahead: int,
    size: int,
    chunk: int,
    # outputs
    out: Field,
):
    """out = the row that is `ahead` of the step's."""
    copy_from(t, table, step[0] + ahead, size, chunk, out)


@adjoint_lines
def take_indices(
    t: int,
    table: Indices,
    step: Indices,
    ahead: int,
    size: int,
    chunk: int,
    # outputs
    out: Indices,
):
    """out = the row that is `ahead` of the step's."""
    copy_indices_from(t, table, step[0] + ahead, size, chunk, out)


@adjoint_lines
def give(
    t: int,
    f: Field,
    step: Indices,
    ahead: int,
    size: int,
    chunk: int,
    # outputs
    table: Field,
):
    """The row that is `ahead` of the step's = f."""
    copy_to(t, f, step[0] + ahead, size, chunk, table)


@adjoint_lines
def copy(
    t: int,
    f: Field,
    size: int,
    chunk: int,
    # outputs
    out: Field,
):
    """out = f."""
    copy_from(t, f, 0, size, chunk, out)


@adjoint_lines
def count(
    t: int,
    by: int,
    # outputs
    step: Indices,
    going: Indices,
):
    """Go on by so many rows; whether the end is still ahead."""
    step[0] = step[0] + by
    going[0] = int(step[0] != step[1])


@adjoint_lines
def add_row(
    t: int,
    table: Field,
    step: Indices,
    ahead: int,
    size: int,
    # outputs
    out: Field,
):
    """Add entry t of the row that is `ahead` of the step's, in place."""
    out[t] = out[t] + table[(step[0] + ahead) * size + t]
