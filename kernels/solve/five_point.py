"""Jacobi relaxation of the five-point systems: implicit diffusion and the pressure Poisson equation.

Both are A x = b with, in cell or face k,

    (A x)[k] = centre x[k] - ax (x[k-1] + x[k+1]) - ay (x[k-pitch] + x[k+pitch])

    diffusion   (1 - dt mu Lap) v = v*   ax = dt mu / hx^2, ay = dt mu / hy^2, centre = 1 + 2 ax + 2 ay
    pressure    -div grad q = -div v     ax = 1 / hx^2,     ay = 1 / hy^2,     centre =     2 ax + 2 ay

second order in space; walls are in the ghosts of x. This is `laplacian_c` of `step/differences` with the
diagonal apart, `neighbours` - 2 (ax + ay) x, since sweeps divide by the diagonal. With face coefficients the
pressure operator is -D beta G, beta on x-faces and y-faces; the diagonal is their sum weighted by ax and ay.

A damped Jacobi sweep is x + w (b - A x) / centre. Two sweeps with the inverse Chebyshev roots of the
spectrum to be damped as factors w reduce it more than two equal ones at the same cost (Golub & Van
Loan, Matrix Computations, 4th ed., 11.2.8; Briggs, Henson & McCormick, A Multigrid Tutorial, ch. 2).
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.differences import laplacian_beta_c


@wp.func
def neighbours(x: Field, k: int, pitch: int, ax: Real, ay: Real):
    """ax (x_west + x_east) + ay (x_north + x_south)."""
    north = inside(k - pitch)
    south = inside(k + pitch)
    return ax * (x[k - 1] + x[k + 1]) + ay * (x[north] + x[south])


@cells
def jacobi(
    i: int,
    j: int,
    k: int,
    b: Field,
    x: Field,
    rate: Uniform,
    centre: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    out: Field,
):
    """out = x + rate (b - A x): one damped sweep, rate = w / centre."""
    k = inside(k)
    out[k] = x[k] + rate * (b[k] - centre * x[k] + neighbours(x, k, pitch, ax, ay))


@cells
def first_two_sweeps(
    i: int,
    j: int,
    k: int,
    b: Field,
    centre_factor: Uniform,
    neighbour_factor: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    out: Field,
):
    """out = centre_factor b + neighbour_factor (ax (b_west + b_east) + ay (b_north + b_south)).

    That is two damped sweeps from zero in one pass over b: the first gives w1 b / centre, hence
    centre_factor = (w1 + w2 - w1 w2) / centre and neighbour_factor = w1 w2 / centre^2.
    """
    k = inside(k)
    out[k] = centre_factor * b[k] + neighbour_factor * neighbours(b, k, pitch, ax, ay)


@cells
def residual(
    i: int,
    j: int,
    k: int,
    b: Field,
    x: Field,
    centre: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    r: Field,
):
    """r = b - A x: the residual at k."""
    k = inside(k)
    r[k] = b[k] - centre * x[k] + neighbours(x, k, pitch, ax, ay)


@wp.func
def diagonal_c(beta_x: Field, beta_y: Field, k: int, pitch: int, ax: Real, ay: Real):
    """ax (beta_x west + beta_x east) + ay (beta_y north + beta_y south): the diagonal of -D beta G."""
    south = inside(k + pitch)
    return ax * (beta_x[k] + beta_x[k + 1]) + ay * (beta_y[k] + beta_y[south])


@cells
def jacobi_beta(
    i: int,
    j: int,
    k: int,
    b: Field,
    x: Field,
    beta_x: Field,
    beta_y: Field,
    damping: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    out: Field,
):
    """out = x + damping (b + D beta G x) / centre: one damped sweep at centre k, beta on its faces."""
    k = inside(k)
    residual = b[k] + laplacian_beta_c(x, beta_x, beta_y, k, pitch, ax, ay)
    out[k] = x[k] + damping * residual / diagonal_c(beta_x, beta_y, k, pitch, ax, ay)


@cells
def first_sweep_beta(
    i: int,
    j: int,
    k: int,
    b: Field,
    beta_x: Field,
    beta_y: Field,
    damping: Uniform,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    out: Field,
):
    """out = damping b / centre: the sweep from zero."""
    k = inside(k)
    out[k] = damping * b[k] / diagonal_c(beta_x, beta_y, k, pitch, ax, ay)


@cells
def residual_beta(
    i: int,
    j: int,
    k: int,
    b: Field,
    x: Field,
    beta_x: Field,
    beta_y: Field,
    ax: Uniform,
    ay: Uniform,
    pitch: int,
    # outputs
    r: Field,
):
    """r = b + D beta G x: the residual at centre k, beta on its faces."""
    k = inside(k)
    r[k] = b[k] + laplacian_beta_c(x, beta_x, beta_y, k, pitch, ax, ay)
