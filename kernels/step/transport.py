"""Transport of the picture's coordinates: ds/dt = -(v . grad) s, s(x) the place in the source picture
that is seen at x now (Bonilla & Velho, section II: the parametrisation is carried, not the pixels).

What is carried is the displacement d = s - x: it is smooth, zero at rest, and continuous across a
periodic seam. Over one step

    s_new(x) = s(foot)   so   d_new(x) = d(foot) + (foot - x)

The displacement is kept in cells, d_x in units of hx and d_y in units of hy.

A density rho is carried by its values, d rho/dt = -(v . grad) rho, between the least and the greatest of
the four around its foot: a cubic alone would ring at its edges and go below nothing. Points of the
picture are carried forward, dx/dt = v(x), by the midpoint rule.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import gather, inside
from wfluid.kernels.cell.program import cells, lines
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.interpolation import bilinear, cubic, locate


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
    at = index(column, row, pitch)
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
    at = index(column, row, pitch)
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
    out[k] = bilinear(f, index(column, row, pitch), pitch, tx, ty)


@cells
def carry_density(
    i: int,
    j: int,
    k: int,
    rho: Field,
    foot_x: Field,
    foot_y: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out: Field,
):
    """A density at the foot of centre k: cubic, limited to the range of the four around it."""
    k = inside(k)
    column, tx = locate(i, foot_x[k], nx, periodic_x)
    row, ty = locate(j, foot_y[k], ny, periodic_y)
    at = index(column, row, pitch)
    a = gather(rho, at)
    b = gather(rho, at + 1)
    c = gather(rho, at + pitch)
    d = gather(rho, at + pitch + 1)
    least = wp.min(wp.min(a, b), wp.min(c, d))
    most = wp.max(wp.max(a, b), wp.max(c, d))
    out[k] = wp.min(wp.max(cubic(rho, at, pitch, tx, ty), least), most)


@wp.func
def velocity_at(
    u: Field, v: Field, x: Real, y: Real, nx: int, ny: int, periodic_x: int, periodic_y: int, pitch: int
):
    """Velocity at (x, y) [cells from the corner], cubic: faces lie at whole x (or y), half y (or x)."""
    half = Real(0.5)
    face_column, face_tx = locate(0, x, nx, periodic_x)
    row, ty = locate(0, y - half, ny, periodic_y)
    column, tx = locate(0, x - half, nx, periodic_x)
    face_row, face_ty = locate(0, y, ny, periodic_y)
    along_x = cubic(u, index(face_column, row, pitch), pitch, face_tx, ty)
    along_y = cubic(v, index(column, face_row, pitch), pitch, tx, face_ty)
    return along_x, along_y


@wp.func
def within(x: Real, n: int, periodic: int):
    """The nearest place to x between the walls; where the axis wraps x itself, however far it went."""
    return wp.where(periodic == 1, x, wp.min(wp.max(x, Real(0.0)), Real(n)))


@lines
def carry_points(
    t: int,
    x: Field,
    y: Field,
    u: Field,
    v: Field,
    dt_hx: Uniform,
    dt_hy: Uniform,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out_x: Field,
    out_y: Field,
):
    """Point t [cells from the corner] after the step, midpoint rule."""
    half = Real(0.5)
    u0, v0 = velocity_at(u, v, x[t], y[t], nx, ny, periodic_x, periodic_y, pitch)
    x1 = x[t] + half * dt_hx * u0
    y1 = y[t] + half * dt_hy * v0
    u1, v1 = velocity_at(u, v, x1, y1, nx, ny, periodic_x, periodic_y, pitch)
    out_x[t] = within(x[t] + dt_hx * u1, nx, periodic_x)
    out_y[t] = within(y[t] + dt_hy * v1, ny, periodic_y)
