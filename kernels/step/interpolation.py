"""Interpolation between cells: the cell and the fraction of a position, Catmull-Rom and bilinear weights.

The weights of a cubic through four points in a row, t past the second:

    w_0(t) = t (-1/2 + t (1 - t/2))      w_2(t) = w_1(1 - t)
    w_1(t) = 1 + t^2 (-5/2 + 3/2 t)      w_3(t) = w_0(1 - t)

(E. Catmull, R. Rom, 1974). Two programs have these weights in C as well, for all cells of a span or for
four channels at once (`adjoint/scatter`, `view/lookup`), and the host has them in `domain/piecewise`; tests
assert that all are equal.
"""

import warp as wp
from wfluid.kernels.cell.native import gather
from wfluid.kernels.cell.real import Field, Real


@wp.func
def locate(i: int, offset: Real, n: int, periodic: int):
    """Split position i + offset on an axis of n points: index of the point before it, fraction past it.

    Points have positions 0 … n - 1, ghosts -1 and n. Beyond a ghost the position is that of the ghost; on a
    periodic axis the index wraps.
    """
    cells = wp.floor(offset)
    fraction = offset - cells
    before = i + int(cells)
    stopped = wp.min(wp.max(before, -1), n - 1)
    stopped_fraction = wp.min(wp.max(fraction + Real(before - stopped), Real(0.0)), Real(1.0))
    ahead = i + int(cells - Real(n) * wp.floor(cells / Real(n)))
    wrapped = wp.min(wp.max(wp.where(ahead < n, ahead, ahead - n), 0), n - 1)
    on_wall = periodic == 0
    return wp.where(on_wall, stopped, wrapped), wp.where(on_wall, stopped_fraction, fraction)


@wp.func
def outer_weight(t: Real):
    """Catmull-Rom weight of the point before the interval's start, t past that start."""
    return t * (Real(-0.5) + t * (Real(1.0) - Real(0.5) * t))


@wp.func
def inner_weight(t: Real):
    """Catmull-Rom weight of the interval's start, t past it."""
    return Real(1.0) + t * t * (Real(-2.5) + Real(1.5) * t)


Four = wp.types.vector(4, Real)
"""A vector of one number for each of four points in a row."""


@wp.func
def cubic_weights(t: Real):
    """Catmull-Rom weights of four points, t past the second."""
    s = Real(1.0) - t
    return Four(outer_weight(t), inner_weight(t), inner_weight(s), outer_weight(s))


@wp.func
def outer_slope(t: Real):
    """Derivative of `outer_weight`."""
    return Real(-0.5) + t * (Real(2.0) - Real(1.5) * t)


@wp.func
def inner_slope(t: Real):
    """Derivative of `inner_weight`."""
    return t * (Real(-5.0) + Real(4.5) * t)


@wp.func
def cubic_slopes(t: Real):
    """Derivatives of `cubic_weights`."""
    s = Real(1.0) - t
    return Four(outer_slope(t), inner_slope(t), -inner_slope(s), -outer_slope(s))


@wp.func
def weighted_row(f: Field, k: int, a: Real, b: Real, c: Real, d: Real):
    return a * gather(f, k - 1) + b * gather(f, k) + c * gather(f, k + 1) + d * gather(f, k + 2)


@wp.func
def cubic(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Catmull-Rom interpolation of f at tx, ty [cells] past point k."""
    sx = Real(1.0) - tx
    sy = Real(1.0) - ty
    a = outer_weight(tx)
    b = inner_weight(tx)
    c = inner_weight(sx)
    d = outer_weight(sx)
    return (
        outer_weight(ty) * weighted_row(f, k - pitch, a, b, c, d)
        + inner_weight(ty) * weighted_row(f, k, a, b, c, d)
        + inner_weight(sy) * weighted_row(f, k + pitch, a, b, c, d)
        + outer_weight(sy) * weighted_row(f, k + 2 * pitch, a, b, c, d)
    )


@wp.func
def bilinear(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Bilinear interpolation of f at tx, ty [cells] past point k."""
    north = gather(f, k) + tx * (gather(f, k + 1) - gather(f, k))
    south = gather(f, k + pitch) + tx * (gather(f, k + pitch + 1) - gather(f, k + pitch))
    return north + ty * (south - north)


@wp.func
def kept_inside(offset: Real, i: int, n: int, periodic: int):
    """The offset [cells] from centre i, limited so that it ends no further than the wall of a closed axis."""
    middle = Real(i) + Real(0.5)
    stopped = wp.min(wp.max(offset, -middle), Real(n) - middle)
    return wp.where(periodic == 1, offset, stopped)
