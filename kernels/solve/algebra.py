"""Vector algebra on fields."""

from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Uniform


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
def lower(
    i: int,
    j: int,
    k: int,
    by: Uniform,
    # outputs
    b: Field,
):
    """Take a number off b, in place: a mean that should not be there."""
    k = inside(k)
    b[k] = b[k] - by


@cells
def weigh(
    i: int,
    j: int,
    k: int,
    weight: Field,
    # outputs
    s: Field,
):
    """Multiply the divergence at centre k by a weight, in place."""
    k = inside(k)
    s[k] = s[k] * weight[k]


@cells
def dragged(
    i: int,
    j: int,
    k: int,
    f: Field,
    beta: Field,
    # outputs
    out: Field,
):
    """Out = beta f: a component of the velocity after drag alone."""
    k = inside(k)
    out[k] = beta[k] * f[k]


@cells
def scaled(
    i: int,
    j: int,
    k: int,
    b: Field,
    rate: Uniform,
    # outputs
    out: Field,
):
    """The sweep from zero: out = rate b."""
    k = inside(k)
    out[k] = rate * b[k]


@cells
def add_scaled(
    i: int,
    j: int,
    k: int,
    x: Field,
    e: Field,
    factor: Uniform,
    # outputs
    out: Field,
):
    """Out = x + factor e: a cycle's correction, with its Chebyshev factor."""
    k = inside(k)
    out[k] = x[k] + factor * e[k]
