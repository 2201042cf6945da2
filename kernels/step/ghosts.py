"""Ghost cells: the wall conditions, as data.

Along each axis every padded position has a source position inside the grid and a sign::

    f[ghost] = sign * f[source]

so that one kernel serves even reflection (zero slope), odd reflection (zero value at the wall), faces on a
wall (zero) and periodic copies (`wfluid/domain/walls`). The sign of a ghost in a corner is the product of the
signs of both axes, so rows and columns may be filled in any order.

The field is changed in place: only ghosts and faces on a wall are written, only other entries are read.
"""

from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Indices


@lines
def fill(
    t: int,
    column_source: Indices,
    column_sign: Field,
    row_source: Indices,
    row_sign: Field,
    nx: int,
    ny: int,
    pitch: int,
    # outputs
    f: Field,
):
    """f[ghost] = sign f[source] in row t for t < ny, then in column t - ny, counted with the halo.

    `column_source`, `column_sign` have nx + 4 entries for columns -2 … nx + 1, `row_*` likewise.
    The first column and row of cells are written too, since their faces may be on a wall.
    """
    if t < ny:
        j = t + 2
        from_row = row_source[j] * pitch
        sign = row_sign[j]
        for m in range(5):
            i = m
            if m > 2:
                i = nx + m - 1
            f[j * pitch + i] = sign * column_sign[i] * f[from_row + column_source[i]]
    else:
        i = t - ny
        source = column_source[i]
        sign = column_sign[i]
        for m in range(5):
            j = m
            if m > 2:
                j = ny + m - 1
            f[j * pitch + i] = sign * row_sign[j] * f[row_source[j] * pitch + source]
