"""The picture seen through a map: new(x, y) = old(source of (x, y)).

First the displacement is interpolated from the fluid's cells up to the pixels, Catmull-Rom, along y
and then along x with one set of weights per row and per column; then every pixel reads its source.
Pixel coordinates count from the centre of the first pixel. A picture is an array of 4-vectors, one a
pixel, row by row without padding: four channels are read, weighted and added at once.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import cells
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
    """Displacement in pixel row j for every grid column, from four rows, the second one `row`."""
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
    """Source coordinate [px] of pixel (i, j): origin + step_x i + step_y j + slope d."""
    k = inside(k)
    i = entry(i)
    at = index(column[i], j, pitch)
    west = gather(weight_1, i) * gather(d, at) + gather(weight_2, i) * gather(d, at + 1)
    east = gather(weight_3, i) * gather(d, at + 2) + gather(weight_4, i) * gather(d, at + 3)
    out[k] = origin + step_x * Real(i) + step_y * Real(j) + slope * (west + east)


@wp.func
def modulo(i: int, n: int):
    """i mod n in 0 … n - 1, for negative i too."""
    m = i % n
    return wp.where(m < 0, m + n, m)


@wp.func
def at_edge(i: int, n: int, edge: int):
    """The pixel that stands for pixel i of n beyond the picture's edge, or -1 for none."""
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
"""Source coordinates are stopped here [px], so that they fit an integer."""


@wp.func
def whole_and_fraction(coordinate: Real):
    """A source coordinate [px] as the pixel before it and the part of a pixel past that."""
    stopped = wp.min(wp.max(coordinate, -FAR), FAR)
    before = wp.floor(stopped)
    return int(before), stopped - before


@cells
def look_up_nearest(
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
    """The pixel whose square holds the source."""
    k = inside(k)
    x, _tx = whole_and_fraction(source_x[k] + Real(0.5))
    y, _ty = whole_and_fraction(source_y[k] + Real(0.5))
    out[k] = pixel(picture, x, y, width, height, edge_x, edge_y)


@cells
def look_up_bilinear(
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
    """Bilinear between the four pixels around the source."""
    k = inside(k)
    x, tx = whole_and_fraction(source_x[k])
    y, ty = whole_and_fraction(source_y[k])
    sx = Real(1.0) - tx
    if x >= 0 and y >= 0 and x + 1 < width and y + 1 < height:
        at = entry(y * width + x)
        below = entry(y * width + width + x)
        north = sx * picture[at] + tx * picture[at + 1]
        south = sx * picture[below] + tx * picture[below + 1]
        out[k] = (Real(1.0) - ty) * north + ty * south
    else:
        north = sx * pixel(picture, x, y, width, height, edge_x, edge_y)
        north += tx * pixel(picture, x + 1, y, width, height, edge_x, edge_y)
        south = sx * pixel(picture, x, y + 1, width, height, edge_x, edge_y)
        south += tx * pixel(picture, x + 1, y + 1, width, height, edge_x, edge_y)
        out[k] = (Real(1.0) - ty) * north + ty * south


_REAL = f"wp::{Real.__name__}"
_CUBIC_INSIDE = f"""
    __builtin_assume(at >= 0);
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
    const four* p = (const four*)(picture.data + at);
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
def cubic_inside(picture: Pixels, at: int, width: int, tx: Real, ty: Real) -> Pixel:
    """Catmull-Rom over 4 x 4 pixels that all lie inside the picture, `at` the first of them.

    In native code, for the four channels side by side in one register: half the time.
    """
    ...


@wp.func
def cubic_at_edges(
    picture: Pixels, x: int, y: int, tx: Real, ty: Real, width: int, height: int, edge_x: int, edge_y: int
):
    """The same over pixels some of which lie beyond the picture's edges; (x, y) is the first."""
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


@cells
def look_up_cubic(
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
    """Catmull-Rom over the sixteen pixels around the source."""
    k = inside(k)
    x, tx = whole_and_fraction(source_x[k])
    y, ty = whole_and_fraction(source_y[k])
    if x >= 1 and y >= 1 and x + 2 < width and y + 2 < height:
        out[k] = cubic_inside(picture, (y - 1) * width + x - 1, width, tx, ty)
    else:
        out[k] = cubic_at_edges(picture, x - 1, y - 1, tx, ty, width, height, edge_x, edge_y)


PI = wp.constant(Real(3.14159265358979323846))


@wp.func
def lanczos_weight(x: Real):
    """sinc(x) sinc(x / 3) for |x| < 3 (Lanczos, three lobes)."""
    weight = Real(1.0)
    if wp.abs(x) > Real(1.0e-4):
        angle = PI * x
        weight = Real(3.0) * wp.sin(angle) * wp.sin(angle / Real(3.0)) / (angle * angle)
    return weight


@cells
def look_up_lanczos(
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
    """Lanczos-3 over the thirty-six pixels around the source, weights normalised to one."""
    k = inside(k)
    x, tx = whole_and_fraction(source_x[k])
    y, ty = whole_and_fraction(source_y[k])
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
    out[k] = value / total
