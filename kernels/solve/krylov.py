"""Conjugate gradients preconditioned by a V-cycle M, with all numbers in device memory.

    q = -A p,  length = -rz / <p, q>,  x += length p,  r += length q
    z = M r,  rz' = <r, z>,  ratio = rz' / rz,  p = z + ratio p

rz = <r, M r> is the squared error in the norm of A, <e, A e>, to the degree that M approximates A^-1. The
loop runs while rz is above a limit. J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., algorithm 5.3.

x, r and p are updated in place, each entry from its old value.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells, lines
from wfluid.kernels.cell.real import Field, Indices, Real, Uniform
from wfluid.kernels.solve.sums import total_of


@lines
def begin(
    t: int,
    residual_rows: Field,
    scale_rows: Field,
    count: int,
    tolerance: Real,
    most: int,
    # outputs
    rz: Field,
    limit: Field,
    going: Indices,
    iterations: Indices,
):
    """rz of the first residual, and its limit: tolerance^2 times the lesser of rz and the sum of
    `scale_rows`.
    """
    first = total_of(residual_rows, count)
    rz[0] = first
    limit[0] = tolerance * tolerance * wp.min(first, total_of(scale_rows, count))
    iterations[0] = 0
    going[0] = int(first > limit[0] and most > 0)


@lines
def measure_length(
    t: int,
    rows: Field,
    count: int,
    rz: Field,
    # outputs
    length: Field,
):
    """length = -rz / <p, q>; 0 where p is 0."""
    curvature = -total_of(rows, count)
    length[0] = Real(0.0)
    if curvature > Real(0.0):
        length[0] = rz[0] / curvature


@lines
def measure_ratio(
    t: int,
    rows: Field,
    count: int,
    limit: Field,
    most: int,
    # outputs
    rz: Field,
    ratio: Field,
    going: Indices,
    iterations: Indices,
):
    """ratio = rz' / rz; going = 1 while rz' is above the limit and fewer than `most` iterations have run."""
    new = total_of(rows, count)
    ratio[0] = new / rz[0]
    rz[0] = new
    iterations[0] = iterations[0] + 1
    going[0] = int(new > limit[0] and iterations[0] < most)


@cells
def advance(
    i: int,
    j: int,
    k: int,
    p: Field,
    q: Field,
    length: Uniform,
    # outputs
    x: Field,
    r: Field,
):
    """x += length p and r += length q, in place."""
    k = inside(k)
    x[k] = x[k] + length * p[k]
    r[k] = r[k] + length * q[k]


@cells
def update_direction(
    i: int,
    j: int,
    k: int,
    z: Field,
    ratio: Uniform,
    # outputs
    p: Field,
):
    """p = z + ratio p, in place."""
    k = inside(k)
    p[k] = z[k] + ratio * p[k]
