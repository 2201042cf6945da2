"""Variable viscosity and drag, implicit, both components of the velocity coupled:

    A v = v + dt alpha v - dt div (mu (grad v + grad v^T))

Bonilla & Velho, equation (2), the viscous term in flux form; alpha is the drag [1/s] that freezes. On the
face between two centres, s along the component and o across it, the divergence of the stress is

    2 d_s (mu d_s f)  +  d_o (mu (d_o f + d_s g))        f the component, g the other one
      at the centres        at the nodes

mu [longer side^2/s] and alpha are at centres; a node takes the mean of the four centres around it, a face
the mean of its two. Second order; symmetric and positive definite, since the divergence is the transpose of
the strain, up to sign, with the same mu between them. A rigid motion has no strain, hence no stress, whatever
mu. Walls are in the ghosts: the shear on a free-slip wall is 0, on a no-slip wall the velocity half a cell
away over half a cell.

Each program treats one component, f on its faces with g the other one, by two strides: (along, across) =
(1, pitch) for u on x-faces, (pitch, 1) for v on y-faces. dt, normal, shear and cross are those of
`stress_divergence_f`; b, f, g and the outputs are fields in longer side/s.

The smoother divides the residual by the row sums of |A|, so no eigenvalue of M^-1 A exceeds one, whatever
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
    """Mean of c over the four centres around the top left node of cell k."""
    behind = inside(k - along)
    before = inside(k - across)
    corner = inside(k - along - across)
    return Real(0.25) * (c[k] + c[behind] + c[before] + c[corner])


@wp.func
def stress_divergence_f(
    f: Field, g: Field, mu: Field, k: int, along: int, across: int, normal: Real, shear: Real, cross: Real
):
    """dt div (mu (grad v + grad v^T)) [longer side/s] on face k of the component f, g the other one.

    normal = 2 dt / h_s^2, shear = dt / h_o^2, cross = dt / (h_s h_o).
    """
    ahead = inside(k + along)
    behind = inside(k - along)
    before = inside(k - across)
    after = inside(k + across)
    mu_before = mean_n(mu, k, along, across)
    mu_after = mean_n(mu, after, along, across)
    d_s_of_d_s_f = mu[k] * (f[ahead] - f[k]) - mu[behind] * (f[k] - f[behind])
    d_o_of_d_o_f = mu_after * (f[after] - f[k]) - mu_before * (f[k] - f[before])
    d_o_of_d_s_g = mu_after * (g[after] - g[inside(after - along)]) - mu_before * (g[k] - g[behind])
    return (
        normal * d_s_of_d_s_f  # 2 d_s (mu d_s f)
        + shear * d_o_of_d_o_f  # + d_o (mu d_o f)
        + cross * d_o_of_d_s_g  # + d_o (mu d_s g)
    )


@wp.func
def row_sum_f(
    mu: Field, alpha: Field, k: int, along: int, across: int, dt: Real, normal: Real, shear: Real, cross: Real
):
    """Sum of |A| over the row of face k: 1 + dt alpha + 2 (normal mu_c + (shear + cross) mu_n).

    mu_c is the sum of mu at the two centres beside the face, mu_n that at its two nodes.
    """
    mu_normal = mu[k] + mu[inside(k - along)]
    mu_shear = mean_n(mu, k, along, across) + mean_n(mu, inside(k + across), along, across)
    drag = Real(1.0) + dt * mean_f(alpha, k, along)
    return drag + Real(2.0) * (normal * mu_normal + (shear + cross) * mu_shear)


@wp.func
def residual_f(
    b: Field,
    f: Field,
    g: Field,
    mu: Field,
    alpha: Field,
    k: int,
    along: int,
    across: int,
    dt: Real,
    normal: Real,
    shear: Real,
    cross: Real,
):
    """b - A v on face k: b - f - dt alpha f + dt div (mu (grad v + grad v^T))."""
    drag = Real(1.0) + dt * mean_f(alpha, k, along)
    stress = stress_divergence_f(f, g, mu, k, along, across, normal, shear, cross)
    return b[k] - drag * f[k] + stress


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
    """r = b - A v [longer side/s] on the faces of one component: f, with g the other one."""
    k = inside(k)
    r[k] = residual_f(b, f, g, mu, alpha, k, along, across, dt, normal, shear, cross)


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
    """out = 1 / the row sum of |A|, on the faces of one component."""
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
    """out = f + rate weights (b - A v): one damped sweep of one component, on its faces [longer side/s]."""
    k = inside(k)
    residual = residual_f(b, f, g, mu, alpha, k, along, across, dt, normal, shear, cross)
    out[k] = f[k] + rate * weights[k] * residual


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
    """out = rate weights b: the sweep from zero of one component, on its faces."""
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
    """beta = 1 / (1 + dt alpha) on face k, by which drag alone reduces a velocity in a step."""
    k = inside(k)
    beta[k] = Real(1.0) / (Real(1.0) + dt * mean_f(alpha, k, along))
