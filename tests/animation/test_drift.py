"""Maps are composed, flows of velocities are groups, and logarithms invert them."""

import numpy as np
import pytest
from viscous_media import centres

from wfluid.animation.drift import Maps
from wfluid.domain.grid import Grid

GRID = Grid(64, 48, 1.0, 0.75)


@pytest.fixture
def maps(make_solver):
    return Maps(make_solver(64, 48, grid=GRID))


def eddy(amount, width=0.15):
    """The velocity of an eddy in the middle, without divergence."""
    x, y = centres(GRID)
    bell = amount * np.exp(-((x - 0.5) ** 2 + (y - 0.375) ** 2) / (2 * width**2)) / width
    return np.stack([-(y - 0.375) * bell, (x - 0.5) * bell], axis=2).astype(np.float32)


def longest(displacement):
    return np.hypot(*np.moveaxis(displacement, 2, 0)).max()


def determinants(displacement):
    along_y, along_x = np.gradient(displacement, GRID.hy, GRID.hx, axis=(0, 1))
    return (1 + along_x[..., 0]) * (1 + along_y[..., 1]) - along_x[..., 1] * along_y[..., 0]


def test_a_composition_is_one_map_after_the_other(maps):
    """Against the interpolated sources of the outer map."""
    from wfluid.view.coordinate_map import CoordinateMap

    outer, inner = eddy(0.05), eddy(-0.1, 0.1)[:, ::-1]
    found = maps.composed(outer, inner)
    there = CoordinateMap(GRID, maps.walls, inner).source_of.reshape(-1, 2)
    expected = CoordinateMap(GRID, maps.walls, outer).source_at(there)
    here = np.stack(np.meshgrid(*(a.ravel() for a in centres(GRID))), axis=2)
    np.testing.assert_allclose(found, expected.reshape(found.shape) - here, atol=1e-6)


def test_a_flow_turns_an_eddy_by_its_angle(maps):
    """In the middle the angle is amount / width, here 1 rad: subtracting displacements would fold."""
    flow = maps.flow(eddy(0.15))
    x, y = centres(GRID)
    ring = np.hypot(x - 0.5, y - 0.375) < 0.03
    offset = np.stack(np.broadcast_arrays(x - 0.5, y - 0.375), axis=2)
    after = offset + flow
    angle = np.arctan2(
        offset[..., 0] * after[..., 1] - offset[..., 1] * after[..., 0], (offset * after).sum(axis=2)
    )
    np.testing.assert_allclose(angle[ring], 1.0, atol=0.03)
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(after, 2, 0))[ring], np.hypot(x - 0.5, y - 0.375)[ring], rtol=0.02
    )


@pytest.mark.parametrize("amount", [0.05, 0.15, 0.2])
def test_the_logarithm_of_a_flow_undoes_it_by_parts_without_folds(maps, amount):
    flow = maps.flow(eddy(amount))
    velocity, left = maps.logarithm(flow)
    assert longest(left) < 0.01 * longest(flow)
    for part in np.linspace(0, 1, 5):
        undone = maps.composed(maps.flow(-part * velocity), flow)
        assert abs(determinants(undone) - 1).max() < 0.1
    assert longest(undone) < 0.01 * longest(flow)


def test_a_place_is_found_for_a_source(maps):
    flow, sources = maps.flow(eddy(0.15)), np.array([[0.45, 0.3], [0.6, 0.4], [0.1, 0.1]])
    from wfluid.view.coordinate_map import CoordinateMap

    places = maps.places(flow, sources, sources)
    assert np.abs(places - sources).max() > 0.03
    np.testing.assert_allclose(CoordinateMap(GRID, maps.walls, flow).source_at(places), sources, atol=1e-5)
