"""The look-up of a picture through a map: new(x, y) = old(source of (x, y)).

First the displacement is interpolated from the fluid's cells to the pixels with Catmull-Rom cubics, along y
and then along x, with one set of weights per row and per column. Then every pixel reads its source. Pixel
coordinates count from the centre of the first pixel. A picture is an array of 4-vectors, one per pixel, row
by row without padding: its four channels are read, weighted and added at once.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import Program, cells
from wfluid.kernels.cell.real import Field, Indices, Real, RowIndex, RowReal
from wfluid.kernels.step.interpolation import Four, cubic_weights

Pixel = Four
Pixels = wp.array[Pixel]

CLAMP = wp.constant(0)
MIRROR = wp.constant(1)
WRAP = wp.constant(2)


@cells
def stretch_y(
    i: int,
    j: int,
    k: int,
    d: Field,
    row: RowIndex,
    weight_1: RowReal,
    weight_2: RowReal,
    weight_3: RowReal,
    weight_4: RowReal,
    pitch: int,
    # outputs
    out: Field,
):
    """out = weight_1 d[row - 1] + … + weight_4 d[row + 2]: the displacement in pixel row j at grid column i.

    d and out are displacements at centres [cells]; `row` is the grid row before pixel row j.
    """
    k = inside(k)
    a = inside(k + (row - 3 - j) * pitch)
    b = inside(k + (row - 2 - j) * pitch)
    c = inside(k + (row - 1 - j) * pitch)
    e = inside(k + (row - j) * pitch)
    out[k] = weight_1 * d[a] + weight_2 * d[b] + weight_3 * d[c] + weight_4 * d[e]


@cells
def stretch_x(
    i: int,
    j: int,
    k: int,
    d: Field,
    column: Indices,
    weight_1: Field,
    weight_2: Field,
    weight_3: Field,
    weight_4: Field,
    pitch: int,
    origin: Real,
    step_x: Real,
    step_y: Real,
    slope: Real,
    # outputs
    out: Field,
):
    """out = origin + step_x i + step_y j + slope d: the source coordinate [px] of pixel (i, j).

    d [cells] is interpolated along row j from four grid columns, `column`[i] the first of them.
    """
    k = inside(k)
    i = entry(i)
    first = index(column[i], j, pitch)
    west = gather(weight_1, i) * gather(d, first) + gather(weight_2, i) * gather(d, first + 1)
    east = gather(weight_3, i) * gather(d, first + 2) + gather(weight_4, i) * gather(d, first + 3)
    out[k] = origin + step_x * Real(i) + step_y * Real(j) + slope * (west + east)


@wp.func
def modulo(i: int, n: int):
    """i mod n in 0 … n - 1, for negative i too."""
    m = i % n
    return wp.where(m < 0, m + n, m)


@wp.func
def at_edge(i: int, n: int, edge: int):
    """The pixel 0 … n - 1 that position i reads under the edge rule, or -1 for none."""
    inner = i
    if i < 0 or i >= n:
        if edge == CLAMP:
            inner = wp.clamp(i, 0, n - 1)
        elif edge == MIRROR:
            inner = modulo(i, 2 * n)
            inner = wp.where(inner < n, inner, 2 * n - 1 - inner)
        elif edge == WRAP:
            inner = modulo(i, n)
        else:
            inner = -1
    return inner


@wp.func
def pixel(picture: Pixels, x: int, y: int, width: int, height: int, edge_x: int, edge_y: int):
    """Pixel (x, y) of the picture continued beyond its edges."""
    column = at_edge(x, width, edge_x)
    row = at_edge(y, height, edge_y)
    value = Pixel()
    if column >= 0 and row >= 0:
        value = picture[row * width + column]
    return value


FAR = wp.constant(Real(1.0e8))
"""Limit of source coordinates [px], so that they fit an integer."""


@wp.func
def whole_and_fraction(coordinate: Real):
    """Split a source coordinate [px]: the index of the pixel before it, the fraction past that pixel."""
    stopped = wp.min(wp.max(coordinate, -FAR), FAR)
    before = wp.floor(stopped)
    return int(before), stopped - before


@wp.func
def nearest(
    picture: Pixels, x_source: Real, y_source: Real, width: int, height: int, edge_x: int, edge_y: int
):
    """The pixel whose square contains the source."""
    x, _tx = whole_and_fraction(x_source + Real(0.5))
    y, _ty = whole_and_fraction(y_source + Real(0.5))
    return pixel(picture, x, y, width, height, edge_x, edge_y)


@wp.func
def bilinear(
    picture: Pixels, x_source: Real, y_source: Real, width: int, height: int, edge_x: int, edge_y: int
):
    """Bilinear interpolation between the four pixels around the source."""
    x, tx = whole_and_fraction(x_source)
    y, ty = whole_and_fraction(y_source)
    sx = Real(1.0) - tx
    north = Pixel()
    south = Pixel()
    if x >= 0 and y >= 0 and x + 1 < width and y + 1 < height:
        first = entry(y * width + x)
        below = entry(y * width + width + x)
        north = sx * picture[first] + tx * picture[first + 1]
        south = sx * picture[below] + tx * picture[below + 1]
    else:
        north = sx * pixel(picture, x, y, width, height, edge_x, edge_y)
        north += tx * pixel(picture, x + 1, y, width, height, edge_x, edge_y)
        south = sx * pixel(picture, x, y + 1, width, height, edge_x, edge_y)
        south += tx * pixel(picture, x + 1, y + 1, width, height, edge_x, edge_y)
    return (Real(1.0) - ty) * north + ty * south


_REAL = f"wp::{Real.__name__}"
_CUBIC_INSIDE = f"""
    __builtin_assume(first >= 0);
    wp::vec_t<4, {_REAL}> value;
