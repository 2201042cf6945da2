"""The adjoint of advection (`advection`): from the gradient with respect to a value at its foot to those with
respect to the field it was read from and to the foot. x_bar stands for the gradient of an objective with
respect to x.

What arrives is a sum of points p around the foot, with weights of the fraction t past one of them,

    out = sum_p w_p(t) f_p   so   f_bar_p += w_p out_bar,   foot_bar = sum_p w'_p(t) f_p out_bar

The second is a look-up like the forward one. The first adds to points that neighbouring cells add to too:
one thread of a CPU runs it (`scatter`). Feet lie between the walls, where the forward step put them; one
that was put on a wall does not move, and its gradient is 0. Gradients with respect to ghosts are folded
back to the cells that they copy (`ghosts.fold_rows`).
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import gather, inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Indices, Real, Uniform
from wfluid.kernels.step.advection import velocity_c
from wfluid.kernels.step.differences import mean_f
from wfluid.kernels.step.interpolation import bilinear, cubic_slopes, cubic_weights, kept_inside, locate


@wp.func
def moves_inside(offset: Real, i: int, n: int, periodic: int):
    """1 where `kept_inside` follows the offset, 0 where a wall stops it."""
    return wp.where(kept_inside(offset, i, n, periodic) == offset, Real(1.0), Real(0.0))


@adjoint_cells
def place_feet(
    i: int,
    j: int,
    k: int,
    foot_x: Field,
    foot_y: Field,
    before: int,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    at: Indices,
    tx: Field,
    ty: Field,
):
    """The point before the foot of face k, and the fractions past it; of centre k with `before` = 0."""
    k = inside(k)
    column, fraction_x = locate(i, mean_f(foot_x, k, before), nx, periodic_x)
    row, fraction_y = locate(j, mean_f(foot_y, k, before), ny, periodic_y)
    at[k] = index(column, row, pitch)
    tx[k] = fraction_x
    ty[k] = fraction_y


@wp.func
def cubic_rises(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Derivatives of `advection.cubic` with respect to tx and ty."""
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    dx = cubic_slopes(tx)
    dy = cubic_slopes(ty)
    along_x = Real(0.0)
    along_y = Real(0.0)
    for n in range(4):
        row = k + (n - 1) * pitch
        a = gather(f, row - 1)
        b = gather(f, row)
        c = gather(f, row + 1)
        d = gather(f, row + 2)
        along_x += wy[n] * (dx[0] * a + dx[1] * b + dx[2] * c + dx[3] * d)
        along_y += dy[n] * (wx[0] * a + wx[1] * b + wx[2] * c + wx[3] * d)
    return along_x, along_y


