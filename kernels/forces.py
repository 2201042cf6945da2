"""Forces: dv/dt = f, added to the velocity on the faces.

A Gaussian force of centre c and radius sigma is g(x) times a vector, with

    g(x) = exp(-|x - c|^2 / 2 sigma^2) = exp(-(x - c_x)^2 / 2 sigma^2) exp(-(y - c_y)^2 / 2 sigma^2)

so two profiles per axis, at faces and at centres, replace one exponential a cell. Over a step the
velocity gains g times the force's impulse (its vector integrated over the step by the host, hence
exact for every envelope and any dt). Beyond `CUT` radii g is below rounding and taken as zero.

A force that a picture paints is a field on the faces, made once, times its impulse. A weight is a
factor at centres, of which a face takes the mean of its two.
"""

import warp as wp
from wfluid.kernels.cells import Field, Real, Uniform, cells, entry, gather, inside, lines

CUT = wp.constant(Real({"float32": 6.0, "float64": 9.0}[Real.__name__]))
"""Radii after which exp(-r^2/2) is below the rounding of one."""


@lines
def profile(
    t: int,
    centre: Field,
    radius: Field,
    points: int,
    start: Real,
    h: Real,
    period: Real,
    # outputs
    out: Field,
):
    """Gaussian of force t // points at the point (t % points + start) h of one axis.

    `period` is the length of a periodic axis, whose nearest image counts, and 0 between walls.
    """
    force = t // points
    d = (Real(t - force * points) + start) * h - centre[force]
    if period > Real(0.0):
        d = d - period * wp.round(d / period)
    r = d / radius[force]
    g = Real(0.0)
    if wp.abs(r) < CUT:
        g = wp.exp(Real(-0.5) * r * r)
    out[t] = g


@cells
def copied(
    i: int,
    j: int,
    k: int,
    f: Field,
    # outputs
    out: Field,
):
    """Out = f: the component that forces are then added to."""
    k = inside(k)
    out[k] = f[k]


@cells
def push(
    n: int,
    i: int,
    j: int,
    k: int,
    impulse_x: Field,
    impulse_y: Field,
    face_x: Field,
    centre_x: Field,
    centre_y: Field,
    face_y: Field,
    nx: int,
    ny: int,
    # outputs
    u: Field,
    v: Field,
):
    """Add the impulse [L/s] of force n to the x-face and y-face of cell k, in place."""
    k = inside(k)
    row = n * ny + j
    on_u = gather(impulse_x, n) * gather(centre_y, row)
    on_v = gather(impulse_y, n) * gather(face_y, row)
    column = entry(n * nx + wp.min(i, nx - 1))
    wp.atomic_add(u, k, on_u * gather(face_x, column))
    wp.atomic_add(v, k, on_v * gather(centre_x, column))


@cells
def push_field(
    i: int,
    j: int,
    k: int,
    f: Field,
    impulse: Uniform,
    # outputs
    u: Field,
):
    """Add the field f on faces, times the impulse of its envelope [s], to one component, in place."""
    k = inside(k)
    u[k] = u[k] + impulse * f[k]


@cells
def push_weighted(
    i: int,
    j: int,
    k: int,
    gained: Field,
    weight: Field,
    before: int,
    # outputs
    u: Field,
):
    """Add what forces gained [L/s], times a weight at centres k and k - `before`, in place."""
    k = inside(k)
    u[k] = u[k] + Real(0.5) * (weight[k] + weight[inside(k - before)]) * gained[k]
