"""Variable viscosity and drag, implicit, both components of the velocity coupled:

    A v = v + dt alpha v - dt div (mu (grad v + grad v^T))

Bonilla & Velho, equation (2), the viscous term in flux form; alpha is the drag that freezes. The
divergence of the stress on the face between two centres, s the component's own direction, o the other:

    2 d_s (mu d_s f)  +  d_o (mu (d_o f + d_s g))        f the component, g the other one
      at the centres        at the nodes

mu and alpha live at centres; a node takes the mean of the four centres around it, a face that of its
two. Second order; symmetric and positive definite: every stress is the transpose of the strain it
meets, with the same mu. A rigid motion has no strain, so it feels nothing, whatever mu. Walls are in
the ghosts: a free-slip wall has no shear, a no-slip wall twice the shear of half a cell.

One program serves both components by its two strides: (along, across) = (1, pitch) for u on x-faces,
(pitch, 1) for v on y-faces.

The smoother scales the residual with the row sums of |A|: no eigenvalue of M^-1 A exceeds one, whatever
mu, alpha, cells and walls (l1-Jacobi; Baker, Falgout, Kolev & Yang, SIAM J. Sci. Comput. 33, 2011). For
constant mu that is Jacobi with weight 3/8.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.step.differences import mean_f


@wp.func
def mean_n(c: Field, k: int, along: int, across: int):
    """Mean of c around the node where face k begins."""
    behind = inside(k - along)
    before = inside(k - across)
    corner = inside(k - along - across)
    return Real(0.25) * (c[k] + c[behind] + c[before] + c[corner])


@wp.func
def stress_divergence_f(
    f: Field, g: Field, mu: Field, k: int, along: int, across: int, normal: Real, shear: Real, cross: Real
):
    """dt div (mu (grad v + grad v^T)) on face k.

    normal = 2 dt / h_s^2, shear = dt / h_o^2, cross = dt / (h_s h_o).
    """
    ahead = inside(k + along)
    behind = inside(k - along)
    before = inside(k - across)
    after = inside(k + across)
    mu_before = mean_n(mu, k, along, across)
    mu_after = mean_n(mu, after, along, across)
    compression = mu[k] * (f[ahead] - f[k]) - mu[behind] * (f[k] - f[behind])
    sliding = mu_after * (f[after] - f[k]) - mu_before * (f[k] - f[before])
    turning = mu_after * (g[after] - g[inside(after - along)]) - mu_before * (g[k] - g[behind])
    return normal * compression + shear * sliding + cross * turning


@wp.func
def row_sum_f(
    mu: Field, alpha: Field, k: int, along: int, across: int, dt: Real, normal: Real, shear: Real, cross: Real
):
    """Sum of |A| over the row of face k."""
    mu_normal = mu[k] + mu[inside(k - along)]
    mu_shear = mean_n(mu, k, along, across) + mean_n(mu, inside(k + across), along, across)
    drag = Real(1.0) + dt * mean_f(alpha, k, along)
    return drag + Real(2.0) * (normal * mu_normal + (shear + cross) * mu_shear)


@cells
def residual(
    i: int,
    j: int,
    k: int,
    b: Field,
    f: Field,
    g: Field,
    mu: Field,
    alpha: Field,
    dt: Uniform,
    normal: Uniform,
    shear: Uniform,
    cross: Uniform,
    along: int,
    across: int,
    # outputs
    r: Field,
):
    """What is left of one component: r = b - A v."""
    k = inside(k)
    drag = Real(1.0) + dt * mean_f(alpha, k, along)
    r[k] = b[k] - drag * f[k] + stress_divergence_f(f, g, mu, k, along, across, normal, shear, cross)


@cells
def weight(
    i: int,
    j: int,
    k: int,
    mu: Field,
    alpha: Field,
    dt: Uniform,
    normal: Uniform,
    shear: Uniform,
    cross: Uniform,
    along: int,
    across: int,
    # outputs
    out: Field,
):
    """1 / the row sum of |A| of one component."""
    k = inside(k)
    out[k] = Real(1.0) / row_sum_f(mu, alpha, k, along, across, dt, normal, shear, cross)


@cells
def sweep(
    i: int,
    j: int,
    k: int,
    b: Field,
    f: Field,
    g: Field,
    mu: Field,
    alpha: Field,
    dt: Uniform,
    normal: Uniform,
    shear: Uniform,
    cross: Uniform,
    along: int,
    across: int,
    weights: Field,
    rate: Uniform,
    # outputs
    out: Field,
):
    """One damped sweep of one component: out = f + rate weight (b - A v)."""
    k = inside(k)
    drag = Real(1.0) + dt * mean_f(alpha, k, along)
    left = b[k] - drag * f[k] + stress_divergence_f(f, g, mu, k, along, across, normal, shear, cross)
    out[k] = f[k] + rate * weights[k] * left


@cells
def first_sweep(
    i: int,
    j: int,
    k: int,
    b: Field,
    weights: Field,
    rate: Uniform,
    # outputs
    out: Field,
):
    """The sweep from zero: out = rate weight b."""
    k = inside(k)
    out[k] = rate * weights[k] * b[k]


@cells
def drag_factor(
    i: int,
    j: int,
    k: int,
    alpha: Field,
    dt: Uniform,
    along: int,
    # outputs
    beta: Field,
):
    """beta = 1 / (1 + dt alpha) on face k: what drag alone leaves of a velocity."""
    k = inside(k)
    beta[k] = Real(1.0) / (Real(1.0) + dt * mean_f(alpha, k, along))