@wp.func
def bilinear_rises(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Derivatives of `advection.bilinear` with respect to tx and ty."""
    a = gather(f, k)
    b = gather(f, k + 1)
    c = gather(f, k + pitch)
    d = gather(f, k + pitch + 1)
    return b - a + ty * (d - c - b + a), c - a + tx * (d - c - b + a)


@adjoint_cells
def foot_adjoint_cubic(
    i: int,
    j: int,
    k: int,
    f: Field,
    at: Indices,
    tx: Field,
    ty: Field,
    out_bar: Field,
    pitch: int,
    # outputs
    x_bar: Field,
    y_bar: Field,
):
    """The gradient with respect to the foot of point k, from which f was carried by cubics."""
    k = inside(k)
    along_x, along_y = cubic_rises(f, at[k], pitch, tx[k], ty[k])
    x_bar[k] = along_x * out_bar[k]
    y_bar[k] = along_y * out_bar[k]


@adjoint_cells
def foot_adjoint_bilinear(
    i: int,
    j: int,
    k: int,
    f: Field,
    at: Indices,
    tx: Field,
    ty: Field,
    out_bar: Field,
    pitch: int,
    # outputs
    x_bar: Field,
    y_bar: Field,
):
    """The gradient with respect to the foot of point k, from which f was carried bilinearly."""
    k = inside(k)
    along_x, along_y = bilinear_rises(f, at[k], pitch, tx[k], ty[k])
    x_bar[k] = along_x * out_bar[k]
    y_bar[k] = along_y * out_bar[k]


@adjoint_cells
def add_feet_of_faces(
    i: int,
    j: int,
    k: int,
    of_u: Field,
    of_v: Field,
    pitch: int,
    # outputs
    foot_bar: Field,
):
    """Add to the gradient of one axis of the foot of centre k that of the feet of the faces around it.

    Faces took the mean of the two feet beside them.
    """
    k = inside(k)
    south = inside(k + pitch)
    foot_bar[k] = foot_bar[k] + Real(0.5) * (of_u[k] + of_u[k + 1] + of_v[k] + of_v[south])


@adjoint_cells
def add_feet_of_centres(
    i: int,
    j: int,
    k: int,
    of_d_x: Field,
    of_d_y: Field,
    d_bar: Field,
    # outputs
    foot_bar: Field,
):
    """Add to the gradient of one axis of the foot of centre k that of the displacement carried from it.

    Of the displacement along that axis the foot is also a summand.
    """
    k = inside(k)
    foot_bar[k] = foot_bar[k] + of_d_x[k] + of_d_y[k] + d_bar[k]


@adjoint_cells
def trace_euler_adjoint(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    foot_x_bar: Field,
    foot_y_bar: Field,
    dt_hx: Uniform,
    dt_hy: Uniform,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    u_centre_bar: Field,
    v_centre_bar: Field,
):
    """The transpose of `trace_euler`, but for the means of faces."""
    k = inside(k)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
    u_centre_bar[k] = -dt_hx * foot_x_bar[k] * moves_inside(-dt_hx * u_centre, i, nx, periodic_x)
    v_centre_bar[k] = -dt_hy * foot_y_bar[k] * moves_inside(-dt_hy * v_centre, j, ny, periodic_y)


@adjoint_cells
def place_middles(
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
    u_at: Indices,
    u_tx: Field,
    u_ty: Field,
    v_at: Indices,
    v_tx: Field,
    v_ty: Field,
):
    """Where `trace_midpoint` read u and v at the middle of the step.

    A program of its own: stores of indices would keep the look-ups of the next from being vectorised.
    """
    k = inside(k)
    half = Real(0.5)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
    x = kept_inside(-half * dt_hx * u_centre, i, nx, periodic_x)
    y = kept_inside(-half * dt_hy * v_centre, j, ny, periodic_y)
    column, tx = locate(i, x, nx, periodic_x)
    row, ty = locate(j, y, ny, periodic_y)
    face_column, face_tx = locate(i, x + half, nx, periodic_x)
    face_row, face_ty = locate(j, y + half, ny, periodic_y)
    u_at[k] = index(face_column, row, pitch)
    u_tx[k] = face_tx
    u_ty[k] = ty
    v_at[k] = index(column, face_row, pitch)
    v_tx[k] = tx
    v_ty[k] = face_ty


@adjoint_cells
def trace_midpoint_adjoint(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    foot_x_bar: Field,
    foot_y_bar: Field,
    u_at: Indices,
    u_tx: Field,
    u_ty: Field,
    v_at: Indices,
    v_tx: Field,
    v_ty: Field,
    dt_hx: Uniform,
    dt_hy: Uniform,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    u_middle_bar: Field,
    v_middle_bar: Field,
    u_centre_bar: Field,
    v_centre_bar: Field,
):
    """The transpose of `trace_midpoint`, but for scatter and means.

    Gradients with respect to what it read at the middle of the step (`place_middles`), and at the centre.
    """
    k = inside(k)
    half = Real(0.5)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
    u_middle = bilinear(u, u_at[k], pitch, u_tx[k], u_ty[k])
    v_middle = bilinear(v, v_at[k], pitch, v_tx[k], v_ty[k])
    u_bar = -dt_hx * foot_x_bar[k] * moves_inside(-dt_hx * u_middle, i, nx, periodic_x)
    v_bar = -dt_hy * foot_y_bar[k] * moves_inside(-dt_hy * v_middle, j, ny, periodic_y)
    u_along_x, u_along_y = bilinear_rises(u, u_at[k], pitch, u_tx[k], u_ty[k])
    v_along_x, v_along_y = bilinear_rises(v, v_at[k], pitch, v_tx[k], v_ty[k])
    x_bar = (u_along_x * u_bar + v_along_x * v_bar) * moves_inside(
        -half * dt_hx * u_centre, i, nx, periodic_x
    )
    y_bar = (u_along_y * u_bar + v_along_y * v_bar) * moves_inside(
        -half * dt_hy * v_centre, j, ny, periodic_y
    )
    u_middle_bar[k] = u_bar
    v_middle_bar[k] = v_bar
    u_centre_bar[k] = -half * dt_hx * x_bar
    v_centre_bar[k] = -half * dt_hy * y_bar


@adjoint_cells
def add_face_means(
    i: int,
    j: int,
    k: int,
    centre_bar: Field,
    before: int,
    nx: int,
    # outputs
    f_bar: Field,
):
    """The transpose of `velocity_c` for one component: face k is half of the centre on either side.

    Ghosts, which the last span of a row runs into, keep what they are to be folded with.
    """
    k = inside(k)
    f_bar[k] = f_bar[k] + wp.where(i < nx, mean_f(centre_bar, k, before), Real(0.0))
