"""Figures of a frame at every cell; the host combines them."""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real


@cells
def measure(
    i: int,
    j: int,
    k: int,
    d_x: Field,
    d_y: Field,
    nx: int,
    ny: int,
    pitch: int,
    closed_x: int,
    closed_y: int,
    # outputs
    jacobian: Field,
    stretch: Field,
    outside: Field,
):
    """The map at centre k: the determinant of its Jacobian (central differences of the displacement [cells]);
    the largest stretch of a length, forwards or backwards: the larger of s and 1 / r, for singular values s
    and r <= s; and 1 where the source is beyond a closed edge, otherwise 0.
    """
    k = inside(k)
    half = Real(0.5)
    xx = Real(1.0) + half * (d_x[k + 1] - d_x[k - 1])
    xy = half * (d_x[k + pitch] - d_x[k - pitch])
    yx = half * (d_y[k + 1] - d_y[k - 1])
    yy = Real(1.0) + half * (d_y[k + pitch] - d_y[k - pitch])
    jacobian[k] = xx * yy - xy * yx
    turned = wp.sqrt((xx + yy) * (xx + yy) + (yx - xy) * (yx - xy))
    sheared = wp.sqrt((xx - yy) * (xx - yy) + (yx + xy) * (yx + xy))
    smaller = wp.max(half * wp.abs(turned - sheared), Real(1.0e-6))
    stretch[k] = wp.max(half * (turned + sheared), Real(1.0) / smaller)
    x = Real(i) + half + d_x[k]
    y = Real(j) + half + d_y[k]
    beyond_x = closed_x == 1 and (x < Real(0.0) or x > Real(nx))
    beyond_y = closed_y == 1 and (y < Real(0.0) or y > Real(ny))
    outside[k] = wp.where(beyond_x or beyond_y, Real(1.0), Real(0.0))
