"""The transpose of filling ghosts: gradients of ghosts are added to those of the cells that they copy."""

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
    """f_bar[source] += sign f_bar[ghost], f_bar[ghost] = 0 along column t, counted with the halo, in place.

    Faces on a wall are set to 0 too.
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
    """f_bar[source] += sign f_bar[ghost], f_bar[ghost] = 0 along row t, in place; after all columns."""
    row = (t + 2) * pitch
    for m in range(5):
        i = m
        if m > 2:
            i = nx + m - 1
        ghost = f_bar[row + i]
        f_bar[row + i] = Real(0.0)
        f_bar[row + column_source[i]] += column_sign[i] * ghost
