"""Between a grid and the next coarser one: restriction and prolongation, one axis at a time.

A fine point at coarse position c + t, c an integer, is interpolated linearly, (1 - t) e[c] + t e[c + 1]; the
ghosts of e hold the walls. The tables are computed per axis for any two sizes (`wfluid/solve/transfer`), so
odd and prime sizes need no special case; their rows and columns count the halo. Restriction is the transpose,
scaled by the ratio of the two sizes: along each axis a coarse point sums at most four fine points.

Each axis is done where it is cheapest: restriction first along y, with one weight for a row, then along x on
fewer rows; prolongation in the opposite order.
"""

from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Indices, RowIndex, RowReal


@cells
def restrict_y(
    i: int,
    j: int,
    k: int,
    r: Field,
    row_1: RowIndex,
    row_2: RowIndex,
    row_3: RowIndex,
    row_4: RowIndex,
    weight_1: RowReal,
    weight_2: RowReal,
    weight_3: RowReal,
    weight_4: RowReal,
    pitch: int,
    # outputs
    out: Field,
):
    """out = weight_1 r[row_1] + … + weight_4 r[row_4] in coarse row j, fine column i. One pitch."""
    k = inside(k)
    a = inside(k + (row_1 - 2 - j) * pitch)
    b = inside(k + (row_2 - 2 - j) * pitch)
    c = inside(k + (row_3 - 2 - j) * pitch)
    d = inside(k + (row_4 - 2 - j) * pitch)
    out[k] = weight_1 * r[a] + weight_2 * r[b] + weight_3 * r[c] + weight_4 * r[d]


@cells
def restrict_x(
    i: int,
    j: int,
    k: int,
    r: Field,
    column_1: Indices,
    column_2: Indices,
    column_3: Indices,
    column_4: Indices,
    weight_1: Field,
    weight_2: Field,
    weight_3: Field,
    weight_4: Field,
    pitch: int,
    # outputs
    out: Field,
):
    """out = weight_1 r[column_1] + … + weight_4 r[column_4] in row j, coarse column i. r has `pitch`."""
    k = inside(k)
    i = entry(i)
    start = (j + 2) * pitch
    west = gather(weight_1, i) * gather(r, start + column_1[i])
    west += gather(weight_2, i) * gather(r, start + column_2[i])
    east = gather(weight_3, i) * gather(r, start + column_3[i])
    east += gather(weight_4, i) * gather(r, start + column_4[i])
    out[k] = west + east


@cells
def prolong_x(
    i: int,
    j: int,
    k: int,
    e: Field,
    column: Indices,
    fraction: Field,
    pitch: int,
    # outputs
    out: Field,
):
    """out = e[column] + fraction (e[column + 1] - e[column]) in row j, fine column i. e has pitch `pitch`."""
    k = inside(k)
    i = entry(i)
    first = (j + 2) * pitch + column[i]
    west = gather(e, first)
    out[k] = west + gather(fraction, i) * (gather(e, first + 1) - west)


@cells
def prolong_y_add(
    i: int,
    j: int,
    k: int,
    x: Field,
    e: Field,
    row: RowIndex,
    fraction: RowReal,
    pitch: int,
    # outputs
    out: Field,
):
    """out = x + e[row] + fraction (e[row + 1] - e[row]) in fine row j. x, e and out have one pitch."""
    k = inside(k)
    a = inside(k + (row - 2 - j) * pitch)
    b = inside(k + (row - 1 - j) * pitch)
    out[k] = x[k] + e[a] + fraction * (e[b] - e[a])
