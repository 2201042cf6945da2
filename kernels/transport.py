"""Transport of the picture's coordinates: ds/dt = -(v . grad) s, s(x) the place in the source picture
that is seen at x now (Bonilla & Velho, section II: the parametrisation is carried, not the pixels).

What is carried is the displacement d = s - x: it is smooth, zero at rest, and continuous across a
periodic seam. Over one step

    s_new(x) = s(foot)   so   d_new(x) = d(foot) + (foot - x)

The displacement is kept in cells, d_x in units of hx and d_y in units of hy.
"""

from wfluid.kernels.advection import bilinear, cubic, locate
from wfluid.kernels.cells import Field, cells, inside


@cells
def carry_map_cubic(
    i: int,
    j: int,
    k: int,
    d_x: Field,
    d_y: Field,
    foot_x: Field,
    foot_y: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out_x: Field,
    out_y: Field,
):
    """Displacement [cells] at centre k after the step, cubic."""
    k = inside(k)
    column, tx = locate(i, foot_x[k], nx, periodic_x)
    row, ty = locate(j, foot_y[k], ny, periodic_y)
    at = (row + 2) * pitch + column + 2
    out_x[k] = cubic(d_x, at, pitch, tx, ty) + foot_x[k]
    out_y[k] = cubic(d_y, at, pitch, tx, ty) + foot_y[k]


@cells
def carry_map_bilinear(
    i: int,
    j: int,
    k: int,
    d_x: Field,
    d_y: Field,
    foot_x: Field,
    foot_y: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out_x: Field,
    out_y: Field,
):
    """Displacement [cells] at centre k after the step, bilinear."""
    k = inside(k)
    column, tx = locate(i, foot_x[k], nx, periodic_x)
    row, ty = locate(j, foot_y[k], ny, periodic_y)
    at = (row + 2) * pitch + column + 2
    out_x[k] = bilinear(d_x, at, pitch, tx, ty) + foot_x[k]
    out_y[k] = bilinear(d_y, at, pitch, tx, ty) + foot_y[k]


@cells
def carried_along(
    i: int,
    j: int,
    k: int,
    f: Field,
    d_x: Field,
    d_y: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out: Field,
):
    """What of a field on the source picture is at centre k now: f(x + d), bilinear, so within its range."""
    k = inside(k)
    column, tx = locate(i, d_x[k], nx, periodic_x)
    row, ty = locate(j, d_y[k], ny, periodic_y)
    out[k] = bilinear(f, (row + 2) * pitch + column + 2, pitch, tx, ty)
