"""Ghost cells against NumPy's padding."""

import numpy as np
import pytest
from wfluid.kernels.cell.layout import HALO, Layout

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import field, from_numpy
from wfluid.fields.ghosts import Ghosts, ghost_table


def padded_axis(values, rule, axis):
    """The same continuation by np.pad."""
    pad = [(0, 0), (0, 0)]
    pad[axis] = (HALO, HALO)
    if rule is Rule.PERIODIC:
        return np.pad(values, pad, mode="wrap")
    if rule is Rule.EVEN:
        return np.pad(values, pad, mode="symmetric")
    if rule is Rule.ODD:
        return np.pad(values, pad, mode="symmetric", reflect_type="odd") - 2 * edge(values, pad)
    values = np.moveaxis(values.copy(), axis, 0)
    values[0] = 0
    beyond = np.concatenate([-values[2:0:-1], values, 0 * values[:1], -values[:-2:-1]])
    return np.moveaxis(beyond, 0, axis)


def edge(values, pad):
    """The value np.pad reflects about with reflect_type="odd", in the padding only."""
    inner = np.pad(np.zeros_like(values), pad, mode="constant", constant_values=1)
    return np.pad(values, pad, mode="edge") * inner


@pytest.mark.parametrize("rule_y", list(Rule))
@pytest.mark.parametrize("rule_x", list(Rule))
def test_ghosts_continue_a_field_by_its_rules(device, rule_x, rule_y):
    layout = Layout(7, 5)
    values = np.random.default_rng(0).standard_normal((5, 7)).astype(np.float32)
    f = field(layout, device)
    from_numpy(values, f, layout)
    Ghosts(layout, (rule_x, rule_y), device).fill(f)
    rows = layout.size // layout.pitch
    got = f.numpy()[: rows * layout.pitch].reshape(rows, layout.pitch)[: 5 + 2 * HALO, : 7 + 2 * HALO]
    expected = padded_axis(padded_axis(values, rule_x, 1), rule_y, 0)
    np.testing.assert_allclose(got, expected, atol=1e-6)


@pytest.mark.parametrize("rule", list(Rule))
@pytest.mark.parametrize("n", [1, 2, 3, 4, 9])
def test_sources_lie_inside_on_any_axis(rule, n):
    """Coarse levels have axes of one or two cells; their ghosts still have a source."""
    source, sign = ghost_table(n, rule)
    assert len(source) == n + 2 * HALO
    assert np.all((source >= 0) & (source < n))
    assert np.all(np.isin(sign, (-1, 0, 1)))
    inner = slice(HALO + (rule is Rule.FACE), HALO + n)
    assert np.all(source[inner] == np.arange(n)[int(rule is Rule.FACE) :])
    assert np.all(sign[inner] == 1)
