"""Misfits of fields, 1/2 sum w (f - target)^2, with their gradients w (f - target)."""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import entry, inside
from wfluid.kernels.cell.program import adjoint_cells, adjoint_lines
from wfluid.kernels.cell.real import Field, Real
from wfluid.kernels.view.lookup import Pixel, Pixels


@adjoint_cells
def weigh_misfit(
    i: int,
    j: int,
    k: int,
    shown: Pixels,
    target: Pixels,
    weight: Field,
    # outputs
    shown_bar: Pixels,
):
    """The gradient of half the weighted squares of shown - target with respect to pixel k."""
    k = inside(k)
    shown_bar[k] = weight[k] * (shown[k] - target[k])


@adjoint_lines
def row_misfits(
    t: int,
    shown: Pixels,
    target: Pixels,
    weight: Field,
    nx: int,
    pitch: int,
    first: int,
    # outputs
    rows: Field,
):
    """Entry first + t: the sum of weight |shown - target|^2 over row t of the pixels, all four channels."""
    at = index(0, t, pitch)
    total = Pixel()
    for i in range(nx):
        left = shown[entry(at + i)] - target[entry(at + i)]
        total += weight[entry(at + i)] * wp.cw_mul(left, left)
    rows[first + t] = total[0] + total[1] + total[2] + total[3]


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
    at = index(0, t, pitch)
    total = Real(0.0)
    for i in range(nx):
        left = f[at + i] - target[at + i]
        total += left * left
    rows[first + t] = total
