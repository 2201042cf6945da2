"""Conjugate gradients preconditioned by a V-cycle M, with all numbers in device memory.

    q = -A p,  length = -rz / <p, q>,  x += length p,  r += length q
    z = M r,  rz' = <r, z>,  ratio = rz' / rz,  p = z + ratio p

rz = <r, M r> is the squared error in the norm of A, <e, A e>, to the degree that M approximates A^-1. Stiff
patches move as rigid bodies that M hardly corrects: eigenvalues of M A down to 0.03, which the loop finds
last. There rz is up to 100 times too small. 1 / (the longest length so far) estimates the least eigenvalue,
so rz * longest estimates <e, A e>, within a factor of about 4 also for those.

The loop runs while rz is above a limit relative to the solution, or the estimate above an absolute one.
J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., algorithm 5.3.

x, r and p are updated in place, each entry from its old value.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import cells, lines
from wfluid.kernels.cell.real import Field, Indices, Real, Uniform
from wfluid.kernels.solve.sums import total_of

ERROR_FLOOR = Real(1e-10)
"""Least absolute limit, relative to the sum of `scale_rows`: rounding in single precision."""


@lines
def begin(
    t: int,
    residual_rows: Field,
    scale_rows: Field,
    count: int,
    tolerance: Real,
    error: Field,
    most: int,
    # outputs
    rz: Field,
    limit: Field,
    error_limit: Field,
    longest: Field,
    going: Indices,
    iterations: Indices,
):
    """rz of the first residual, and its limits: tolerance^2 times the lesser of rz and the sum of
    `scale_rows`; and `error`, the squared error allowed in the norm of A.
    """
    first = total_of(residual_rows, count)
    scale = total_of(scale_rows, count)
    rz[0] = first
    limit[0] = tolerance * tolerance * wp.min(first, scale)
    error_limit[0] = wp.max(error[0], ERROR_FLOOR * scale)
    longest[0] = Real(1.0)
    iterations[0] = 0
    going[0] = int((first > limit[0] or first > error_limit[0]) and most > 0)


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
    error_limit: Field,
    length: Field,
    most: int,
    # outputs
    rz: Field,
    ratio: Field,
    longest: Field,
    going: Indices,
    iterations: Indices,
):
    """ratio = rz' / rz; going = 1 while an error is above its limit and fewer than `most` iterations have
    run.
    """
    new = total_of(rows, count)
    ratio[0] = new / rz[0]
    rz[0] = new
    longest[0] = wp.max(longest[0], length[0])
    iterations[0] = iterations[0] + 1
    left = new > limit[0] or new * longest[0] > error_limit[0]
    going[0] = int(left and iterations[0] < most)


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
