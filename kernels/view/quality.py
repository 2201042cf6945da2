"""Figures of a frame: extremes and counts of each row, one row per line; the host combines the rows."""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Real


@lines
def row_map_extremes(
    t: int,
    d_x: Field,
    d_y: Field,
    nx: int,
    ny: int,
    pitch: int,
    closed_x: int,
    closed_y: int,
    # outputs
    jacobian_min: Field,
    column_of_min: Field,
    jacobian_max: Field,
    folded: Field,
    outside: Field,
):
    """For row t of the map: least determinant of its Jacobian (central differences of the displacement
    [cells] at centres) and its column, the greatest determinant, and the numbers of cells where the
    determinant is not positive, and whose source is beyond a closed edge.
    """
    least = Real(1.0e30)
    greatest = Real(-1.0e30)
    column = Real(0.0)
    folds = Real(0.0)
    count = Real(0.0)
    half = Real(0.5)
    row = index(0, t, pitch)
    for i in range(nx):
        k = row + i
        xx = Real(1.0) + half * (d_x[k + 1] - d_x[k - 1])
        xy = half * (d_x[k + pitch] - d_x[k - pitch])
        yx = half * (d_y[k + 1] - d_y[k - 1])
        yy = Real(1.0) + half * (d_y[k + pitch] - d_y[k - pitch])
        det = xx * yy - xy * yx
        if det < least:
            least = det
            column = Real(i)
        if not det > Real(0.0):
            folds += Real(1.0)
        greatest = wp.max(greatest, det)
        x = Real(i) + half + d_x[k]
        y = Real(t) + half + d_y[k]
        beyond_x = closed_x == 1 and (x < Real(0.0) or x > Real(nx))
        beyond_y = closed_y == 1 and (y < Real(0.0) or y > Real(ny))
        if beyond_x or beyond_y:
            count += Real(1.0)
    jacobian_min[t] = least
    column_of_min[t] = column
    folded[t] = folds
    jacobian_max[t] = greatest
    outside[t] = count
