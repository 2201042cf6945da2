"""Forces: dv/dt = f, added to the velocity on the faces.

Most forces are Gaussians of centre c and radius sigma, with r = (x - c) / sigma

    g(x) = exp(-|r|^2 / 2) = exp(-r_x^2 / 2) exp(-r_y^2 / 2)

    push    p g                   a vector p
    vortex  w (-r_y, r_x) g       without divergence

so two profiles per axis, at faces and at centres, replace one exponential a cell. Over a step the
velocity gains the force's impulse (integrated over the step by the host, hence exact for every envelope
and any dt). Beyond `CUT` radii g is below rounding and taken as zero: a force runs on the box of that
size only.

Other forces are fields on the faces, made once, times their impulse; or a density, at centres, times a
vector. A weight is a factor at centres, of which a face takes the mean of its two.
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real, RowReal, Uniform
from wfluid.kernels.step.differences import mean_f

CUT = wp.constant(Real({"float32": 6.0, "float64": 9.0}[Real.__name__]))
"""Radii after which exp(-r^2/2) is below the rounding of one."""


@cells
def profile(
    i: int,
    j: int,
    k: int,
    centre: RowReal,
    radius: RowReal,
    start: Real,
    h: Real,
    period: Real,
    # outputs
    r: Field,
    g: Field,
):
    """Distance [radii] and Gaussian of force j at the point (i + start) h of one axis.

    `period` is the length of a periodic axis, whose nearest image counts, and 0 between walls.
    """
    k = inside(k)
    d = (Real(i) + start) * h - centre
    if period > Real(0.0):
        d = d - period * wp.round(d / period)
    s = d / radius
    value = Real(0.0)
    if wp.abs(s) < CUT:
        value = wp.exp(Real(-0.5) * s * s)
    r[k] = s
    g[k] = value


@wp.func
def in_profile(n: int, i: int, pitch: int):
    """Index of point i of force n in a table of profiles."""
    return entry(index(i, n, pitch))


@cells
def push(
    n: int,
    i: int,
    j: int,
    k: int,
    push_x: Field,
    push_y: Field,
    turn: Field,
    face_x: Field,
    centre_x: Field,
    centre_y: Field,
    face_y: Field,
    r_x: Field,
    r_y: Field,
    pitch_x: int,
    pitch_y: int,
    # outputs
    u: Field,
    v: Field,
):
    """Add what force n gains [L/s] on the x-face and the y-face of cell k, in place."""
    k = inside(k)
    column = in_profile(n, i, pitch_x)
    row = in_profile(n, j, pitch_y)
    on_u = (gather(push_x, n) - gather(turn, n) * gather(r_y, row)) * gather(centre_y, row)
    on_v = gather(push_y, n) + gather(turn, n) * gather(r_x, column)
    u[k] = u[k] + on_u * gather(face_x, column)
    v[k] = v[k] + on_v * gather(centre_x, column) * gather(face_y, row)


@cells
def lift(
    i: int,
    j: int,
    k: int,
    rho: Field,
    impulse: Uniform,
    before: int,
    # outputs
    u: Field,
):
    """Add a density's buoyancy to one component, in place: impulse times its mean at k and k - `before`."""
    k = inside(k)
    u[k] = u[k] + impulse * mean_f(rho, k, before)


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
    u[k] = u[k] + mean_f(weight, k, before) * gained[k]
