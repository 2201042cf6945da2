"""Densities are carried, poured, spread; points of the picture are followed."""

import numpy as np
import pytest
from oracles import from_streamfunction

from wfluid.domain.envelopes import Constant, Instantaneous
from wfluid.domain.grid import Grid
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Path
from wfluid.fields.arrays import to_numpy
from wfluid.model.densities import Density, PaintedSource, Source
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.model.uniform_forces import Buoyancy

GRID = Grid(40, 30, 1.0, 0.71)


def centres(grid):
    return (np.arange(grid.nx) + 0.5) * grid.hx, (np.arange(grid.ny)[:, None] + 0.5) * grid.hy


def blob(grid, center, radius):
    x, y = centres(grid)
    return np.exp(-((x - center[0]) ** 2 + (y - center[1]) ** 2) / (2 * radius**2))


def run(solver, forces, steps, dt, points=(), start=None):
    now, after = solver.rest(points), solver.rest(points)
    if start:
        solver.set_velocity(now, *start)
    for step in range(steps):
        solver.step(now, after, forces, step * dt, dt)
        now, after = after, now
    return now


@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic"])
@pytest.mark.parametrize(("kappa", "dt"), [(1e-4, 0.1), (0.02, 0.1), (1.0, 1.0)])
def test_diffusion_conserves_mass_to_rounding(make_solver, walls, kappa, dt):
    """By few sweeps and by cycles, which stop long before the solution: the sum is kept all the same."""
    values = np.random.default_rng(0).random((30, 40))
    density = Density(diffusion=kappa, initial=Painted(values))
    solver = make_solver(40, 30, grid=GRID, walls=walls, densities=[density])
    state = run(solver, [], 5, dt)
    assert state.densities[0].sum() == pytest.approx(values.sum(), rel=2e-6)
    assert np.ptp(state.densities[0]) < np.ptp(values)


@pytest.mark.float64
@pytest.mark.parametrize("kappa", [1e-4, 0.02])
def test_diffusion_conserves_mass_to_rounding_in_double(make_solver, kappa):
    values = np.random.default_rng(0).random((30, 40))
    density = Density(diffusion=kappa, initial=Painted(values))
    state = run(make_solver(40, 30, grid=GRID, densities=[density]), [], 5, 0.1)
    assert state.densities[0].sum() == pytest.approx(values.sum(), rel=1e-13)


def test_a_gaussian_spreads_as_the_root_of_two_kappa_t(make_solver):
    """Its variance along either axis grows by 2 kappa t, exactly so for central differences and any dt."""
    grid, kappa = Grid(96, 96, 1.0, 1.0), 2e-3
    start = blob(grid, (0.5, 0.45), 0.04)
    density = Density(diffusion=kappa, initial=Painted(start))
    solver = make_solver(96, 96, grid=grid, densities=[density], diffusion_tolerance=1e-5)
    rho = run(solver, [], 6, 0.15).densities[0]
    for axis, x in enumerate(centres(grid)):

        def variance(values, x=x):
            mean = (values * x).sum() / values.sum()
            return (values * (x - mean) ** 2).sum() / values.sum()

        assert variance(rho) - variance(start) == pytest.approx(2 * kappa * 0.9, rel=2e-3), axis


@pytest.mark.parametrize(
    ("kappa", "dt", "method"),
    [(1e-3, 1 / 96, "chebyshev"), (1e-2, 1 / 96, "chebyshev"), (1e-2, 1 / 24, "multigrid")],
)
def test_a_gaussian_spreads_so_at_the_usual_tolerance(make_solver, kappa, dt, method):
    """The tolerance leaves no error of one sign in every step: not in the smoothest change."""
    grid, steps = Grid(96, 96, 1.0, 1.0), 12
    start = blob(grid, (0.5, 0.45), 0.04)
    solver = make_solver(96, 96, grid=grid, densities=[Density(diffusion=kappa, initial=Painted(start))])
    rho = run(solver, [], steps, dt).densities[0]
    assert solver._step.densities[0].plan(dt).name == method
    for axis, x in enumerate(centres(grid)):
        grown = sum(
            sign * ((f * x**2).sum() / f.sum() - ((f * x).sum() / f.sum()) ** 2)
            for sign, f in ((1, rho), (-1, start))
        )
        assert grown == pytest.approx(2 * kappa * steps * dt, rel=5e-4), axis


