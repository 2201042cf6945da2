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
    """shown_bar = weight (shown - target) at pixel k: the gradient of 1/2 sum weight |shown - target|^2."""
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
    """rows[first + t] = the sum of weight |shown - target|^2 over row t of the pixels, all four channels."""
    row = index(0, t, pitch)
    total = Pixel()
    for i in range(nx):
        residual = shown[entry(row + i)] - target[entry(row + i)]
        total += weight[entry(row + i)] * wp.cw_mul(residual, residual)
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
    residual: Field,
    weighted: Field,
):
    """residual = f - target and weighted = weight (f - target) at point k."""
    k = inside(k)
    residual[k] = f[k] - target[k]
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
    """rows[first + t] = the sum of (f - target)^2 over row t."""
    row = index(0, t, pitch)
    total = Real(0.0)
    for i in range(nx):
        residual = f[row + i] - target[row + i]
        total += residual * residual
    rows[first + t] = total
