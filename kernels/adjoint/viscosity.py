"""The gradient with respect to viscosity (`viscosity`, `relaxation`).

With A v = b solved, and A lambda = v_bar, an objective changes with mu as -<lambda, (dA/dmu) v>.
<lambda, A v> is the power that the stress of v would do on the flow lambda: mu times the product of their
strains, normal ones at centres, shear ones at nodes. Only so far as both solves go is it right.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Real, Uniform


@wp.func
def shear_at(u: Field, v: Field, k: int, pitch: int, over_hx: Real, over_hy: Real):
    """Shear rate du/dy + dv/dx at the node where cell k begins."""
    return over_hy * (u[k] - u[inside(k - pitch)]) + over_hx * (v[k] - v[inside(k - 1)])


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
    stretch_x = inverse_hx * (u[k + 1] - u[k]) * inverse_hx * (lambda_u[k + 1] - lambda_u[k])
    stretch_y = inverse_hy * (v[south] - v[k]) * inverse_hy * (lambda_v[south] - lambda_v[k])
    shears = Real(0.0)
    for m in range(4):
        node = k + m % 2 + m // 2 * pitch
        of_v = shear_at(u, v, node, pitch, inverse_hx, inverse_hy)
        of_lambda = shear_at(lambda_u, lambda_v, node, pitch, inverse_hx, inverse_hy)
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
    north = inside(k - pitch)
    south = inside(k + pitch)
    across = ax * (f[k - 1] - f[k] + f[k + 1] - f[k]) + ay * (f[north] - f[k] + f[south] - f[k])
    mu_bar[k] = mu_bar[k] + lambda_f[k] * dt * across
