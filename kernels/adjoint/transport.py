"""The adjoint of transport (`step/transport`) of densities and points; `adjoint/advection` has that of the
map.
"""

import warp as wp
from wfluid.kernels.adjoint.advection import bilinear_slopes_of, cubic_slopes_of
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells, adjoint_lines
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.interpolation import cubic, cubic_weights, locate
from wfluid.kernels.step.transport import velocity_at, within


@wp.func
def moves(i: int, offset: Real, n: int, periodic: int):
    """Derivative of the offset that `locate` takes: 1, or 0 beyond a ghost of a closed axis."""
    before = i + int(wp.floor(offset))
    free = periodic == 1 or (before >= -1 and before < n)
    return wp.where(free, Real(1.0), Real(0.0))


@wp.func
def cubic_adjoint(f: Field, k: int, pitch: int, tx: Real, ty: Real, bar: Real, f_bar: Field):
    """The transpose of `interpolation.cubic`: adds to f_bar, returns the gradients of tx and ty."""
    wx = cubic_weights(tx)
    wy = cubic_weights(ty)
    for n in range(4):
        row = k + (n - 1) * pitch
        for m in range(4):
            f_bar[row + m - 1] += wx[m] * wy[n] * bar
    along_x, along_y = cubic_slopes_of(f, k, pitch, tx, ty)
    return along_x * bar, along_y * bar


@wp.func
def bilinear_adjoint(f: Field, k: int, pitch: int, tx: Real, ty: Real, bar: Real, f_bar: Field):
    """The transpose of `interpolation.bilinear`: adds to f_bar, returns the gradients of tx and ty."""
    sx = Real(1.0) - tx
    sy = Real(1.0) - ty
    south = k + pitch
    f_bar[k] += sx * sy * bar
    f_bar[k + 1] += tx * sy * bar
    f_bar[south] += sx * ty * bar
    f_bar[south + 1] += tx * ty * bar
    along_x, along_y = bilinear_slopes_of(f, k, pitch, tx, ty)
    return along_x * bar, along_y * bar


@adjoint_cells
def carry_density_adjoint(
    i: int,
    j: int,
    k: int,
    rho: Field,
    foot_x: Field,
    foot_y: Field,
    out_bar: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    rho_bar: Field,
    x_bar: Field,
    y_bar: Field,
):
    """The transpose of `carry_density`: adds to rho_bar; x_bar, y_bar = the gradient with respect to the
    foot.

    Where the value was limited, all of out_bar belongs to the least or the greatest of the four points.
    """
    k = inside(k)
    if i < nx:
        x = foot_x[k]
        y = foot_y[k]
        column, tx = locate(i, x, nx, periodic_x)
        row, ty = locate(j, y, ny, periodic_y)
        first = index(column, row, pitch)
        least = first
        most = first
        for n in range(1, 4):
            corner = first + n % 2 + n // 2 * pitch
            if rho[corner] < rho[least]:
                least = corner
            if rho[corner] > rho[most]:
                most = corner
        value = cubic(rho, first, pitch, tx, ty)
        along_x = Real(0.0)
        along_y = Real(0.0)
        if value < rho[least]:
            rho_bar[least] += out_bar[k]
        elif value > rho[most]:
            rho_bar[most] += out_bar[k]
        else:
            along_x, along_y = cubic_adjoint(rho, first, pitch, tx, ty, out_bar[k], rho_bar)
        x_bar[k] = along_x * moves(i, x, nx, periodic_x)
        y_bar[k] = along_y * moves(j, y, ny, periodic_y)


@adjoint_cells
def carried_along_adjoint(
    i: int,
    j: int,
    k: int,
    f: Field,
    d_x: Field,
    d_y: Field,
    out_bar: Field,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    f_bar: Field,
    d_x_bar: Field,
    d_y_bar: Field,
):
    """The transpose of `carried_along`: adds to f_bar, d_x_bar and d_y_bar, in place."""
    k = inside(k)
    if i < nx:
        x = d_x[k]
        y = d_y[k]
        column, tx = locate(i, x, nx, periodic_x)
        row, ty = locate(j, y, ny, periodic_y)
        first = index(column, row, pitch)
        along_x, along_y = bilinear_adjoint(f, first, pitch, tx, ty, out_bar[k], f_bar)
        d_x_bar[k] += along_x * moves(i, x, nx, periodic_x)
        d_y_bar[k] += along_y * moves(j, y, ny, periodic_y)


@wp.func
def velocity_at_adjoint(
    u: Field,
    v: Field,
    x: Real,
    y: Real,
    along_x: Real,
    along_y: Real,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    u_bar: Field,
    v_bar: Field,
):
    """The transpose of `velocity_at`: adds to u_bar and v_bar, returns the gradients of x and y."""
    half = Real(0.5)
    face_column, face_tx = locate(0, x, nx, periodic_x)
    row, ty = locate(0, y - half, ny, periodic_y)
    column, tx = locate(0, x - half, nx, periodic_x)
    face_row, face_ty = locate(0, y, ny, periodic_y)
    on_u = index(face_column, row, pitch)
    on_v = index(column, face_row, pitch)
    u_x, u_y = cubic_adjoint(u, on_u, pitch, face_tx, ty, along_x, u_bar)
    v_x, v_y = cubic_adjoint(v, on_v, pitch, tx, face_ty, along_y, v_bar)
    x_bar = u_x * moves(0, x, nx, periodic_x) + v_x * moves(0, x - half, nx, periodic_x)
    y_bar = u_y * moves(0, y - half, ny, periodic_y) + v_y * moves(0, y, ny, periodic_y)
    return x_bar, y_bar


@adjoint_lines
def carry_points_adjoint(
    t: int,
    x: Field,
    y: Field,
    u: Field,
    v: Field,
    out_x_bar: Field,
    out_y_bar: Field,
    dt_hx: Uniform,
    dt_hy: Uniform,
    nx: int,
    ny: int,
    periodic_x: int,
    periodic_y: int,
    pitch: int,
    # outputs
    u_bar: Field,
    v_bar: Field,
    x_bar: Field,
    y_bar: Field,
):
    """The transpose of `carry_points`, which it recomputes: adds to u_bar and v_bar; sets x_bar and y_bar."""
    half = Real(0.5)
    u0, v0 = velocity_at(u, v, x[t], y[t], nx, ny, periodic_x, periodic_y, pitch)
    x1 = x[t] + half * dt_hx * u0
    y1 = y[t] + half * dt_hy * v0
    u1, v1 = velocity_at(u, v, x1, y1, nx, ny, periodic_x, periodic_y, pitch)
    x2 = x[t] + dt_hx * u1
    y2 = y[t] + dt_hy * v1
    x2_bar = wp.where(within(x2, nx, periodic_x) == x2, out_x_bar[t], Real(0.0))
    y2_bar = wp.where(within(y2, ny, periodic_y) == y2, out_y_bar[t], Real(0.0))
    x1_bar, y1_bar = velocity_at_adjoint(
        u, v, x1, y1, dt_hx * x2_bar, dt_hy * y2_bar, nx, ny, periodic_x, periodic_y, pitch, u_bar, v_bar
    )
    on_u = half * dt_hx * x1_bar
    on_v = half * dt_hy * y1_bar
    x0_bar, y0_bar = velocity_at_adjoint(
        u, v, x[t], y[t], on_u, on_v, nx, ny, periodic_x, periodic_y, pitch, u_bar, v_bar
    )
    x_bar[t] = x2_bar + x1_bar + x0_bar
    y_bar[t] = y2_bar + y1_bar + y0_bar
