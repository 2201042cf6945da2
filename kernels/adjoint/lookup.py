"""The adjoint of the look-up (`lookup`), and the misfit of what it shows. x_bar stands for the gradient of an
objective with respect to x.

A pixel shows a sum of the source's pixels p around the place it reads, with weights of the fractions there,

    shown = sum_p w_p(tx, ty) picture_p   so   x_bar = sum_p (dw_p / dtx) <picture_p, shown_bar>

and y_bar likewise: a look-up like the forward one, of one number a pixel. The interpolation of the
displacement from cells up to pixels is a matrix an axis; its transpose, ghosts folded to the cells that they
copy, comes as a table too: for each cell the pixels that read it, with their weights. So every entry is
written by itself, in one order, and nothing scatters.

The cubic look-up has a continuous slope; the bilinear one has kinks at the centres of the source's pixels,
and there the slope of the side after them.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Indices, Real, RowIndex
from wfluid.kernels.step.interpolation import cubic_slopes, cubic_weights
from wfluid.kernels.view.lookup import FAR, Pixel, Pixels, at_edge, whole_and_fraction


@wp.func
def follows(coordinate: Real):
    """1 where `whole_and_fraction` follows the coordinate, 0 where it stops it."""
    return wp.where(wp.abs(coordinate) < FAR, Real(1.0), Real(0.0))


@wp.func
def seen(picture: Pixels, column: int, row: int, width: int, bar: Pixel):
    """Pixel (column, row), its channels weighed by `bar` and added; 0 where `at_edge` found none."""
    value = Real(0.0)
    if column >= 0 and row >= 0:
        value = wp.dot(picture[entry(row * width + column)], bar)
    return value


@adjoint_cells
def look_up_adjoint_bilinear(
    i: int,
    j: int,
    k: int,
    picture: Pixels,
    source_x: Field,
    source_y: Field,
    shown_bar: Pixels,
    width: int,
    height: int,
    edge_x: int,
    edge_y: int,
    # outputs
    x_bar: Field,
    y_bar: Field,
):
    """Add to the gradient with respect to pixel k's source what `look_up_bilinear` has for it."""
    k = inside(k)
    x, tx = whole_and_fraction(source_x[k])
    y, ty = whole_and_fraction(source_y[k])
    west = at_edge(x, width, edge_x)
    east = at_edge(x + 1, width, edge_x)
    north = at_edge(y, height, edge_y)
    south = at_edge(y + 1, height, edge_y)
    bar = shown_bar[k]
    a = seen(picture, west, north, width, bar)
    b = seen(picture, east, north, width, bar)
    c = seen(picture, west, south, width, bar)
    d = seen(picture, east, south, width, bar)
    along_x = b - a + ty * (d - c - b + a)
    along_y = c - a + tx * (d - c - b + a)
    x_bar[k] = x_bar[k] + along_x * follows(source_x[k])
    y_bar[k] = y_bar[k] + along_y * follows(source_y[k])


@adjoint_cells
def look_up_adjoint_cubic(
    i: int,
    j: int,
    k: int,
    picture: Pixels,
    source_x: Field,
    source_y: Field,
    shown_bar: Pixels,
    width: int,
    height: int,
    edge_x: int,
    edge_y: int,
    # outputs
    x_bar: Field,
    y_bar: Field,
):
    """Add to the gradient with respect to pixel k's source what `look_up_cubic` has for it."""
    k = inside(k)
    x, tx = whole_and_fraction(source_x[k])
    y, ty = whole_and_fraction(source_y[k])
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    dx = cubic_slopes(tx)
    dy = cubic_slopes(ty)
    bar = shown_bar[k]
    along_x = Real(0.0)
    along_y = Real(0.0)
    if x >= 1 and y >= 1 and x + 2 < width and y + 2 < height:
        for m in range(4):
            at = entry((y + m - 1) * width + x - 1)
            a = wp.dot(picture[at], bar)
            b = wp.dot(picture[at + 1], bar)
            c = wp.dot(picture[at + 2], bar)
            d = wp.dot(picture[at + 3], bar)
            along_x += wy[m] * (dx[0] * a + dx[1] * b + dx[2] * c + dx[3] * d)
            along_y += dy[m] * (wx[0] * a + wx[1] * b + wx[2] * c + wx[3] * d)
    else:
        for m in range(4):
            row = at_edge(y + m - 1, height, edge_y)
            for n in range(4):
                value = seen(picture, at_edge(x + n - 1, width, edge_x), row, width, bar)
                along_x += wy[m] * dx[n] * value
                along_y += dy[m] * wx[n] * value
    x_bar[k] = x_bar[k] + along_x * follows(source_x[k])
    y_bar[k] = y_bar[k] + along_y * follows(source_y[k])


@adjoint_cells
def stretch_x_adjoint(
    i: int,
    j: int,
    k: int,
    source_bar: Field,
    first: Indices,
    column: Indices,
    weight: Field,
    pitch: int,
    slope: Real,
    # outputs
    d_bar: Field,
):
    """The transpose of `stretch_x`, ghosts folded: d_bar of grid column i in pixel row j.

    The pixels that read column i are entries first[i] … first[i + 1] - 1 of `column` and `weight`; columns
    beyond the grid, which the last span runs into, have none and become 0. `pitch` is source_bar's.
    """
    k = inside(k)
    i = entry(i)
    at = index(0, j, pitch)
    total = Real(0.0)
    for n in range(first[i], first[entry(i + 1)]):
        total += gather(weight, n) * gather(source_bar, at + column[entry(n)])
    d_bar[k] = slope * total


@adjoint_cells
def stretch_y_adjoint(
    i: int,
    j: int,
    k: int,
    out_bar: Field,
    first: RowIndex,
    end: RowIndex,
    row: Indices,
    weight: Field,
    pitch: int,
    # outputs
    d_bar: Field,
):
    """Add the transpose of `stretch_y`, ghosts folded, to d_bar: from the pixel rows that read grid row j.

    They are entries `first` … `end` - 1 of `row` and `weight`.
    """
    k = inside(k)
    total = Real(0.0)
    for n in range(first, end):
        total += gather(weight, n) * gather(out_bar, index(i, row[entry(n)], pitch))
    d_bar[k] = d_bar[k] + total
