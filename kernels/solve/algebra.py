"""Vector algebra on fields, entry by entry."""

from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Uniform


@cells
def copy(
    i: int,
    j: int,
    k: int,
    f: Field,
    # outputs
    out: Field,
):
    """out = f."""
    k = inside(k)
    out[k] = f[k]


@cells
def scale(
    i: int,
    j: int,
    k: int,
    f: Field,
    factor: Uniform,
    # outputs
    out: Field,
):
    """out = factor f; out may be f."""
    k = inside(k)
    out[k] = factor * f[k]


@cells
def multiply(
    i: int,
    j: int,
    k: int,
    f: Field,
    g: Field,
    # outputs
    out: Field,
):
    """out = g f; out may be f."""
    k = inside(k)
    out[k] = g[k] * f[k]


@cells
def add_scaled(
    i: int,
    j: int,
    k: int,
    f: Field,
    g: Field,
    factor: Uniform,
    # outputs
    out: Field,
):
    """out = f + factor g."""
    k = inside(k)
    out[k] = f[k] + factor * g[k]


@cells
def add(
    i: int,
    j: int,
    k: int,
    f: Field,
    # outputs
    out: Field,
):
    """out = out + f, in place."""
    k = inside(k)
    out[k] = out[k] + f[k]


@cells
def subtract(
    i: int,
    j: int,
    k: int,
    f: Field,
    # outputs
    out: Field,
):
    """out = out - f, in place."""
    k = inside(k)
    out[k] = out[k] - f[k]


@cells
def subtract_number(
    i: int,
    j: int,
    k: int,
    number: Uniform,
    # outputs
    out: Field,
):
    """out = out - number, in place: removes a mean."""
    k = inside(k)
    out[k] = out[k] - number
