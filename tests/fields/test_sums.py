"""Sums over cells: ghosts do not count, whatever is in them."""

import numpy as np
import pytest
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.real import Real

from wfluid.fields.arrays import assign, from_numpy, read, vector, zeros
from wfluid.fields.sums import InnerProduct

EPS = float(np.finfo(np.dtype(Real.__name__)).eps)


@pytest.mark.parametrize("size", [(5, 4), (64, 3), (77, 9)], ids=str)
def test_products_means_and_norms_are_those_of_the_cells(device, size):
    layout, rng = Layout(*size), np.random.default_rng(2)
    values = rng.standard_normal((4, layout.ny, layout.nx)).astype(Real.__name__)
    fields = vector(layout, device, 4)
    for f, of_cells in zip(fields, values, strict=True):
        assign(np.full(layout.size, 7.0), f)
        from_numpy(of_cells, f, layout)
    x, y, inner, out = fields[:2], fields[2:], InnerProduct(layout, device, 2), zeros(1, device)
    tolerance = 8 * EPS * values[0].size
    inner.dot(x, y, out)
    exact = values.astype(float)
    assert read(out)[0] == pytest.approx(np.sum(exact[:2] * exact[2:]), abs=tolerance)
    assert inner.total() == pytest.approx(np.sum(exact[:2] * exact[2:]), abs=tolerance)
    inner.mean(x[0], out)
    assert read(out)[0] == pytest.approx(exact[0].mean(), abs=8 * EPS)
    assert inner.norm(x) == pytest.approx(np.sqrt(np.sum(exact[:2] ** 2)), rel=64 * EPS)
    for f, of_cells in zip(fields, values, strict=True):
        assert inner.largest(f) == np.abs(of_cells).max()
