"""Conjugate gradients preconditioned by a cycle, all its numbers in device memory.

    q = -A p,  length = -rz / <p, q>,  x += length p,  r += length q
    z = M r,  rz' = <r, z>,  ratio = rz' / rz,  p = z + ratio p

rz = <r, M r> measures the error in the operator's own norm, <e, A e>, as far as M is A^-1; the loop goes
on while it is above a limit. J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., algorithm 5.3.

x, r and p are updated in place, each entry from itself.
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
    whole_rows: Field,
    count: int,
    tolerance: Real,
    most: int,
    # outputs
    rz: Field,
    limit: Field,
    going: Indices,
    iterations: Indices,
):
    """rz of the first residual, and where to stop: at tolerance^2 times the lesser of it and <w, w>."""
    first = total_of(residual_rows, count)
    rz[0] = first
    limit[0] = tolerance * tolerance * wp.min(first, total_of(whole_rows, count))
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
    """length = -rz / <p, q>, 0 where p has come to nothing."""
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
    """ratio = rz' / rz; whether to go on. Stops where rounding leaves no descent."""
    left = total_of(rows, count)
    ratio[0] = left / rz[0]
    rz[0] = left
    iterations[0] = iterations[0] + 1
    going[0] = int(left > limit[0] and iterations[0] < most)


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
def turn(
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
