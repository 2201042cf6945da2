"""Differences and means of neighbours on the staggered grid: gradient G, divergence D, Laplacian L = D G.

A suffix says where the value lives: `_x` on the x-face k, between centres k - 1 and k; `_y` on the y-face k,
between k - pitch and k; `_f` on either of them, by its stride `before` = 1 or pitch; `_c` at the centre k;
`_n` at the top left node of cell k. Applied to values on faces, `gradient_x` and `gradient_y` give a value
at centre k - 1 or k - pitch if the faces are across the difference, else at the top left node of cell k.
Second order. Walls are in the ghosts, so that G = -D^T.

Coefficients beta live on faces: L becomes D beta G.
"""

import warp as wp
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.real import Field, Real


@wp.func
def mean_f(c: Field, k: int, before: int):
    """(c[k - before] + c[k]) / 2: on face k if c is at centres, at centre k - before if c is on faces."""
    return Real(0.5) * (c[inside(k - before)] + c[k])


@wp.func
def slope_f(q: Field, k: int, before: int, over_h: Real):
    """dq/ds on face k."""
    return over_h * (q[k] - q[inside(k - before)])


@wp.func
def gradient_x(q: Field, k: int, over_hx: Real):
    """dq/dx on x-face k."""
    return over_hx * (q[k] - q[k - 1])


@wp.func
def gradient_y(q: Field, k: int, pitch: int, over_hy: Real):
    """dq/dy on y-face k."""
    return slope_f(q, k, pitch, over_hy)


@wp.func
def divergence_c(u: Field, v: Field, k: int, pitch: int, over_hx: Real, over_hy: Real):
    """du/dx + dv/dy at centre k."""
    south = inside(k + pitch)
    return gradient_x(u, k + 1, over_hx) + gradient_y(v, south, pitch, over_hy)


@wp.func
def laplacian_c(q: Field, k: int, pitch: int, ax: Real, ay: Real):
    """D G q at centre k; a = 1 / h^2 is taken out of both differences."""
    south = inside(k + pitch)
    one = Real(1.0)
    along_x = gradient_x(q, k + 1, one) - gradient_x(q, k, one)
    along_y = gradient_y(q, south, pitch, one) - gradient_y(q, k, pitch, one)
    return ax * along_x + ay * along_y


@wp.func
def laplacian_beta_c(q: Field, beta_x: Field, beta_y: Field, k: int, pitch: int, ax: Real, ay: Real):
    """D beta G q at centre k, beta on the faces; a = 1 / h^2 is taken out of both differences."""
    south = inside(k + pitch)
    along_x = gradient_x(q, k + 1, beta_x[k + 1]) - gradient_x(q, k, beta_x[k])
    along_y = gradient_y(q, south, pitch, beta_y[south]) - gradient_y(q, k, pitch, beta_y[k])
    return ax * along_x + ay * along_y
