"""The adjoint of forces and sources (`step/forces`, `step/sources`): gradients with respect to Gaussians.

A Gaussian g of centre c and radius sigma adds a polynomial of r = (x - c) / sigma times g to a field. The
derivatives with respect to c, sigma and the strengths have the same form. With f_bar the gradient with
respect to the field, they are linear combinations of the moments

    M_ab = sum over the points of  f_bar r_x^a r_y^b g        a + b <= 4

(`wfluid/step/gaussians`), which are summed along rows first. On periodic axes r_x^a g_x is the sum over all
images, which is r_x^a g_x of the profile plus its excess (`step/forces`).
"""

import warp as wp
from wfluid.kernels.cell.layout import index
from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells, adjoint_lines
from wfluid.kernels.cell.real import Field, Indices, Real, Uniform
from wfluid.kernels.solve.sums import LANES, Lane, total_of_lanes
from wfluid.kernels.step.differences import mean_f
from wfluid.kernels.step.forces import images_beside, in_profile

ORDERS = wp.constant(5)
"""Number of powers of r: 0 … 4."""

MOMENTS = wp.constant(15)
"""Number of pairs of powers a, b with a + b <= 4, in the order of a, then b."""


@adjoint_lines
def row_moments(
    t: int,
    f_bar: Field,
    r_x: Field,
    g_x: Field,
    excess_2: Field,
    excess_3: Field,
    excess_4: Field,
    radius: Field,
    period: Real,
    boxes: Indices,
    ny: int,
    pitch: int,
    pitch_x: int,
    # outputs
    sums: Field,
):
    """sums[t, a] = sum of f_bar r_x^a g_x over the box's columns, of row t % ny and Gaussian t // ny.

    `period` is the length of a periodic axis, 0 between walls.
    """
    n = t // ny
    j = t - n * ny
    first = boxes[4 * n]
    end = boxes[4 * n + 1]
    if boxes[4 * n + 2] <= j and j < boxes[4 * n + 3]:
        sum0 = Lane()
        sum1 = Lane()
        sum2 = Lane()
        sum3 = Lane()
        sum4 = Lane()
        row = index(0, j, pitch)
        table = in_profile(n, 0, pitch_x)
        lanes_end = (end - first) // LANES * LANES + first
        for i in range(first, lanes_end, LANES):
            for lane in range(LANES):
                r = r_x[table + i + lane]
                value = f_bar[row + i + lane] * g_x[table + i + lane]
                sum0[lane] += value
                sum1[lane] += value * r
                sum2[lane] += value * r * r
                sum3[lane] += value * r * r * r
                sum4[lane] += value * r * r * r * r
        for i in range(lanes_end, end):
            r = r_x[table + i]
            value = f_bar[row + i] * g_x[table + i]
            sum0[0] += value
            sum1[0] += value * r
            sum2[0] += value * r * r
            sum3[0] += value * r * r * r
            sum4[0] += value * r * r * r * r
        if images_beside(radius[n], period) > 0:
            for i in range(first, end):
                value = f_bar[row + i]
                sum2[0] += value * excess_2[table + i]
                sum3[0] += value * excess_3[table + i]
                sum4[0] += value * excess_4[table + i]
        entry_0 = ORDERS * t
        sums[entry_0] = total_of_lanes(sum0)
        sums[entry_0 + 1] = total_of_lanes(sum1)
        sums[entry_0 + 2] = total_of_lanes(sum2)
        sums[entry_0 + 3] = total_of_lanes(sum3)
        sums[entry_0 + 4] = total_of_lanes(sum4)


@adjoint_lines
def moments(
    t: int,
    sums: Field,
    r_y: Field,
    g_y: Field,
    excess_2: Field,
    excess_3: Field,
    excess_4: Field,
    radius: Field,
    period: Real,
    boxes: Indices,
    ny: int,
    pitch_y: int,
    # outputs
    out: Field,
):
    """out[t, m] = sum of sums r_y^b g_y over the box's rows: moment m = (a, b) of Gaussian t.

    `period` is the length of a periodic axis, 0 between walls.
    """
    entry_0 = MOMENTS * t
    for m in range(MOMENTS):
        out[entry_0 + m] = Real(0.0)
    for j in range(boxes[4 * t + 2], boxes[4 * t + 3]):
        y = in_profile(t, j, pitch_y)
        row = ORDERS * (t * ny + j)
        m = entry_0
        for a in range(ORDERS):
            value = sums[row + a] * g_y[y]
            for _b in range(ORDERS - a):
                out[m] = out[m] + value
                value = value * r_y[y]
                m = m + 1
        if images_beside(radius[t], period) > 0:
            for a in range(ORDERS - 2):
                m = entry_0 + a * ORDERS - a * (a - 1) // 2
                out[m + 2] = out[m + 2] + sums[row + a] * excess_2[y]
                if a < 2:
                    out[m + 3] = out[m + 3] + sums[row + a] * excess_3[y]
                if a < 1:
                    out[m + 4] = out[m + 4] + sums[row + a] * excess_4[y]


@adjoint_cells
def lift_adjoint(
    i: int,
    j: int,
    k: int,
    u_bar: Field,
    impulse: Uniform,
    before: int,
    nx: int,
    # outputs
    rho_bar: Field,
):
    """rho_bar += impulse (u_bar[k] + u_bar[k + before]) / 2 at centre k: the transpose of `lift`, in place.

    Ghosts of rho_bar stay as they are.
    """
    k = inside(k)
    both = u_bar[k] + u_bar[inside(k + before)]
    rho_bar[k] = rho_bar[k] + wp.where(i < nx, impulse * Real(0.5) * both, Real(0.0))


@adjoint_cells
def mean_with_before(
    i: int,
    j: int,
    k: int,
    rho: Field,
    before: int,
    # outputs
    out: Field,
):
    """out = (rho[k - before] + rho[k]) / 2 on face k, which `lift` multiplies by its impulse."""
    k = inside(k)
    out[k] = mean_f(rho, k, before)


@adjoint_cells
def weighted(
    i: int,
    j: int,
    k: int,
    f_bar: Field,
    weight: Field,
    before: int,
    # outputs
    out: Field,
):
    """out = (weight[k - before] + weight[k]) / 2 f_bar on face k: the transpose of `push_weighted`.

    With `before` = 0 it is weight f_bar at centre k.
    """
    k = inside(k)
    out[k] = mean_f(weight, k, before) * f_bar[k]


@adjoint_cells
def effort_added(
    i: int,
    j: int,
    k: int,
    f_bar: Field,
    pushed: Field,
    f: Field,
    factor: Real,
    # outputs
    out: Field,
):
    """out = f_bar + factor (pushed - f): adds the gradient of factor |pushed - f|^2 / 2, the effort of
    forces.
    """
    k = inside(k)
    out[k] = f_bar[k] + factor * (pushed[k] - f[k])
