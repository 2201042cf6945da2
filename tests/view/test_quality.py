"""The measures of a map, against maps whose measures are known and against NumPy."""

import math

import numpy as np
import pytest
from viscous_media import centres

from wfluid import Grid
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import measure_map

GRID = Grid(40, 30, 1.0, 0.75)


def measured(make_solver, displacement):
    """The measures of a displacement (x, y) -> (d_x, d_y) under periodic walls."""
    solver = make_solver(40, 30, grid=GRID, walls="periodic")
    state, (x, y) = solver.rest(), centres(GRID)
    moved = np.stack([np.broadcast_to(d, (30, 40)) for d in displacement(x, y)], axis=2)
    solver.set_map(state, moved)
    return measure_map(state, CoordinateMap.of_state(state, solver.fluid.walls)), moved


def jacobians(moved):
    """The Jacobian of a periodic displacement at every cell, by central differences: (ny, nx, 2, 2)."""
    slopes = [(np.roll(moved, -1, axis) - np.roll(moved, 1, axis)) * 20 for axis in (1, 0)]
    return np.eye(2) + np.stack(slopes, axis=-1)


def wavy(x, y, amount=0.06):
    """A displacement that also changes areas; it folds from an amount of about 0.1 on."""
    a, b = 2 * np.pi * x, 2 * np.pi * y / 0.75
    return amount * np.sin(2 * a) * np.cos(b), -amount * np.cos(a) * np.sin(2 * b)


@pytest.mark.parametrize("amount", [0.0, 0.02, 0.06, 0.2])
def test_strain_is_that_of_the_singular_values(make_solver, amount):
    quality, moved = measured(make_solver, lambda x, y: wavy(x, y, amount))
    strains = np.abs(np.log(np.linalg.svd(jacobians(moved), compute_uv=False))).max(axis=-1)
    expected = np.sort(strains, axis=None)[math.ceil(0.99 * strains.size) - 1]
    assert quality.log_strain == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert amount == 0 or expected > 0.1


@pytest.mark.parametrize("amount", [0.02, 0.2])
def test_the_folded_cells_are_counted_and_the_worst_is_found(make_solver, amount):
    quality, moved = measured(make_solver, lambda x, y: wavy(x, y, amount))
    dets = np.linalg.det(jacobians(moved))
    assert quality.jacobian_min == pytest.approx(dets.min(), abs=1e-4)
    assert quality.fold_fraction == pytest.approx((dets <= 0).mean(), abs=1e-3)
    assert (quality.fold_fraction > 0) == (amount > 0.1)
    column, row = (np.array(quality.jacobian_min_at) * 40 - 0.5).round().astype(int)
    assert dets[row, column] == pytest.approx(dets.min(), abs=1e-4)
