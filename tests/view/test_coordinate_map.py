"""Sources at any place: interpolated inside, continued beyond the edges by the boundary conditions."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from viscous_media import centres

from wfluid import GaussianForce, Grid, Wall, Walls
from wfluid.view.coordinate_map import CoordinateMap

GRID = Grid(23, 18, 1.0, 0.7)

WALLS = ("free-slip", "no-slip", "periodic", "no-slip,periodic", "periodic,free-slip")


def map_of(displacement, grid=GRID, walls="free-slip"):
    """The map of a function of x and y that returns both components of the displacement."""
    values = np.stack([np.broadcast_to(d, (grid.ny, grid.nx)) for d in displacement(*centres(grid))], axis=2)
    return CoordinateMap(grid, Walls.parse(walls), values)


def inner(count=200, cells=2.0, seed=0):
    """Random places at a distance from the edges."""
    room = cells * np.array([GRID.hx, GRID.hy])
    return np.random.default_rng(seed).uniform(room, np.array([GRID.width, GRID.height]) - room, (count, 2))


def smooth(walls):
    """A displacement that meets the boundary conditions: along free-slip walls it has no normal slope."""
    along_x, along_y = (np.cos if wall is Wall.FREE_SLIP else np.sin for wall in (walls.x, walls.y))

    def displacement(x, y):
        a, b = 2 * np.pi * x / GRID.width, 2 * np.pi * y / GRID.height
        return 0.05 * np.sin(a) * along_y(b), -0.03 * along_x(2 * a) * np.sin(b)

    return displacement


@pytest.mark.parametrize("walls", WALLS)
def test_the_interpolated_map_equals_the_map_at_centres(walls):
    """source_at(centre) = source_of[centre], up to the edge."""
    warp = map_of(lambda x, y: (0.1 * x * y, 0.2 * x - y * y), walls=walls)
    x, y = centres(GRID)
    places = np.stack(np.broadcast_arrays(x, y), axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(warp.source_at(places), warp.source_of.reshape(-1, 2), rtol=0, atol=1e-13)


def test_a_quadratic_displacement_is_interpolated_exactly():
    """Catmull-Rom reproduces polynomials up to the second degree, along x and along y."""

    def displacement(x, y):
        return 0.1 - 0.3 * x + 0.2 * y + x * x - 2 * y * y + x * y, 0.4 * y - 0.5 * x * x + y * y * x * x

    places = inner()
    got = map_of(displacement).source_at(places) - places
    np.testing.assert_allclose(got, np.stack(displacement(*places.T), axis=1), rtol=0, atol=1e-13)


@pytest.mark.parametrize("walls", WALLS)
def test_a_smooth_displacement_is_interpolated_to_third_order(walls):
    """The error of the interpolation falls at least with h^3, beyond the last centres too."""
    displacement, errors = smooth(Walls.parse(walls)), []
    places = np.random.default_rng(1).uniform((0, 0), (GRID.width, GRID.height), (400, 2))
    for factor in (1, 2, 4):
        grid = Grid(factor * GRID.nx, factor * GRID.ny, GRID.width, GRID.height)
        got = map_of(displacement, grid, walls).source_at(places) - places
        errors.append(np.abs(got - np.stack(displacement(*places.T), axis=1)).max())
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes.min() > 2.8, slopes


def test_it_agrees_with_bilinear_interpolation_to_second_order():
    """The oracle: SciPy's map_coordinates of order 1, from which a smooth map differs by O(h^2)."""
    places, differences = inner(), []
    for factor in (1, 2, 4):
        grid = Grid(factor * GRID.nx, factor * GRID.ny, GRID.width, GRID.height)
        warp = map_of(smooth(Walls()), grid)
        at = (places / (grid.hx, grid.hy) - 0.5).T[::-1]
        expected = [map_coordinates(warp.displacement[..., n], at, order=1) for n in (0, 1)]
        differences.append(np.abs(warp.source_at(places) - places - np.stack(expected, axis=1)).max())
    slopes = np.log2(np.divide(differences[:-1], differences[1:]))
    assert np.all((slopes > 1.7) & (slopes < 2.3)), slopes


def test_a_periodic_map_is_equal_on_opposite_edges():
    """Places on opposite edges of a periodic axis have the same displacement, also for noise."""
    noise = np.random.default_rng(2).normal(0, 0.1, (GRID.ny, GRID.nx, 2))
    warp = CoordinateMap(GRID, Walls.parse("periodic"), noise)
    for n, size in enumerate((GRID.width, GRID.height)):
        here = inner(50)
        here[:, n] = 0.0
        there = here.copy()
        there[:, n] = size
        np.testing.assert_allclose(warp.source_at(here) - here, warp.source_at(there) - there, atol=1e-13)
    for shift in (1, -2):
        moved = CoordinateMap(GRID, warp.walls, np.roll(noise, (shift, 3 * shift), (0, 1)))
        places = inner(50, cells=7)
        by = shift * np.array([3 * GRID.hx, GRID.hy])
        np.testing.assert_allclose(
            warp.source_at(places) - places, moved.source_at(places + by) - places - by, atol=1e-12
        )


@pytest.mark.parametrize("walls", ["free-slip", "no-slip"])
def test_sources_do_not_cross_a_wall(walls):
    """On a wall the normal component is 0; the tangential one is free, or 0 on a no-slip wall."""
    noise = np.random.default_rng(3).normal(0, 0.1, (GRID.ny, GRID.nx, 2))
    warp = CoordinateMap(GRID, Walls.parse(walls), noise)
    for n, size in enumerate((GRID.width, GRID.height)):
        for edge in (0.0, size):
            places = inner(50)
            places[:, n] = edge
            moved = warp.source_at(places) - places
            assert np.abs(moved[:, n]).max() < 1e-13
            if walls == "no-slip":
                assert np.abs(moved).max() < 1e-13
            else:
                assert np.abs(moved[:, 1 - n]).max() > 0.01
    corners = np.array([(0.0, 0.0), (GRID.width, 0.0), (0.0, GRID.height), (GRID.width, GRID.height)])
    np.testing.assert_allclose(warp.source_at(corners), corners, atol=1e-13)


def test_a_displacement_along_a_free_slip_wall_has_no_slope():
    """Beside a free-slip wall a constant tangential displacement is interpolated exactly, up to the wall."""
    warp = map_of(lambda x, y: (0.05 + 0 * x * y, 0 * x * y))
    places = inner(50, cells=3)
    places[:, 1] = np.linspace(0, GRID.height, 50)
    expected = places + np.array([0.05, 0.0])
    np.testing.assert_allclose(warp.source_at(places), expected, rtol=0, atol=1e-13)


def test_the_map_of_a_run_leads_from_points_back_to_their_start(make_solver):
    """source_at(position of p) = p along a run, at the tracked positions, not only at centres."""
    points = np.random.default_rng(4).uniform(0.25, 0.75, (40, 2)) * (1, 0.9)
    solver = make_solver(64, 64, viscosity=0.01)
    now, then = solver.rest(points), solver.rest(points)
    force = GaussianForce((0.5, 0.45), (3.0, 1.5), 0.15)
    for step in range(24):
        solver.step(now, then, [force], step / 96, 1 / 96)
        now, then = then, now
    moved = np.linalg.norm(now.points - points, axis=1)
    assert moved.max() > 0.02
    missed = CoordinateMap.of_state(now, solver.fluid.walls).source_at(now.points) - points
    assert np.abs(missed).max() < 2e-3 * moved.max()
