"""Sums of fields: first over each row, one row per line, then over the rows."""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Real

LANES = wp.constant(8)
"""Partial sums of a row, so that an addition need not wait for the one before."""

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
    """rows[t] = the sum of x over row t."""
    row = index(0, t, pitch)
    part = Lane()
    end = nx // LANES * LANES
    for i in range(0, end, LANES):
        for lane in range(LANES):
            part[lane] += x[row + i + lane]
    total = total_of_lanes(part)
    for i in range(end, nx):
        total += x[row + i]
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
    """rows[first + t] = the sum of x y over row t."""
    row = index(0, t, pitch)
    part = Lane()
    end = nx // LANES * LANES
    for i in range(0, end, LANES):
        for lane in range(LANES):
            part[lane] += x[row + i + lane] * y[row + i + lane]
    total = total_of_lanes(part)
    for i in range(end, nx):
        total += x[row + i] * y[row + i]
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
    """mean = the sum of the rows divided by the number of cells."""
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
    """sum_squares[t] and largest[t]: sum of squares and largest absolute value of f in row t."""
    total = Real(0.0)
    top = Real(0.0)
    row = index(0, t, pitch)
    for i in range(nx):
        value = f[row + i]
        total += value * value
        top = wp.max(top, wp.abs(value))
    sum_squares[t] = total
    largest[t] = top