def test_transport_has_the_order_of_its_interpolation(make_solver):
    """A wave goes once round a periodic picture at one CFL number.

    Cubic at n points over n steps: third order but at the limited crests; second order at the least.
    """
    errors = []
    for n in (32, 64, 128):
        grid = Grid(n, n, 1.0, 1.0)
        x, y = centres(grid)
        wave = 1 + 0.5 * np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y)
        density = Density(initial=Painted(wave))
        solver = make_solver(n, n, grid=grid, walls="periodic", viscosity=0.0, densities=[density])
        uniform = np.full((n, n + 1), 1.0), np.full((n + 1, n), 0.5)
        rho = run(solver, [], 3 * n, 2 / (3 * n), start=uniform).densities[0]
        errors.append(np.abs(rho - wave).mean())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.9), (errors, orders)


def test_advection_keeps_a_density_within_its_initial_range(make_solver):
    """A box in a strong vortex: the cubic alone would ring to below nothing and above all."""
    box = np.zeros((64, 64))
    box[20:40, 25:50] = 1.0
    grid = Grid(64, 64, 1.0, 1.0)
    solver = make_solver(64, 64, grid=grid, viscosity=0.0, densities=[Density(initial=Painted(box))])
    push = GaussianForce((0.5, 0.5), (6.0, 3.0), 0.1, Constant(0, 0.2))
    rho = run(solver, [push], 40, 0.02).densities[0]
    assert rho.min() >= 0 and rho.max() <= 1
    assert np.abs(rho - box).max() > 0.9  # it did move


def test_a_density_travels_with_the_picture(make_solver):
    """Without diffusion and sources rho(x, t) = rho(source_of(x), 0): map and density on one flow."""
    grid = Grid(128, 128, 1.0, 1.0)
    solver = make_solver(
        128, 128, grid=grid, densities=[Density(initial=Painted(blob(grid, (0.45, 0.5), 0.1)))]
    )
    state = run(solver, [GaussianForce((0.5, 0.5), (3.0, 1.0), 0.1, Constant(0, 0.3))], 60, 1 / 96)
    x, y = centres(grid)
    d_x, d_y = state.displacement
    expected = np.exp(-((x + d_x - 0.45) ** 2 + (y + d_y - 0.5) ** 2) / (2 * 0.1**2))
    assert np.hypot(d_x, d_y).max() > 0.05
    np.testing.assert_allclose(state.densities[0], expected, atol=5e-3)


