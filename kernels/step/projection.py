"""Pressure projection: the divergence-free part of v, which is v - grad q with Lap q = div v.

On the staggered grid the divergence D is at centres, the gradient G = -D^T on faces, and the Laplacian of the
solve (`solve/five_point`) is exactly D G: the residual of D G q = D v is the divergence after projection.
With face coefficients beta the velocity becomes v - beta grad q and the operator D beta G. The pressure of
the step before may be subtracted first (`subtract_slope`). The projection then changes v little, and so adds
little of the strain that viscosity has removed (incremental pressure correction; Guermond, Minev & Shen,
Comput. Methods Appl. Mech. Eng. 195, 2006, section 3.2). Faces on a wall stay zero. Bonilla & Velho, section
II, step 4; Bridson, 2nd ed., chapter 5.
"""

from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Uniform
from wfluid.kernels.step.differences import divergence_c, gradient_x, gradient_y, slope_f


@cells
def minus_divergence(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    inverse_hx: Uniform,
    inverse_hy: Uniform,
    pitch: int,
    # outputs
    b: Field,
):
    """b = -div v [1/s] at centre k: the right-hand side of the positive system -D G q = -D v."""
    k = inside(k)
    b[k] = -divergence_c(u, v, k, pitch, inverse_hx, inverse_hy)


@cells
def subtract_slope(
    i: int,
    j: int,
    k: int,
    f: Field,
    q: Field,
    kept_h: Uniform,
    before: int,
    # outputs
    out: Field,
):
    """out = f - kept dq/ds on face k, between centres k - `before` and k: one component of v - kept G q.

    kept_h = kept / h; `before` = 1 on x-faces, `pitch` on y-faces.
    """
    k = inside(k)
    out[k] = f[k] - slope_f(q, k, before, kept_h)


@cells
def subtract_gradient(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    q: Field,
    inverse_hx: Uniform,
    inverse_hy: Uniform,
    pitch: int,
    # outputs
    out_u: Field,
    out_v: Field,
):
    """out_u, out_v = v - G q [longer side/s] on the x-face and the y-face of cell k; q is at centres."""
    k = inside(k)
    out_u[k] = u[k] - gradient_x(q, k, inverse_hx)
    out_v[k] = v[k] - gradient_y(q, k, pitch, inverse_hy)


@cells
def subtract_gradient_beta(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    q: Field,
    beta_x: Field,
    beta_y: Field,
    inverse_hx: Uniform,
    inverse_hy: Uniform,
    pitch: int,
    # outputs
    out_u: Field,
    out_v: Field,
):
    """out_u, out_v = v - beta G q [longer side/s] on the x-face and the y-face of cell k; q is at centres."""
    k = inside(k)
    out_u[k] = u[k] - gradient_x(q, k, beta_x[k] * inverse_hx)
    out_v[k] = v[k] - gradient_y(q, k, pitch, beta_y[k] * inverse_hy)
