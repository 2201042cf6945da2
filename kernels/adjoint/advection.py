"""The adjoint of advection (`step/advection`).

From the gradient with respect to an advected value it finds the gradients with respect to the field and to
the foot. x_bar stands for the gradient of an objective with respect to x.

An advected value is a weighted sum over the points p around the foot, t past one of them,

    out = sum_p w_p(t) f_p   so   f_bar_p += w_p out_bar,   foot_bar = sum_p w'_p(t) f_p out_bar

The second is a look-up like that of the forward pass. The first adds to points that neighbouring cells add
to as well: one thread of a CPU runs it (`scatter`). The forward pass keeps every foot between the walls; a
foot that it stopped at a wall does not move, and its gradient is 0. Gradients with respect to ghosts are
added to the cells that the ghosts copy (`ghosts.fold_rows`).
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import gather, inside
from wfluid.kernels.cell.program import Program, adjoint_cells
from wfluid.kernels.cell.real import Field, Indices, Real, Uniform
from wfluid.kernels.step.advection import velocity_c
from wfluid.kernels.step.differences import mean_f
from wfluid.kernels.step.interpolation import bilinear, cubic_slopes, cubic_weights, kept_inside, locate


@wp.func
def moves_inside(offset: Real, i: int, n: int, periodic: int):
    """Derivative of the offset that `kept_inside` takes: 1, or 0 where a wall limits it."""
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
    corner: Indices,
    tx: Field,
    ty: Field,
):
    """Where the foot of face k lies: tx, ty [cells] past the entry `corner` before it along both axes.

    With `before` = 0 that is the foot of centre k.
    """
    k = inside(k)
    column, fraction_x = locate(i, mean_f(foot_x, k, before), nx, periodic_x)
    row, fraction_y = locate(j, mean_f(foot_y, k, before), ny, periodic_y)
    corner[k] = index(column, row, pitch)
    tx[k] = fraction_x
    ty[k] = fraction_y


@wp.func
def cubic_slopes_of(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Derivatives of `interpolation.cubic` with respect to tx and ty."""
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    dx = cubic_slopes(tx)
    dy = cubic_slopes(ty)
    slope_x = Real(0.0)
    slope_y = Real(0.0)
    for n in range(4):
        row = k + (n - 1) * pitch
        a = gather(f, row - 1)
        b = gather(f, row)
        c = gather(f, row + 1)
        d = gather(f, row + 2)
        slope_x += wy[n] * (dx[0] * a + dx[1] * b + dx[2] * c + dx[3] * d)
        slope_y += dy[n] * (wx[0] * a + wx[1] * b + wx[2] * c + wx[3] * d)
    return slope_x, slope_y


@wp.func
def bilinear_slopes_of(f: Field, k: int, pitch: int, tx: Real, ty: Real):
    """Derivatives of `interpolation.bilinear` with respect to tx and ty."""
    a = gather(f, k)
    b = gather(f, k + 1)
    c = gather(f, k + pitch)
    d = gather(f, k + pitch + 1)
    return b - a + ty * (d - c - b + a), c - a + tx * (d - c - b + a)


def _foot_adjoint(slopes: wp.Function) -> Program:
    @adjoint_cells
    def foot_adjoint(
        i: int,
        j: int,
        k: int,
        f: Field,
        corner: Indices,
        tx: Field,
        ty: Field,
        out_bar: Field,
        pitch: int,
        # outputs
        x_bar: Field,
        y_bar: Field,
    ):
        """x_bar = df/dx out_bar, y_bar = df/dy out_bar: the gradient with respect to the foot of point k.

        out_bar is the gradient with respect to the value of f there; the slopes are those of f at its foot,
        tx and ty [cells] past entry `corner`[k].
        """
        k = inside(k)
        slope_x, slope_y = slopes(f, corner[k], pitch, tx[k], ty[k])
        x_bar[k] = slope_x * out_bar[k]
        y_bar[k] = slope_y * out_bar[k]

    return foot_adjoint


foot_adjoint_cubic = _foot_adjoint(cubic_slopes_of)
foot_adjoint_bilinear = _foot_adjoint(bilinear_slopes_of)


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
    """foot_bar += (of_u[k] + of_u[k + 1] + of_v[k] + of_v[k + pitch]) / 2 at centre k, in place.

    All are for one axis: of_u and of_v are the gradients [1/cells] with respect to the feet of faces, each of
    which is the mean of the feet of two centres.
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
    """foot_bar += of_d_x + of_d_y + d_bar at centre k, in place, for one axis [1/cells].

    of_d_x and of_d_y come from the displacement at the foot; d_bar is the gradient with respect to the
    displacement along the axis, to which the foot is added.
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
    """The transpose of `trace_euler` from foot_bar [1/cells] to the gradient with respect to v at centre k.

    `add_face_means` takes it on to the faces.
    """
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
    u_corner: Indices,
    u_tx: Field,
    u_ty: Field,
    v_corner: Indices,
    v_tx: Field,
    v_ty: Field,
):
    """Where `trace_midpoint` reads u and v halfway through the step, as `place_feet` gives it.

    A program of its own: were indices stored in `trace_midpoint_adjoint`, its look-ups would not vectorise.
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
    u_corner[k] = index(face_column, row, pitch)
    u_tx[k] = face_tx
    u_ty[k] = ty
    v_corner[k] = index(column, face_row, pitch)
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
    u_corner: Indices,
    u_tx: Field,
    u_ty: Field,
    v_corner: Indices,
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
    """The transpose of `trace_midpoint`, from foot_bar [1/cells] to the velocities that it read.

    u_middle_bar and v_middle_bar belong to the velocity halfway through the step (`place_middles`), which
    `scatter` takes on to the faces; u_centre_bar and v_centre_bar to that at centre k (`add_face_means`).
    """
    k = inside(k)
    half = Real(0.5)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
    u_middle = bilinear(u, u_corner[k], pitch, u_tx[k], u_ty[k])
    v_middle = bilinear(v, v_corner[k], pitch, v_tx[k], v_ty[k])
    u_bar = -dt_hx * foot_x_bar[k] * moves_inside(-dt_hx * u_middle, i, nx, periodic_x)
    v_bar = -dt_hy * foot_y_bar[k] * moves_inside(-dt_hy * v_middle, j, ny, periodic_y)
    u_slope_x, u_slope_y = bilinear_slopes_of(u, u_corner[k], pitch, u_tx[k], u_ty[k])
    v_slope_x, v_slope_y = bilinear_slopes_of(v, v_corner[k], pitch, v_tx[k], v_ty[k])
    x_bar = (u_slope_x * u_bar + v_slope_x * v_bar) * moves_inside(
        -half * dt_hx * u_centre, i, nx, periodic_x
    )
    y_bar = (u_slope_y * u_bar + v_slope_y * v_bar) * moves_inside(
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
    """The transpose of `velocity_c` for one component, in place.

    f_bar += (centre_bar[k - `before`] + centre_bar[k]) / 2 on face k. The ghosts of f_bar, which the last
    span of a row reaches, stay as they are.
    """
    k = inside(k)
    f_bar[k] = f_bar[k] + wp.where(i < nx, mean_f(centre_bar, k, before), Real(0.0))
