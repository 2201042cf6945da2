"""The picture seen through a map: new(x, y) = old(source of (x, y)).

First the displacement is interpolated from the fluid's cells up to the pixels, Catmull-Rom, along y
and then along x with one set of weights per row and per column; then every pixel reads its source.
Pixel coordinates count from the centre of the first pixel. A picture is an array of 4-vectors, one a
pixel, row by row without padding: four channels are read, weighted and added at once.
"""

import warp as wp
from wfluid.kernels.advection import inner_weight, outer_weight
from wfluid.kernels.cells import Field, Indices, Real, RowIndex, RowReal, cells, entry, gather, inside

Pixel = wp.types.vector(4, Real)
Pixels = wp.array[Pixel]

CLAMP = wp.constant(0)
MIRROR = wp.constant(1)
WRAP = wp.constant(2)
TRANSPARENT = wp.constant(3)


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
    at = (j + 2) * pitch + 2 + column[i]
    west = gather(weight_1, i) * gather(d, at) + gather(weight_2, i) * gather(d, at + 1)
    east = gather(weight_3, i) * gather(d, at + 2) + gather(weight_4, i) * gather(d, at + 3)
    out[k] = origin + step_x * Real(i) + step_y * Real(j) + slope * (west + east)


@wp.func
def modulo(i: int, n: int):
    """I mod n in 0 … n - 1, for negative i too."""
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
    x = int(wp.floor(wp.clamp(source_x[k], -FAR, FAR) + Real(0.5)))
    y = int(wp.floor(wp.clamp(source_y[k], -FAR, FAR) + Real(0.5)))
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
    x = wp.clamp(source_x[k], -FAR, FAR)
    y = wp.clamp(source_y[k], -FAR, FAR)
    column = int(wp.floor(x))
    row = int(wp.floor(y))
    tx = x - wp.floor(x)
    ty = y - wp.floor(y)
    sx = Real(1.0) - tx
    north = sx * pixel(picture, column, row, width, height, edge_x, edge_y)
    north += tx * pixel(picture, column + 1, row, width, height, edge_x, edge_y)
    south = sx * pixel(picture, column, row + 1, width, height, edge_x, edge_y)
    south += tx * pixel(picture, column + 1, row + 1, width, height, edge_x, edge_y)
    out[k] = (Real(1.0) - ty) * north + ty * south


@wp.func
def row_of_four(picture: Pixels, at: int, a: Real, b: Real, c: Real, d: Real):
    """Four neighbouring pixels of one row inside the picture, weighted."""
    return a * picture[at] + b * picture[at + 1] + c * picture[at + 2] + d * picture[at + 3]


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
    x = wp.clamp(source_x[k], -FAR, FAR)
    y = wp.clamp(source_y[k], -FAR, FAR)
    column = int(wp.floor(x)) - 1
    row = int(wp.floor(y)) - 1
    tx = x - wp.floor(x)
    ty = y - wp.floor(y)
    a = outer_weight(tx)
    b = inner_weight(tx)
    c = inner_weight(Real(1.0) - tx)
    d = outer_weight(Real(1.0) - tx)
    wy = Pixel(outer_weight(ty), inner_weight(ty), inner_weight(Real(1.0) - ty), outer_weight(Real(1.0) - ty))
    value = Pixel()
    if column >= 0 and row >= 0 and column + 3 < width and row + 3 < height:
        at = inside(row * width + column + 4) - 4
        value += wy[0] * row_of_four(picture, at, a, b, c, d)
        value += wy[1] * row_of_four(picture, at + width, a, b, c, d)
        value += wy[2] * row_of_four(picture, at + 2 * width, a, b, c, d)
        value += wy[3] * row_of_four(picture, at + 3 * width, a, b, c, d)
    else:
        for m in range(4):
            line = a * pixel(picture, column, row + m, width, height, edge_x, edge_y)
            line += b * pixel(picture, column + 1, row + m, width, height, edge_x, edge_y)
            line += c * pixel(picture, column + 2, row + m, width, height, edge_x, edge_y)
            line += d * pixel(picture, column + 3, row + m, width, height, edge_x, edge_y)
            value += wy[m] * line
    out[k] = value
