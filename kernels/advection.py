"""Semi-Lagrangian advection: dv/dt = -(v . grad) v, and the same for all that v carries.

A value arriving at x left, one step earlier, from its foot x - dt v. The foot is traced once a step,
at the cell centres, through the divergence-free velocity the step begins with, and kept as an offset
in cells::

    Euler   foot - x = -dt v(x)
    RK2     foot - x = -dt v(x - dt/2 v(x))       midpoint rule, error dt^3 a step

Velocities on faces use the mean of the two offsets beside them (second order, like the faces
themselves). Values at a foot are interpolated with Catmull-Rom cubics (third order, no limiter:
bilinear interpolation would act as a viscosity of up to h^2 / 8 dt) or bilinearly.

Stable for any dt: a foot beyond a wall is put on the wall, a periodic axis wraps. J. Stam, Stable
Fluids, 1999, section 3.2; R. Bridson, Fluid Simulation for Computer Graphics, 2nd ed., chapter 3.
"""

import warp as wp
from wfluid.kernels.cells import Field, Real, Uniform, cells, gather, inside


@wp.func
def locate(i: int, offset: Real, n: int, periodic: int):
    """Split position i + offset on an axis of n cells: index of the point before it, fraction past it.

    Points lie at 0 … n - 1, with the ghost -1 before and n after; a wall stops the position at the
    last interval, a periodic axis wraps the index.
    """
    whole = wp.floor(offset)
    fraction = offset - whole
    before = i + int(whole)
    stopped = wp.min(wp.max(before, -1), n - 1)
    stopped_fraction = wp.min(wp.max(fraction + Real(before - stopped), Real(0.0)), Real(1.0))
    turned = i + int(whole - Real(n) * wp.floor(whole / Real(n)))
    wrapped = wp.min(wp.max(wp.where(turned < n, turned, turned - n), 0), n - 1)
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


@wp.func
def weighted_row(f: Field, k: int, a: Real, b: Real, c: Real, d: Real):
    return a * gather(f, k - 1) + b * gather(f, k) + c * gather(f, k + 1) + d * gather(f, k + 2)


@wp.func
def cubic(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Catmull-Rom interpolation of f, tx and ty past point k."""
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
    """Bilinear interpolation of f, tx and ty past point k."""
    north = gather(f, k) + tx * (gather(f, k + 1) - gather(f, k))
    south = gather(f, k + pitch) + tx * (gather(f, k + pitch + 1) - gather(f, k + pitch))
    return north + ty * (south - north)


@wp.func
def velocity_centre(u: Field, v: Field, k: int, pitch: int):
    """Velocity at centre k, from the faces around it."""
    south = inside(k + pitch)
    return Real(0.5) * (u[k] + u[k + 1]), Real(0.5) * (v[k] + v[south])


@wp.func
def kept_inside(offset: Real, i: int, n: int, periodic: int):
    """Offset from centre i that ends on the wall where it would end beyond it."""
    middle = Real(i) + Real(0.5)
    stopped = wp.min(wp.max(offset, -middle), Real(n) - middle)
    return wp.where(periodic == 1, offset, stopped)


@cells
def trace_euler(
    i: int,
    j: int,
    k: int,
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
    foot_x: Field,
    foot_y: Field,
):
    """Offset [cells] from centre k to its foot, Euler: -dt v(x)."""
    k = inside(k)
    u_centre, v_centre = velocity_centre(u, v, k, pitch)
    foot_x[k] = kept_inside(-dt_hx * u_centre, i, nx, periodic_x)
    foot_y[k] = kept_inside(-dt_hy * v_centre, j, ny, periodic_y)


@cells
def trace_midpoint(
    i: int,
    j: int,
    k: int,
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
    foot_x: Field,
    foot_y: Field,
):
    """Offset [cells] from centre k to its foot, midpoint rule: -dt v(x - dt/2 v(x))."""
    k = inside(k)
    half = Real(0.5)
    u_centre, v_centre = velocity_centre(u, v, k, pitch)
    x = kept_inside(-half * dt_hx * u_centre, i, nx, periodic_x)
    y = kept_inside(-half * dt_hy * v_centre, j, ny, periodic_y)
    column, tx = locate(i, x, nx, periodic_x)
    row, ty = locate(j, y, ny, periodic_y)
    face_column, face_tx = locate(i, x + half, nx, periodic_x)
    face_row, face_ty = locate(j, y + half, ny, periodic_y)
    u_middle = bilinear(u, (row + 2) * pitch + face_column + 2, pitch, face_tx, ty)
    v_middle = bilinear(v, (face_row + 2) * pitch + column + 2, pitch, tx, face_ty)
    foot_x[k] = kept_inside(-dt_hx * u_middle, i, nx, periodic_x)
    foot_y[k] = kept_inside(-dt_hy * v_middle, j, ny, periodic_y)


@wp.func
def mean(f: Field, k: int, before: int):
    """Of f at k and at the neighbour `before` elements earlier."""
    other = inside(k - before)
    return Real(0.5) * (f[other] + f[k])


@cells
def advect_face_cubic(
    i: int,
    j: int,
    k: int,
    f: Field,
    foot_x: Field,
    foot_y: Field,
    before: int,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out: Field,
):
    """A face component at its foot, cubic; `before` = 1 on x-faces, `pitch` on y-faces."""
    k = inside(k)
    column, tx = locate(i, mean(foot_x, k, before), nx, periodic_x)
    row, ty = locate(j, mean(foot_y, k, before), ny, periodic_y)
    out[k] = cubic(f, (row + 2) * pitch + column + 2, pitch, tx, ty)


@cells
def advect_face_bilinear(
    i: int,
    j: int,
    k: int,
    f: Field,
    foot_x: Field,
    foot_y: Field,
    before: int,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    out: Field,
):
    """A face component at its foot, bilinear; `before` = 1 on x-faces, `pitch` on y-faces."""
    k = inside(k)
    column, tx = locate(i, mean(foot_x, k, before), nx, periodic_x)
    row, ty = locate(j, mean(foot_y, k, before), ny, periodic_y)
    out[k] = bilinear(f, (row + 2) * pitch + column + 2, pitch, tx, ty)
