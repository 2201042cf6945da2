"""Pressure projection: the part of v that is divergence-free, v - grad q with Lap q = div v.

On the staggered grid the divergence D lives at centres, the gradient G = -D^T on faces, and the
Laplacian solved (`relaxation`) is exactly D G: what the solver leaves of D G q = D v is what is left
of the divergence. With face coefficients beta the velocity becomes v - beta grad q and the operator
D beta G. A pressure known from the step before may be taken off first (`subtract_slope`): what is left to
project is then small, and so is the strain that projecting puts back where viscosity had taken it out
(incremental pressure correction; Guermond, Minev & Shen, Comput. Methods Appl. Mech. Eng. 195, 2006,
section 3.2). Faces on a wall keep zero through their ghosts. Bonilla & Velho, section II, step 4;
Bridson, 2nd ed., chapter 5.
"""

from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Uniform


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
    """B = -div v [1/s] at centre k: the right-hand side of the positive system -D G q = -D v."""
    k = inside(k)
    south = inside(k + pitch)
    b[k] = inverse_hx * (u[k] - u[k + 1]) + inverse_hy * (v[k] - v[south])


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
    """f - kept dq/ds on the face between centres k - `before` and k, one component of v - kept grad q."""
    k = inside(k)
    out[k] = f[k] - kept_h * (q[k] - q[inside(k - before)])


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
    """V - grad q on the x-face and the y-face of cell k."""
    k = inside(k)
    north = inside(k - pitch)
    out_u[k] = u[k] - inverse_hx * (q[k] - q[k - 1])
    out_v[k] = v[k] - inverse_hy * (q[k] - q[north])


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
    """V - beta grad q on the x-face and the y-face of cell k."""
    k = inside(k)
    north = inside(k - pitch)
    out_u[k] = u[k] - beta_x[k] * inverse_hx * (q[k] - q[k - 1])
    out_v[k] = v[k] - beta_y[k] * inverse_hy * (q[k] - q[north])
