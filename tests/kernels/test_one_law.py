"""Laws written in several places agree: Catmull-Rom weights, and the operators made of differences."""

import numpy as np
import pytest
from wfluid.kernels.adjoint import scatter
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.program import cells
from wfluid.kernels.cell.real import Field, Real, Uniform
from wfluid.kernels.solve import five_point
from wfluid.kernels.step import projection
from wfluid.kernels.step.differences import laplacian_c
from wfluid.kernels.step.interpolation import cubic_slopes, cubic_weights
from wfluid.kernels.view import lookup

from wfluid.domain.piecewise import catmull_rom
from wfluid.fields.arrays import Scalars, assign, fill, from_numpy, read, to_numpy, upload, vector, zeros

EPS = float(np.finfo(np.dtype(Real.__name__)).eps)
FRACTIONS = np.linspace(0.0, 1.0, 33)


def weigh(i: int, j: int, k: int, part: Field, slopes: int, w0: Field, w1: Field, w2: Field, w3: Field):
    w = cubic_weights(part[k])
    if slopes == 1:
        w = cubic_slopes(part[k])
    w0[k] = w[0]
    w1[k] = w[1]
    w2[k] = w[2]
    w3[k] = w[3]


def curve(i: int, j: int, k: int, q: Field, ax: Uniform, ay: Uniform, pitch: int, out: Field):
    out[k] = laplacian_c(q, k, pitch, ax, ay)


weigh = cells(weigh, module="tests.one_law")
curve = cells(curve, module="tests.one_law")


def on_device(device, slopes):
    """The device's weights, or their slopes, at `FRACTIONS`: (4, 33)."""
    layout = Layout(len(FRACTIONS), 1)
    t, *found = vector(layout, device, 5)
    from_numpy(FRACTIONS[None], t, layout)
    weigh.launch(layout, device, [t, slopes], found)
    return np.stack([to_numpy(f, layout)[0] for f in found])


def test_host_and_device_have_the_same_cubic(device):
    np.testing.assert_allclose(on_device(device, 0), catmull_rom(FRACTIONS), rtol=0, atol=2 * EPS)


def test_weights_of_a_cubic_keep_a_parabola():
    """Catmull and Rom's cubic is exact for 1, t and t^2."""
    points = np.arange(-1, 3)[:, None]
    for power in range(3):
        got = np.sum(catmull_rom(FRACTIONS) * points**power, axis=0)
        np.testing.assert_allclose(got, FRACTIONS**power, rtol=0, atol=1e-15)


def test_slopes_of_the_cubic_are_its_derivatives(device):
    step = 1e-6
    derivatives = (catmull_rom(FRACTIONS + step) - catmull_rom(FRACTIONS - step)) / (2 * step)
    np.testing.assert_allclose(on_device(device, 1), derivatives, rtol=0, atol=8 * EPS + 1e-9)


@pytest.mark.parametrize("t", [0.0, 0.3, 0.85])
def test_scatter_has_the_same_cubic_in_c(device, t):
    """One cell of 1 leaves the weights themselves around the place that it was read at."""
    layout, tx, ty = Layout(9, 9), t, 0.6
    x, y, bar, out = vector(layout, device, 4)
    at = np.full(layout.size, layout.first)  # of the other cells, whose gradient is 0
    k = layout.first + 4 * layout.pitch + 4
    at[k] = k
    values = np.zeros((9, 9))
    for f, value in ((x, tx), (y, ty), (bar, 1.0)):
        values[4, 4] = value
        from_numpy(values, f, layout)
    inputs = [upload(at, device, int), x, y, bar, layout.nx, layout.pitch]
    scatter.scatter_cubic.launch(layout, device, inputs, [out], turn=0)
    expected = np.outer(catmull_rom(np.array(ty)), catmull_rom(np.array(tx)))
    np.testing.assert_allclose(to_numpy(out, layout)[3:7, 3:7], expected, rtol=0, atol=4 * EPS)


@pytest.mark.parametrize("place", [4, 0], ids=["inside", "at the edge"])
def test_the_look_up_has_the_same_cubic_in_c(device, place):
    """A picture of columns 0, 1, 2 … cubed: what a pixel shows, inside (in C) and at the edge."""
    layout, size = Layout(len(FRACTIONS), 1), 10
    columns = np.arange(size, dtype=float) ** 3
    picture = np.repeat(np.broadcast_to(columns, (size, size))[..., None], 4, axis=2)
    x, y = vector(layout, device, 2)
    from_numpy(place + FRACTIONS[None], x, layout)
    fill(4.0, y)
    shown = zeros(layout.size, device, lookup.Pixel)
    inputs = [upload(picture.reshape(-1, 4), device, lookup.Pixel), x, y, size, size, 0, 0]
    lookup.look_up_cubic.launch(layout, device, inputs, [shown])
    before = place + np.floor(FRACTIONS).astype(int)
    around = np.clip(before + np.arange(-1, 3)[:, None], 0, size - 1)
    expected = np.sum(catmull_rom(FRACTIONS % 1.0) * columns[around], axis=0)
    got = read(shown)[layout.first : layout.first + layout.nx, 0]
    np.testing.assert_allclose(got, expected, rtol=0, atol=8 * EPS * columns.max())


def test_the_laplacian_is_the_divergence_of_the_gradient(device):
    """D G, `laplacian_c` and the five-point operator are one, to rounding, on noise with ghosts."""
    layout, rng = Layout(23, 11), np.random.default_rng(1)
    q, zero, out, lap, u, v = vector(layout, device, 6)
    noise = rng.standard_normal(layout.size)
    assign(noise, q)
    h = Scalars(device, x=3.0, y=2.0, xx=9.0, yy=4.0, centre=2 * 9.0 + 2 * 4.0)
    pitch = layout.pitch
    wide = Layout(layout.nx + 1, layout.ny + 1)
    assert wide.pitch == pitch
    projection.subtract_gradient.launch(wide, device, [zero, zero, q, h.x, h.y, pitch], [u, v])
    projection.minus_divergence.launch(layout, device, [u, v, h.x, h.y, pitch], [out])
    curve.launch(layout, device, [q, h.xx, h.yy, pitch], [lap])
    dg = to_numpy(out, layout)  # -D (0 - G q)
    size = 64 * EPS * np.abs(dg).max()
    np.testing.assert_allclose(to_numpy(lap, layout), dg, rtol=0, atol=size)
    five_point.residual.launch(layout, device, [zero, q, h.centre, h.xx, h.yy, pitch], [out])
    np.testing.assert_allclose(to_numpy(out, layout), dg, rtol=0, atol=size)
    ones = vector(layout, device, 2)
    fill(1.0, *ones)
    five_point.residual_beta.launch(layout, device, [zero, q, *ones, h.xx, h.yy, pitch], [out])
    np.testing.assert_allclose(to_numpy(out, layout), dg, rtol=0, atol=size)
