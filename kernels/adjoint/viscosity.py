"""The gradient with respect to viscosity (`solve/stress`, `solve/five_point`).

With A v = b solved, and A lambda = v_bar, an objective changes with mu as -<lambda, (dA/dmu) v>.
<lambda, A v> is the power that the stress of v would do on the flow lambda: mu times the product of their
strains, normal ones at centres, shear ones at nodes. Only so far as both solves go is it right.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.differences import gradient_x, gradient_y, laplacian_c


@wp.func
def shear_n(u: Field, v: Field, k: int, pitch: int, over_hx: Real, over_hy: Real):
    """Shear rate du/dy + dv/dx at the node where cell k begins."""
    return gradient_y(u, k, pitch, over_hy) + gradient_x(v, k, over_hx)


@adjoint_cells
def take_dissipation(
    i: int,
    j: int,
    k: int,
    u: Field,
    v: Field,
    lambda_u: Field,
    lambda_v: Field,
    dt: Uniform,
    inverse_hx: Uniform,
    inverse_hy: Uniform,
    pitch: int,
    # outputs
    mu_bar: Field,
):
    """Take dt times the strains of (u, v) times those of lambda off mu_bar, in place.

    A centre has a quarter of each of its four nodes; what a node on a wall gives to its two cells beyond
    it gives back to those inside, and so a quarter is right there too.
    """
    k = inside(k)
    south = inside(k + pitch)
    # each strain of v is the factor of that of lambda: one product, in one order
    stretch_x = gradient_x(lambda_u, k + 1, gradient_x(u, k + 1, inverse_hx) * inverse_hx)
    stretch_y = gradient_y(lambda_v, south, pitch, gradient_y(v, south, pitch, inverse_hy) * inverse_hy)
    shears = Real(0.0)
    for m in range(4):
        node = k + m % 2 + m // 2 * pitch
        of_v = shear_n(u, v, node, pitch, inverse_hx, inverse_hy)
        of_lambda = shear_n(lambda_u, lambda_v, node, pitch, inverse_hx, inverse_hy)
        shears += of_v * of_lambda
    power = Real(2.0) * (stretch_x + stretch_y) + Real(0.25) * shears
    mu_bar[k] = mu_bar[k] - dt * power


@adjoint_cells
def add_diffused(
    i: int,
    j: int,
    k: int,
    f: Field,
    lambda_f: Field,
    dt: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    mu_bar: Field,
):
    """Add lambda dt Lap f to mu_bar, in place, for one component and constant viscosity; a = 1 / h^2."""
    k = inside(k)
    mu_bar[k] = mu_bar[k] + lambda_f[k] * dt * laplacian_c(f, k, pitch, ax, ay)
