"""Sources of densities, and sources of volume, which prescribe the divergence.

The source S of a density is a sum of Gaussians, d rho/dt = S (Bonilla & Velho, section II). A prescribed
divergence s = div v makes the picture grow or shrink; with r = (x - c) / sigma

    s(x) = a (1 - |r|^2 / 2) exp(-|r|^2 / 2)

has integral 0 over the plane, since it is the divergence of a (x - c) exp(-|r|^2 / 2) / 2. Both are
sums of products of profiles along x and y, and sums over all images on periodic axes (`forces`).
"""

from wfluid.kernels.cell.native import gather, inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.forces import images_beside, in_profile


@cells
def pour(
    n: int,
    i: int,
    j: int,
    k: int,
    amount: Field,
    centre_x: Field,
    centre_y: Field,
    pitch_x: int,
    pitch_y: int,
    # outputs
    rho: Field,
):
    """rho += amount g of Gaussian n at centre k, in place."""
    k = inside(k)
    g = gather(centre_x, in_profile(n, i, pitch_x)) * gather(centre_y, in_profile(n, j, pitch_y))
    rho[k] = rho[k] + gather(amount, n) * g


@cells
def swell(
    n: int,
    i: int,
    j: int,
    k: int,
    rate: Field,
    centre_x: Field,
    centre_y: Field,
    r_x: Field,
    r_y: Field,
    excess_x: Field,
    excess_y: Field,
    radius: Field,
    period_x: Real,
    period_y: Real,
    pitch_x: int,
    pitch_y: int,
    # outputs
    s: Field,
):
    """s += rate (1 - |r|^2 / 2) g [1/s] of source n at centre k, in place.

    The excesses are those of r^2 g along axes of lengths `period_x` and `period_y`, 0 between walls.
    """
    k = inside(k)
    column = in_profile(n, i, pitch_x)
    row = in_profile(n, j, pitch_y)
    x = gather(r_x, column)
    y = gather(r_y, row)
    g_x = gather(centre_x, column)
    g_y = gather(centre_y, row)
    amount = gather(rate, n)
    s[k] = s[k] + amount * (Real(1.0) - Real(0.5) * (x * x + y * y)) * (g_x * g_y)
    sigma = gather(radius, n)
    if images_beside(sigma, period_x) > 0:
        s[k] = s[k] - Real(0.5) * amount * gather(excess_x, column) * g_y
    if images_beside(sigma, period_y) > 0:
        s[k] = s[k] - Real(0.5) * amount * g_x * gather(excess_y, row)


@cells
def add_balanced(
    i: int,
    j: int,
    k: int,
    s: Field,
    mean: Uniform,
    # outputs
    b: Field,
):
    """b += s - mean [1/s] at centre k, in place, with b = -div v; closed walls admit no mean divergence."""
    k = inside(k)
    b[k] = b[k] + (s[k] - mean)


@cells
def pour_field(
    i: int,
    j: int,
    k: int,
    f: Field,
    impulse: Uniform,
    # outputs
    rho: Field,
):
    """rho += impulse f at centre k, in place: f a source [1/s], impulse the integral of its envelope [s]."""
    k = inside(k)
    rho[k] = rho[k] + impulse * f[k]
