"""Sums of fields: one row a line, then one line over the rows."""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Real

LANES = wp.constant(8)
"""Partial sums a row keeps, so that additions need not wait for each other."""

Lane = wp.types.vector(8, Real)


@wp.func
def total_of_lanes(part: Lane):
    """Sum of the lanes."""
    total = Real(0.0)
    for lane in range(LANES):
        total += part[lane]
    return total


@lines
def row_sums(
    t: int,
    x: Field,
    nx: int,
    pitch: int,
    # outputs
    rows: Field,
):
    """The sum of x over row t."""
    at = index(0, t, pitch)
    part = Lane()
    whole = nx // LANES * LANES
    for i in range(0, whole, LANES):
        for lane in range(LANES):
            part[lane] += x[at + i + lane]
    total = total_of_lanes(part)
    for i in range(whole, nx):
        total += x[at + i]
    rows[t] = total


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
    at = index(0, t, pitch)
    part = Lane()
    whole = nx // LANES * LANES
    for i in range(0, whole, LANES):
        for lane in range(LANES):
            part[lane] += x[at + i + lane] * y[at + i + lane]
    total = total_of_lanes(part)
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
    at = index(0, t, pitch)
    for i in range(nx):
        value = f[at + i]
        total += value * value
        top = wp.max(top, wp.abs(value))
    sum_squares[t] = total
    largest[t] = top
