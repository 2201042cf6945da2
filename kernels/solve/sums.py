"""Sums of fields: one row a line, then one line over the rows."""

import warp as wp
from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Real

LANES = wp.constant(8)
"""Partial sums a row keeps, so that additions need not wait for each other."""

Lane = wp.types.vector(8, Real)


@lines
def row_products(
    t: int,
    x: Field,
    y: Field,
    nx: int,
    pitch: int,
    first: int,
    # outputs
    rows: Field,
):
    """Entry first + t: the sum of x y over row t."""
    at = (t + 2) * pitch + 2
    part = Lane()
    whole = nx // LANES * LANES
    for i in range(0, whole, LANES):
        for lane in range(LANES):
            part[lane] += x[at + i + lane] * y[at + i + lane]
    total = Real(0.0)
    for lane in range(LANES):
        total += part[lane]
    for i in range(whole, nx):
        total += x[at + i] * y[at + i]
    rows[first + t] = total


@wp.func
def total_of(rows: Field, count: int):
    """Sum of the first `count` rows."""
    total = Real(0.0)
    for n in range(count):
        total += rows[n]
    return total


@lines
def mean_of(
    t: int,
    rows: Field,
    count: int,
    cells: int,
    # outputs
    mean: Field,
):
    """The sum of the rows over a number of cells."""
    mean[0] = total_of(rows, count) / Real(cells)


@lines
def row_norms(
    t: int,
    f: Field,
    nx: int,
    pitch: int,
    # outputs
    sum_squares: Field,
    largest: Field,
):
    """Sum of squares and largest absolute value of f in row t."""
    total = Real(0.0)
    top = Real(0.0)
    at = (t + 2) * pitch + 2
    for i in range(nx):
        value = f[at + i]
        total += value * value
        top = wp.max(top, wp.abs(value))
    sum_squares[t] = total
    largest[t] = top
