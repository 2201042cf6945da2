"""The gradient with respect to viscosity (`solve/stress`, `solve/five_point`).

With A v = b and A lambda = v_bar, the derivative of an objective with respect to mu is
-<lambda, (dA/dmu) v>. <lambda, A v> is the power of the stress of v in the flow lambda: mu times the product
of their strains, normal strains at centres and shear strains at nodes. The error of the gradient is that of
both solves.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.differences import gradient_x, gradient_y, laplacian_c


@wp.func
def shear_n(u: Field, v: Field, k: int, pitch: int, over_hx: Real, over_hy: Real):
    """du/dy + dv/dx [1/s] at the top left node of cell k: the shear rate."""
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
    """mu_bar -= dt strain(v) : strain(lambda) at centre k, in place.

    Each of the four nodes of a cell adds a quarter of its product. At a wall the ghosts of mu copy the cells
    inside, which so get the quarters of the cells beyond: a quarter is right there too.
    """
    k = inside(k)
    south = inside(k + pitch)
    # each strain of v is passed as the factor of the strain of lambda, which fixes the order of the product
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
    """mu_bar += dt lambda_f Lap f at k, in place: one component, constant viscosity; a = 1 / h^2."""
    k = inside(k)
    mu_bar[k] = mu_bar[k] + lambda_f[k] * dt * laplacian_c(f, k, pitch, ax, ay)
