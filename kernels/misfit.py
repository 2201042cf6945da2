"""Misfits of fields, 1/2 sum w (f - target)^2, with their gradients w (f - target)."""

from wfluid.kernels.cells import Field, Real, adjoint_cells, adjoint_lines, inside


@adjoint_cells
def misfit(
    i: int,
    j: int,
    k: int,
    f: Field,
    target: Field,
    weight: Field,
    # outputs
    left: Field,
    weighted: Field,
):
    """What is left of f at point k, and that times its weight."""
    k = inside(k)
    left[k] = f[k] - target[k]
    weighted[k] = weight[k] * (f[k] - target[k])


@adjoint_lines
def row_squares(
    t: int,
    f: Field,
    target: Field,
    nx: int,
    pitch: int,
    first: int,
    # outputs
    rows: Field,
):
    """Entry first + t: the sum of (f - target)^2 over row t."""
    at = (t + 2) * pitch + 2
    total = Real(0.0)
    for i in range(nx):
        left = f[at + i] - target[at + i]
        total += left * left
    rows[first + t] = total
