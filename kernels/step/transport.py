"""Transport of the picture's coordinates: ds/dt = -(v . grad) s, s(x) the position in the source picture
that is shown at x (Bonilla & Velho, section II: the parametrisation is advected, not the pixels).

The displacement d = s - x is advected: it is smooth, zero at rest, and continuous across a periodic seam.
Over one step

    s_new(x) = s(foot)   so   d_new(x) = d(foot) + (foot - x)

The displacement is kept in cells, d_x in units of hx and d_y in units of hy.

A density rho is advected, d rho/dt = -(v . grad) rho, and limited to the range of the four values around the
foot: a cubic alone would overshoot at edges and become negative. Points of the picture move forward,
dx/dt = v(x), by the midpoint rule.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import gather, inside
from wfluid.kernels.cell.program import Program, cells, lines
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.interpolation import bilinear, cubic, locate


def _carry_map(interpolate: wp.Function) -> Program:
    @cells
    def carry_map(
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
        """out = d(foot) + (foot - x): the displacement [cells] at centre k after the step."""
        k = inside(k)
        column, tx = locate(i, foot_x[k], nx, periodic_x)
        row, ty = locate(j, foot_y[k], ny, periodic_y)
        corner = index(column, row, pitch)
        out_x[k] = interpolate(d_x, corner, pitch, tx, ty) + foot_x[k]
        out_y[k] = interpolate(d_y, corner, pitch, tx, ty) + foot_y[k]

    return carry_map


carry_map_cubic = _carry_map(cubic)
carry_map_bilinear = _carry_map(bilinear)


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
    """out = f(x + d) at centre k: a field over the source picture, by bilinear interpolation; d in cells."""
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
    """out = rho(foot) at centre k: cubic, limited to the range of the four values around the foot."""
    k = inside(k)
    column, tx = locate(i, foot_x[k], nx, periodic_x)
    row, ty = locate(j, foot_y[k], ny, periodic_y)
    corner = index(column, row, pitch)
    a = gather(rho, corner)
    b = gather(rho, corner + 1)
    c = gather(rho, corner + pitch)
    d = gather(rho, corner + pitch + 1)
    least = wp.min(wp.min(a, b), wp.min(c, d))
    most = wp.max(wp.max(a, b), wp.max(c, d))
    out[k] = wp.min(wp.max(cubic(rho, corner, pitch, tx, ty), least), most)


@wp.func
def velocity_at(
    u: Field, v: Field, x: Real, y: Real, nx: int, ny: int, periodic_x: int, periodic_y: int, pitch: int
):
    """Velocity [longer side/s] at (x, y) [cells from the picture's corner], by cubic interpolation.

    u is at integer x and half-integer y, v at half-integer x and integer y.
    """
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
    """x [cells], limited to 0 … n between walls; x unchanged on a periodic axis."""
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
    """Position of point t [cells from the picture's corner] after the step: x + dt v(x + dt/2 v(x)); dt_h =
    dt / h.
    """
    half = Real(0.5)
    u0, v0 = velocity_at(u, v, x[t], y[t], nx, ny, periodic_x, periodic_y, pitch)
    x1 = x[t] + half * dt_hx * u0
    y1 = y[t] + half * dt_hy * v0
    u1, v1 = velocity_at(u, v, x1, y1, nx, ny, periodic_x, periodic_y, pitch)
    out_x[t] = within(x[t] + dt_hx * u1, nx, periodic_x)
    out_y[t] = within(y[t] + dt_hy * v1, ny, periodic_y)
