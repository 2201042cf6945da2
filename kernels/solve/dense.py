"""The coarsest level: its operator as a dense symmetric matrix, inverted in device memory.

The columns of the matrix are the operator applied to unit vectors, so that walls are included. Gauss-Jordan
elimination without pivoting is stable for symmetric positive definite matrices. A pivot of zero belongs to a
face on a wall, which is not an unknown: its step is skipped, and the solution is zero there (G. Golub, C. Van
Loan, Matrix Computations, 4th ed., 4.2 and the sweep operator of Goodnight, Amer. Statist. 33, 1979).
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.program import lines
from wfluid.kernels.cell.real import Field, Real


@wp.func
def place(n: int, nx: int, pitch: int):
    """Index in a field of unknown n; unknowns count row by row."""
    row = n // nx
    return index(n - row * nx, row, pitch)


@lines
def unit(
    t: int,
    which: int,
    nx: int,
    pitch: int,
    # outputs
    x: Field,
):
    """x = 1 in unknown `which`, 0 elsewhere; 0 everywhere if `which` is an unknown of another component."""
    value = Real(0.0)
    if t == which:
        value = Real(1.0)
    x[place(t, nx, pitch)] = value


@lines
def store_column(
    t: int,
    r: Field,
    column: int,
    first: int,
    unknowns: int,
    nx: int,
    pitch: int,
    shift: Real,
    # outputs
    matrix: Field,
):
    """matrix[first + t, column] = shift - r[t] with r = -A e; the shift makes a singular A invertible."""
    matrix[(first + t) * unknowns + column] = shift - r[place(t, nx, pitch)]


@lines
def eliminate(
    t: int,
    matrix: Field,
    pivot: int,
    unknowns: int,
    # outputs
    out: Field,
):
    """Row t of the matrix after the elimination of a pivot; after all pivots the matrix is its inverse."""
    row = t * unknowns
    top = pivot * unknowns
    d = matrix[top + pivot]
    if d <= Real(0.0):
        for c in range(unknowns):
            out[row + c] = matrix[row + c]
    elif t == pivot:
        for c in range(unknowns):
            out[row + c] = matrix[row + c] / d
        out[row + pivot] = Real(1.0) / d
    else:
        f = matrix[row + pivot] / d
        for c in range(unknowns):
            out[row + c] = matrix[row + c] - f * matrix[top + c]
        out[row + pivot] = -f


@lines
def collect(
    t: int,
    f: Field,
    first: int,
    nx: int,
    pitch: int,
    # outputs
    dense: Field,
):
    """dense[first + t] = unknown t of the component f."""
    dense[first + t] = f[place(t, nx, pitch)]


@lines
def multiply(
    t: int,
    inverse: Field,
    dense: Field,
    first: int,
    unknowns: int,
    nx: int,
    pitch: int,
    # outputs
    x: Field,
):
    """x[t] = sum over c of inverse[first + t, c] dense[c]: one component of x = inverse b."""
    total = Real(0.0)
    row = (first + t) * unknowns
    for c in range(unknowns):
        total += inverse[row + c] * dense[c]
    x[place(t, nx, pitch)] = total
