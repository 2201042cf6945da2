"""Forces: dv/dt = f, added to the velocity on the faces.

Most forces are Gaussians of centre c and radius sigma, with r = (x - c) / sigma

    g(x) = exp(-|r|^2 / 2) = exp(-r_x^2 / 2) exp(-r_y^2 / 2)

    push    p g                   a vector p
    vortex  w (-r_y, r_x) g       without divergence

so two profiles per axis, at faces and at centres, replace one exponential per cell. In a step the velocity
increases by the impulse of the force, which the host integrates over the step, exactly for every envelope and
any dt. Beyond `CUT` radii g is below rounding and set to 0, so a force is computed only in the box of that
size.

On a periodic axis a Gaussian has an image one period further on, and so on: the field is the sum over all
images. It is a product over the axes as well, so along each axis the profile g is the sum of the images'
values, and r the mean of their distances weighted by these values. Where a single image counts, these are its
own. Higher powers of r need an `excess`, the sum of r^a g over the images less r^a g of these two.

Other forces are an impulse times a constant field on the faces, or times a density at centres. A weight is a
factor at centres; a face takes the mean of its two.
"""

import math

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, gather, inside
from wfluid.kernels.cell.program import cells, lines
from wfluid.kernels.cell.real import Field, Real, RowReal, Uniform
from wfluid.kernels.step.differences import mean_f

CUT = wp.constant(Real({"float32": 6.0, "float64": 9.0}[Real.__name__]))
"""Distance [radii] beyond which exp(-r^2/2) is below the rounding of 1."""


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
    """r and g = exp(-r^2 / 2) of force j at position (i + start) h along one axis; r in radii.

    centre, radius and h are in longer sides. `period` is the length of a periodic axis, where r is the
    distance to the nearest image; 0 between walls.
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
    """Index of point i in the profile of force n."""
    return entry(index(i, n, pitch))


WIDE = wp.constant(Real(1.5))
"""Radius [periods] from which the sum over the images is constant: its relative variation is exp(-44)."""

SQRT_TWO_PI = wp.constant(Real(math.sqrt(2.0 * math.pi)))


@wp.func
def images_beside(radius: Real, period: Real):
    """Number of images on each side of the nearest one that are within `CUT` radii of some point.

    `period` is the length of a periodic axis, 0 between walls.
    """
    count = int(0)  # noqa: UP018, RUF046 - Warp's way to declare a variable
    if period > Real(0.0):
        count = int(CUT * radius / period + Real(0.5))
    return count


@lines
def add_images(
    t: int,
    centre: Field,
    radius: Field,
    start: Real,
    h: Real,
    period: Real,
    points: int,
    pitch: int,
    # outputs
    r: Field,
    g: Field,
    excess_2: Field,
    excess_3: Field,
    excess_4: Field,
):
    """Add the other images of force t to its `profile` along a periodic axis, in place; find the excesses.

    Where no other image counts nothing is written, the excesses neither.
    """
    sigma = radius[t]
    beside = images_beside(sigma, period)
    if beside == 0:
        return
    for i in range(points):
        k = in_profile(t, i, pitch)
        value = Real(g[k])
        sum1 = r[k] * value
        sum2 = r[k] * sum1
        sum3 = r[k] * sum2
        sum4 = r[k] * sum3
        alone = value
        if sigma < WIDE * period:
            d = (Real(i) + start) * h - centre[t]
            nearest = wp.round(d / period)
            for m in range(-beside, beside + 1):
                s = (d - period * (nearest + Real(m))) / sigma
                if m != 0 and wp.abs(s) < CUT:
                    weight = wp.exp(Real(-0.5) * s * s)
                    value += weight
                    sum1 += s * weight
                    sum2 += s * s * weight
                    sum3 += s * s * s * weight
                    sum4 += s * s * s * s * weight
        else:  # moments of a Gaussian, times the number of images within a radius
            value = sigma / period * SQRT_TWO_PI
            sum1 = Real(0.0)
            sum2 = value
            sum3 = Real(0.0)
            sum4 = Real(3.0) * value
        mean = r[k]
        if value != alone:
            mean = sum1 / value
        r[k] = mean
        g[k] = value
        excess_2[k] = sum2 - mean * mean * value
        excess_3[k] = sum3 - mean * mean * mean * value
        excess_4[k] = sum4 - mean * mean * mean * mean * value


@cells
def push(
    n: int,
    i: int,
    j: int,
    k: int,
    push_x: Field,
    push_y: Field,
    spin: Field,
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
    """u += (push_x - spin r_y) g on x-face k, v += (push_y + spin r_x) g on y-face k, in place.

    push_x, push_y and spin are the impulses of force n [longer side/s], g and r its profiles at faces and
    centres.
    """
    k = inside(k)
    column = in_profile(n, i, pitch_x)
    row = in_profile(n, j, pitch_y)
    on_u = (gather(push_x, n) - gather(spin, n) * gather(r_y, row)) * gather(centre_y, row)
    on_v = gather(push_y, n) + gather(spin, n) * gather(r_x, column)
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
    """u += impulse (rho[k - before] + rho[k]) / 2 on face k: buoyancy of a density at centres, in place."""
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
    """u += impulse f on face k, in place: f [longer side/s^2] a force, impulse [s] from its envelope."""
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
    """u += (weight[k - before] + weight[k]) / 2 gained on face k, in place.

    `gained` is the change of velocity by forces [longer side/s], `weight` a factor at centres.
    """
    k = inside(k)
    u[k] = u[k] + mean_f(weight, k, before) * gained[k]
