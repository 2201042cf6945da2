"""The adjoint of the look-up (`view/lookup`). x_bar stands for the gradient of an objective with respect to
x.

The value shown is a weighted sum of the pixels p around the source, tx and ty past one of them,

    shown = sum_p w_p(tx, ty) picture_p   so   x_bar = sum_p (dw_p / dtx) <picture_p, shown_bar>

and y_bar likewise: a look-up like that of the forward pass, of one number per pixel. Along each axis the
interpolation of the displacement from cells to pixels is a matrix. Its transpose, in which the weights of
ghosts are added to those of the cells that they copy, is a table: for each cell the pixels that read it, with
their weights. So every entry is written once, in a fixed order, and nothing scatters.

The cubic look-up has a continuous slope. The bilinear one has kinks at the centres of the pixels; there the
slope of the interval after the centre is taken.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import Program, adjoint_cells
from wfluid.kernels.cell.real import Field, Indices, Real, RowIndex
from wfluid.kernels.step.interpolation import cubic_slopes, cubic_weights
from wfluid.kernels.view.lookup import FAR, Pixel, Pixels, at_edge, whole_and_fraction


@wp.func
def follows(coordinate: Real):
    """Derivative of the coordinate that `whole_and_fraction` takes: 1, or 0 beyond its limit `FAR`."""
    return wp.where(wp.abs(coordinate) < FAR, Real(1.0), Real(0.0))


@wp.func
def product(picture: Pixels, column: int, row: int, width: int, bar: Pixel):
    """<picture[row, column], bar> over the channels; 0 where `at_edge` finds no pixel."""
    value = Real(0.0)
    if column >= 0 and row >= 0:
        value = wp.dot(picture[entry(row * width + column)], bar)
    return value


@wp.func
def bilinear_slopes(
    picture: Pixels,
    bar: Pixel,
    x: int,
    y: int,
    tx: Real,
    ty: Real,
    width: int,
    height: int,
    edge_x: int,
    edge_y: int,
):
    """d/dtx and d/dty of <picture, bar> by bilinear interpolation, tx and ty past pixel (x, y)."""
    west = at_edge(x, width, edge_x)
    east = at_edge(x + 1, width, edge_x)
    north = at_edge(y, height, edge_y)
    south = at_edge(y + 1, height, edge_y)
    a = product(picture, west, north, width, bar)
    b = product(picture, east, north, width, bar)
    c = product(picture, west, south, width, bar)
    d = product(picture, east, south, width, bar)
    return b - a + ty * (d - c - b + a), c - a + tx * (d - c - b + a)


@wp.func
def cubic_slopes_at(
    picture: Pixels,
    bar: Pixel,
    x: int,
    y: int,
    tx: Real,
    ty: Real,
    width: int,
    height: int,
    edge_x: int,
    edge_y: int,
):
    """d/dtx and d/dty of <picture, bar> by Catmull-Rom interpolation, tx and ty past pixel (x, y)."""
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    dx = cubic_slopes(tx)
    dy = cubic_slopes(ty)
    slope_x = Real(0.0)
    slope_y = Real(0.0)
    if x >= 1 and y >= 1 and x + 2 < width and y + 2 < height:
        for m in range(4):
            first = entry((y + m - 1) * width + x - 1)
            a = wp.dot(picture[first], bar)
            b = wp.dot(picture[first + 1], bar)
            c = wp.dot(picture[first + 2], bar)
            d = wp.dot(picture[first + 3], bar)
            slope_x += wy[m] * (dx[0] * a + dx[1] * b + dx[2] * c + dx[3] * d)
            slope_y += dy[m] * (wx[0] * a + wx[1] * b + wx[2] * c + wx[3] * d)
    else:
        for m in range(4):
            row = at_edge(y + m - 1, height, edge_y)
            for n in range(4):
                value = product(picture, at_edge(x + n - 1, width, edge_x), row, width, bar)
                slope_x += wy[m] * dx[n] * value
                slope_y += dy[m] * wx[n] * value
    return slope_x, slope_y


def _look_up_adjoint(slopes: wp.Function) -> Program:
    @adjoint_cells
    def look_up_adjoint(
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
        """Add to x_bar and y_bar the gradient with respect to the source [px] of pixel k, in place.

        shown_bar is the gradient with respect to the pixel's value; the other arrays are those of `look_up`.
        """
        k = inside(k)
        x, tx = whole_and_fraction(source_x[k])
        y, ty = whole_and_fraction(source_y[k])
        slope_x, slope_y = slopes(picture, shown_bar[k], x, y, tx, ty, width, height, edge_x, edge_y)
        x_bar[k] = x_bar[k] + slope_x * follows(source_x[k])
        y_bar[k] = y_bar[k] + slope_y * follows(source_y[k])

    return look_up_adjoint


look_up_adjoint_bilinear = _look_up_adjoint(bilinear_slopes)
look_up_adjoint_cubic = _look_up_adjoint(cubic_slopes_at)


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
    """d_bar = slope sum weight source_bar: the transpose of `stretch_x`, at grid column i of pixel row j.

    The pixels that read column i are entries first[i] … first[i + 1] - 1 of `column` and `weight`; columns
    beyond the grid, which the last span reaches, have none, so d_bar is 0 there. source_bar [1/px] is over
    the pixels, with pitch `pitch`; d_bar [1/cells] has no ghosts.
    """
    k = inside(k)
    i = entry(i)
    row = index(0, j, pitch)
    total = Real(0.0)
    for n in range(first[i], first[entry(i + 1)]):
        total += gather(weight, n) * gather(source_bar, row + column[entry(n)])
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
    """d_bar += sum weight out_bar: the transpose of `stretch_y`, at grid column i and grid row j, in place.

    The pixel rows that read grid row j are entries `first` … `end` - 1 of `row` and `weight`. Both gradients
    are in 1/cells; `pitch` is that of out_bar.
    """
    k = inside(k)
    total = Real(0.0)
    for n in range(first, end):
        total += gather(weight, n) * gather(out_bar, index(i, row[entry(n)], pitch))
    d_bar[k] = d_bar[k] + total