@pytest.mark.parametrize("walls", ["free-slip", "periodic"])
def test_sources_pour_their_formula(make_solver, walls):
    """In a still fluid rho = rate g times the integral of the envelope, about a center that moves."""
    wave = Oscillator(period=0.4, phase=0.1, centred=False)
    path = Path((0.0, 0.2), ((0.2, 0.3), (0.4, 0.3)))
    paint = np.random.default_rng(3).random((30, 40))
    sources = [
        Source((0.5, 0.35), 2.0, 0.06, wave),
        Source(path, 3.0, 0.03, Constant(0.0, 0.1)),
        Source((0.3, 0.5), 0.5, 0.05, Instantaneous(0.05)),
        PaintedSource(Painted(paint), Constant(0.05, 1.0)),
    ]
    solver = make_solver(40, 30, grid=GRID, walls=walls, densities=[Density(sources=sources)])
    rho = run(solver, [], 1, 0.1).densities[0]

    def around(center, radius):  # with the images beyond a seam
        shifts = [(0, 0)]
        if walls == "periodic":
            shifts = [(a * GRID.width, b * GRID.height) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        x, y = centres(GRID)
        squares = [(x - center[0] - a) ** 2 + (y - center[1] - b) ** 2 for a, b in shifts]
        return np.exp(-np.min(squares, axis=0) / (2 * radius**2))

    expected = 2.0 * wave.integral(0, 0.1) * around((0.5, 0.35), 0.06)
    expected = expected + 0.3 * around((0.25, 0.3), 0.03) + 0.5 * around((0.3, 0.5), 0.05)
    np.testing.assert_allclose(rho, expected + 0.05 * paint, atol=1e-6)


def test_buoyancy_is_the_density_times_its_vector(make_solver):
    """On the faces the mean of the two centres; of the density that is named, and upwards by default."""
    values = np.random.default_rng(1).random((30, 40))
    densities = [Density("ink"), Density("smoke", initial=Painted(values))]
    solver = make_solver(40, 30, grid=GRID, densities=densities)
    solver.step(solver.rest(), solver.rest(), [Buoyancy("smoke", (0.3, -2.0), Constant(0, 0.05))], 0.0, 0.1)
    u, v = (to_numpy(f, solver.layout) for f in solver._step.pushed)
    np.testing.assert_allclose(u[:, 1:], 0.015 * (values[:, 1:] + values[:, :-1]) / 2, atol=1e-7)
    np.testing.assert_allclose(v[1:], -0.1 * (values[1:] + values[:-1]) / 2, atol=1e-7)
    plume = Density("smoke", sources=[Source((0.5, 0.6), 5.0, 0.05)])
    solver = make_solver(40, 30, grid=GRID, densities=[plume])
    rho = run(solver, [Buoyancy("smoke", (0.0, -4.0))], 50, 0.02).densities[0]
    _, y = centres(GRID)
    assert (rho * y).sum() / rho.sum() < 0.5  # it has risen from 0.6
    with pytest.raises(ValueError, match="'fog': expected one of the fluid's"):
        run(solver, [Buoyancy("fog")], 1, 0.1)


def vortex(grid):
    """A steady flow of the ideal fluid in a closed box: psi = sin sin / pi, speeds up to 1."""

    def psi(x, y):
        return np.sin(np.pi * x / grid.width) * np.sin(np.pi * y / grid.height) / np.pi

    return from_streamfunction(grid, psi)


def test_source_of_undoes_goes_to(make_solver):
    """A followed point p stands where the map says that p's colour is: source_of(goes_to(p)) = p."""
    grid = Grid(128, 96, 1.0, 0.75)
    solver = make_solver(128, 96, grid=grid)
    points = np.random.default_rng(4).uniform((0.1, 0.1), (0.9, 0.65), (50, 2))
    force = GaussianForce((0.5, 0.4), (3.0, -1.0), 0.1, Constant(0, 0.3))
    state = run(solver, [force], 60, 1 / 96, points)
    now = state.points
    assert np.abs(now - points).max() > 0.05
    from scipy.ndimage import map_coordinates

    at = [now[:, 1] / grid.hy - 0.5, now[:, 0] / grid.hx - 0.5]
    back = now + np.stack([map_coordinates(d, at, order=3) for d in state.displacement], axis=1)
    np.testing.assert_allclose(back, points, atol=0.03 * grid.hx)


def test_points_follow_the_flow_to_second_order(make_solver):
    """On a steady vortex a point comes back after its time of circulation, whose period SciPy finds."""
    from scipy.integrate import solve_ivp

    def rate(_, p):
        return np.sin(np.pi * p[0]) * np.cos(np.pi * p[1]), -np.cos(np.pi * p[0]) * np.sin(np.pi * p[1])

    end = solve_ivp(rate, (0, 1.5), (0.3, 0.4), rtol=1e-9, atol=1e-9).y[:, -1]
    errors = []
    for steps in (15, 30, 60):
        grid = Grid(128, 128, 1.0, 1.0)
        solver = make_solver(128, 128, grid=grid, viscosity=0.0)
        state, out = solver.rest([(0.3, 0.4)]), solver.rest([(0.3, 0.4)])
        for _ in range(steps):
            solver.set_velocity(state, *vortex(grid))
            solver.step(state, out, [], 0.0, 1.5 / steps)
            state, out = out, state
        errors.append(np.abs(state.points[0] - end).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.8), (errors, orders)


def test_points_stay_inside_walls_and_are_not_wrapped_at_a_seam(make_solver):
    closed = make_solver(32, 32, viscosity=0.0, stretch=1)
    push = GaussianForce((0.9, 0.5), (50.0, 0.0), 0.2)
    state = run(closed, [push], 10, 0.1, [(0.95, 0.5), (0.02, 0.98)])
    assert np.all((state.points >= 0) & (state.points <= 1))
    wrapped = make_solver(32, 32, viscosity=0.0, stretch=1, walls="periodic")
    uniform = np.full((32, 33), 1.0), np.zeros((33, 32))
    state = run(wrapped, [], 10, 0.15, [(0.95, 0.5)], start=uniform)
    np.testing.assert_allclose(state.points, [(2.45, 0.5)], atol=1e-4)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Density(""), "needs a name"),
        (lambda: Density(diffusion=-1), "diffusion -1: expected 0"),
        (lambda: Density(look="oil"), "expected one of ink, smoke"),
        (lambda: Density(color=(2, 0, 0)), "three numbers 0 … 1"),
        (lambda: Source((0.1, 0.1), 1e9, 0.1), "the limit is 1e\\+06/s"),
        (lambda: Source((0.1, 0.1), np.nan, 0.1), "Source.rate is nan"),
        (lambda: Source((0.1, 0.1), 1.0, 0.0), "Source.radius 0.0: expected 1e-06"),
    ],
)
def test_impossible_densities_are_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()


def test_two_densities_of_one_name_and_foreign_states_are_refused(make_solver):
    with pytest.raises(ValueError, match="two have one name"):
        make_solver(8, 8, densities=[Density(), Density()])
    one, two = make_solver(8, 8, densities=[Density()]), make_solver(8, 8)
    with pytest.raises(ValueError, match="0 densities and 0 points: expected 1 and 0"):
        one.step(two.rest(), one.rest(), [], 0.0, 0.1)
    with pytest.raises(ValueError, match="expected x, y within the picture"):
        one.rest([(0.5, 1.5)])