#if defined(__CUDA_ARCH__)
    typedef wp::vec_t<4, {_REAL}> four;
#else
    typedef {_REAL} four
        __attribute__((vector_size(4 * sizeof({_REAL})), aligned(sizeof({_REAL})), may_alias));
#endif
    // weights of the four points, as polynomials of the fraction: Catmull and Rom's matrix
    const four c0 = {{0, 1, 0, 0}}, c1 = {{-0.5, 0, 0.5, 0}};
    const four c2 = {{1, -2.5, 2, -0.5}}, c3 = {{-0.5, 1.5, -1.5, 0.5}};
    const four x = c0 + tx * (c1 + tx * (c2 + tx * c3));
    const four y = c0 + ty * (c1 + ty * (c2 + ty * c3));
    const four* p = (const four*)(picture.data + first);
    four sum = y[0] * (x[0] * p[0] + x[1] * p[1] + x[2] * p[2] + x[3] * p[3]);
    p += width;
    sum += y[1] * (x[0] * p[0] + x[1] * p[1] + x[2] * p[2] + x[3] * p[3]);
    p += width;
    sum += y[2] * (x[0] * p[0] + x[1] * p[1] + x[2] * p[2] + x[3] * p[3]);
    p += width;
    sum += y[3] * (x[0] * p[0] + x[1] * p[1] + x[2] * p[2] + x[3] * p[3]);
    memcpy(&value, &sum, sizeof(value));
    return value;
"""


@wp.func_native(_CUBIC_INSIDE)
def cubic_inside(picture: Pixels, first: int, width: int, tx: Real, ty: Real) -> Pixel:
    """Catmull-Rom interpolation over 4 x 4 pixels, all inside the picture; `first` is the index of the first.

    Native code keeps the four channels in one register, which takes half the time.
    """
    ...


@wp.func
def cubic_at_edges(
    picture: Pixels, x: int, y: int, tx: Real, ty: Real, width: int, height: int, edge_x: int, edge_y: int
):
    """Catmull-Rom interpolation over 4 x 4 pixels from (x, y) on, some beyond the picture's edges."""
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    value = Pixel()
    for m in range(4):
        line = wx[0] * pixel(picture, x, y + m, width, height, edge_x, edge_y)
        line += wx[1] * pixel(picture, x + 1, y + m, width, height, edge_x, edge_y)
        line += wx[2] * pixel(picture, x + 2, y + m, width, height, edge_x, edge_y)
        line += wx[3] * pixel(picture, x + 3, y + m, width, height, edge_x, edge_y)
        value += wy[m] * line
    return value


@wp.func
def cubic(picture: Pixels, x_source: Real, y_source: Real, width: int, height: int, edge_x: int, edge_y: int):
    """Catmull-Rom interpolation over the sixteen pixels around the source."""
    x, tx = whole_and_fraction(x_source)
    y, ty = whole_and_fraction(y_source)
    value = Pixel()
    if x >= 1 and y >= 1 and x + 2 < width and y + 2 < height:
        value = cubic_inside(picture, (y - 1) * width + x - 1, width, tx, ty)
    else:
        value = cubic_at_edges(picture, x - 1, y - 1, tx, ty, width, height, edge_x, edge_y)
    return value


PI = wp.constant(Real(3.14159265358979323846))


@wp.func
def lanczos_weight(x: Real):
    """sinc(x) sinc(x / 3) for |x| < 3 (Lanczos, three lobes)."""
    weight = Real(1.0)
    if wp.abs(x) > Real(1.0e-4):
        angle = PI * x
        weight = Real(3.0) * wp.sin(angle) * wp.sin(angle / Real(3.0)) / (angle * angle)
    return weight


@wp.func
def lanczos(
    picture: Pixels, x_source: Real, y_source: Real, width: int, height: int, edge_x: int, edge_y: int
):
    """Lanczos-3 over the thirty-six pixels around the source; the weights are scaled to a sum of 1."""
    x, tx = whole_and_fraction(x_source)
    y, ty = whole_and_fraction(y_source)
    value = Pixel()
    total = Real(0.0)
    for m in range(6):
        wy = lanczos_weight(Real(m - 2) - ty)
        line = Pixel()
        row = Real(0.0)
        for n in range(6):
            wx = lanczos_weight(Real(n - 2) - tx)
            line += wx * pixel(picture, x + n - 2, y + m - 2, width, height, edge_x, edge_y)
            row += wx
        value += wy * line
        total += wy * row
    return value / total


def _look_up(interpolate: wp.Function) -> Program:
    @cells
    def look_up(
        i: int,
        j: int,
        k: int,
        picture: Pixels,
        source_x: Field,
        source_y: Field,
        width: int,
        height: int,
        edge_x: int,
        edge_y: int,
        # outputs
        out: Pixels,
    ):
        """out = the value of the picture (height rows of width pixels) at the source of pixel k.

        source_x and source_y [px] count from the centre of the first pixel; edge_x and edge_y are `CLAMP`,
        `MIRROR`, `WRAP` or another number for a picture that is 0 beyond its edges.
        """
        k = inside(k)
        out[k] = interpolate(picture, source_x[k], source_y[k], width, height, edge_x, edge_y)

    return look_up


look_up_nearest = _look_up(nearest)
look_up_bilinear = _look_up(bilinear)
look_up_cubic = _look_up(cubic)
look_up_lanczos = _look_up(lanczos)
