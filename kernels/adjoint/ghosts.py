"""The transpose of filling ghosts: their gradients go to the cells they copy."""

from wfluid.kernels.cell.program import adjoint_lines
from wfluid.kernels.cell.real import Field, Indices, Real


@adjoint_lines
def fold_columns(
    t: int,
    row_source: Indices,
    row_sign: Field,
    ny: int,
    pitch: int,
    # outputs
    f_bar: Field,
):
    """The transpose of `fill` along column t (counted with the halo): ghosts add to their sources.

    They themselves come out as 0, and so do faces on a wall.
    """
    for m in range(5):
        j = m
        if m > 2:
            j = ny + m - 1
        ghost = f_bar[j * pitch + t]
        f_bar[j * pitch + t] = Real(0.0)
        f_bar[row_source[j] * pitch + t] += row_sign[j] * ghost


@adjoint_lines
def fold_rows(
    t: int,
    column_source: Indices,
    column_sign: Field,
    nx: int,
    pitch: int,
    # outputs
    f_bar: Field,
):
    """The same along row t, after all columns."""
    at = (t + 2) * pitch
    for m in range(5):
        i = m
        if m > 2:
            i = nx + m - 1
        ghost = f_bar[at + i]
        f_bar[at + i] = Real(0.0)
        f_bar[at + column_source[i]] += column_sign[i] * ghost
