"""Semi-Lagrangian advection: dv/dt = -(v . grad) v.

The value at x was one step earlier at its foot, x - dt v. Feet are traced from the cell centres, once per
step, through the divergence-free velocity at its start (`wfluid/step/step.py` has those of the paper's
scheme), and kept as offsets in cells::

    Euler   foot - x = -dt v(x)
    RK2     foot - x = -dt v(x - dt/2 v(x))       midpoint rule, error dt^3 a step

Velocities on faces use the mean of the offsets at the two centres beside them (second order). Values at a
foot are interpolated with Catmull-Rom cubics (third order, no limiter: bilinear interpolation would act as a
viscosity of up to h^2 / 8 dt) or bilinearly. The projection after advection takes energy too: splitting the
two acts like a viscosity of about U^2 dt / 8 where the flow turns, U its largest speed, 0.125 as measured on
Taylor-Green vortices at small U dt.

Stable for any dt: a foot beyond a wall is moved to the wall, a periodic axis wraps. J. Stam, Stable
Fluids, 1999, section 3.2; R. Bridson, Fluid Simulation for Computer Graphics, 2nd ed., chapter 3.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import Program, cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.differences import mean_f
from wfluid.kernels.step.interpolation import bilinear, cubic, kept_inside, locate


@wp.func
def velocity_c(u: Field, v: Field, k: int, pitch: int):
    """Velocity at centre k: along each axis the mean of its two faces."""
    south = inside(k + pitch)
    return Real(0.5) * (u[k] + u[k + 1]), Real(0.5) * (v[k] + v[south])


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
    """foot - x = -dt v(x) [cells] at centre k, by Euler's rule; u, v [longer side/s], dt_h = dt / h."""
    k = inside(k)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
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
    """foot - x = -dt v(x - dt/2 v(x)) [cells] at centre k, by the midpoint rule; dt_h = dt / h."""
    k = inside(k)
    half = Real(0.5)
    u_centre, v_centre = velocity_c(u, v, k, pitch)
    x = kept_inside(-half * dt_hx * u_centre, i, nx, periodic_x)
    y = kept_inside(-half * dt_hy * v_centre, j, ny, periodic_y)
    column, tx = locate(i, x, nx, periodic_x)
    row, ty = locate(j, y, ny, periodic_y)
    face_column, face_tx = locate(i, x + half, nx, periodic_x)
    face_row, face_ty = locate(j, y + half, ny, periodic_y)
    u_middle = bilinear(u, index(face_column, row, pitch), pitch, face_tx, ty)
    v_middle = bilinear(v, index(column, face_row, pitch), pitch, tx, face_ty)
    foot_x[k] = kept_inside(-dt_hx * u_middle, i, nx, periodic_x)
    foot_y[k] = kept_inside(-dt_hy * v_middle, j, ny, periodic_y)


def _advect_face(interpolate: wp.Function) -> Program:
    @cells
    def advect_face(
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
        """out = the velocity component f at the foot of face k [longer side/s].

        The foot of a face is the mean of foot_x and foot_y [cells] at the centres k - `before` and k, with
        `before` = 1 on x-faces and `pitch` on y-faces.
        """
        k = inside(k)
        column, tx = locate(i, mean_f(foot_x, k, before), nx, periodic_x)
        row, ty = locate(j, mean_f(foot_y, k, before), ny, periodic_y)
        out[k] = interpolate(f, index(column, row, pitch), pitch, tx, ty)

    return advect_face


advect_face_cubic = _advect_face(cubic)
advect_face_bilinear = _advect_face(bilinear)
