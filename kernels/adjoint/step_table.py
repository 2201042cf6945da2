"""Tables with one row per step, in a loop whose steps are counted on the device.

A captured graph contains fixed pointers. One captured step therefore serves a run of any length only if a
number in device memory selects the rows that hold its state and forces and that receive the next state:
step[0] is the row, step[1] the row at which the loop ends. Rows are copied in chunks, one chunk per line.
"""

import warp as wp
from wfluid.kernels.cell.program import adjoint_lines
from wfluid.kernels.cell.real import Field, Indices

_COPY = """
    const long long begin = (long long)t * chunk, rest = size - begin;
    const long long count = rest < chunk ? rest : chunk;
    memcpy({to} + begin, {source} + begin, count * sizeof(*{to}));
"""


@wp.func_native(_COPY.format(to="out.data", source="(table.data + (long long)row * size)"))
def copy_from(t: int, table: Field, row: int, size: int, chunk: int, out: Field):
    """Copy chunk t of a row of `size` entries."""
    ...


@wp.func_native(_COPY.format(to="out.data", source="(table.data + (long long)row * size)"))
def copy_indices_from(t: int, table: Indices, row: int, size: int, chunk: int, out: Indices):
    """Copy chunk t of a row of `size` indices."""
    ...


@wp.func_native(_COPY.format(to="(table.data + (long long)row * size)", source="f.data"))
def copy_to(t: int, f: Field, row: int, size: int, chunk: int, table: Field):
    """Copy chunk t of a row of `size` entries."""
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
    """out = table[step + ahead], chunk t."""
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
    """out = table[step + ahead], chunk t."""
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
    """table[step + ahead] = f, chunk t."""
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
    """out = f, chunk t."""
    copy_from(t, f, 0, size, chunk, out)


@adjoint_lines
def count(
    t: int,
    by: int,
    # outputs
    step: Indices,
    going: Indices,
):
    """step += by; going = 1 before the end of the loop, else 0."""
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
    """out[t] += table[step + ahead, t], in place."""
    out[t] = out[t] + table[(step[0] + ahead) * size + t]
