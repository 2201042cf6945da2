"""What variable viscosity and drag do to a flow: known flows, rigidity, freezing, what moves or changes."""

import numpy as np
import pytest
from oracles import divergence, noise_velocity, strain_rate
from viscous_media import MEDIA, WALLS, centres, coupled, disc, media, random_vector

from wfluid import Freeze, GaussianForce, Instantaneous, Keyed, Painted
from wfluid.domain.grid import Grid
from wfluid.fields.arrays import from_numpy, to_numpy, vector
from wfluid.step.inertial import InertialStep


def steady(make_solver, ny, force_rows):
    """u(y) between no-slip plates, mu = exp(2 y), periodic along x, pulled by a force per row."""
    grid = Grid(8, ny, 0.1, 0.8)
    mu = np.exp(2 * centres(grid)[1]) + np.zeros((ny, 8))
    solver = make_solver(8, ny, grid=grid, viscosity=mu, walls="periodic,no-slip", diffusion_tolerance=1e-12)
    a, b = solver.rest(), solver.rest()
    u = np.zeros((ny, 9))
    for _ in range(12):
        solver.set_velocity(a, u + 10 * force_rows(grid)[:, None], np.zeros((ny + 1, 8)))
        solver.diffuse(a, b, 10.0)
        u = b.velocity[0]
    np.testing.assert_allclose(u, u[:, :1] + 0 * u, atol=1e-9 * np.abs(u).max())
    return grid, u[:, 0]


def slope(errors):
    """Order of convergence of errors on grids that double."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.float64
def test_poiseuille_flow_with_varying_viscosity(make_solver):
    """(mu u')' = -1, mu = exp(2 y): u = C (1 - e^-2y) / 2 - 1/4 + e^-2y (y/2 + 1/4); second order."""
    errors = []
    for ny in (16, 32, 64):
        grid, u = steady(make_solver, ny, lambda grid: np.ones(grid.ny))
        y, h = centres(grid)[1][:, 0], grid.height
        particular = lambda y: 0.25 - np.exp(-2 * y) * (y / 2 + 0.25)  # noqa: E731
        constant = 2 * particular(h) / (1 - np.exp(-2 * h))
        exact = constant * (1 - np.exp(-2 * y)) / 2 - particular(y)
        errors.append(np.abs(u - exact).max() / exact.max())
    assert errors[-1] < 1e-3
    assert np.all(np.abs(slope(errors) - 2) < 0.1), f"orders {slope(errors)}, errors {errors}"


@pytest.mark.float64
def test_couette_flow_with_varying_viscosity(make_solver):
    """Between a plate and a sheet pulled along: constant stress, mu u' = C, on both sides; second order."""
    errors = []
    for ny in (32, 64, 128):
        row = ny // 2

        def sheet(grid, row=row):
            force = np.zeros(grid.ny)
            force[row] = 1 / grid.hy
            return force

        grid, u = steady(make_solver, ny, sheet)
        y, h = centres(grid)[1][:, 0], grid.height
        rise = lambda y: (1 - np.exp(-2 * y)) / 2  # noqa: E731  integral of 1 / mu
        below = 1 - rise(y[row]) / rise(h)  # stress below; below + above = 1
        exact = np.where(y <= y[row], below * rise(y), (1 - below) * (rise(h) - rise(y)))
        errors.append(np.abs(u - exact).max() / exact.max())
    assert errors[-1] < 1e-3
    assert np.all(np.abs(slope(errors) - 2) < 0.1), f"orders {slope(errors)}, errors {errors}"


@pytest.mark.float64
def test_rigid_rotation_and_translation_feel_no_viscous_force(device):
    """Whatever mu: A v = v where v is a translation or a rotation (the transposed gradient's work)."""
    grid = Grid(24, 20, 1.0, 0.7)
    diffusion = coupled(grid, *media(grid)["noise"], "free-slip", device)
    system, layout = diffusion.system, diffusion.layout
    y_u, x_v = (np.arange(grid.ny) + 0.5) * grid.hy, (np.arange(grid.nx) + 0.5) * grid.hx
    for turning in (0.0, 3.0):
        v, r = vector(layout, device, 2), vector(layout, device, 2)
        from_numpy(1.0 - turning * y_u[:, None] + np.zeros((grid.ny, grid.nx)), v[0], layout)
        from_numpy(2.0 + turning * x_v + np.zeros((grid.ny, grid.nx)), v[1], layout)
        system.levels[0].residual(v, v, r)  # v - A v
        for component in r:
            assert np.abs(to_numpy(component, layout)[2:-2, 2:-2]).max() < 1e-11
    from_numpy(y_u[:, None] ** 2 + np.zeros((grid.ny, grid.nx)), v[0], layout)
    system.levels[0].residual(v, v, r)
    assert np.abs(to_numpy(r[0], layout)[2:-2, 2:-2]).max() > 1e-3  # a shear does feel one


@pytest.mark.float64
def test_manufactured_solution_is_met_to_second_order_in_both_components(make_solver):
    """(v - dt div (mu (grad v + grad v^T))) = b for smooth mu(x, y), u and v on a periodic square."""
    dt, w = 0.3, 2 * np.pi
    sin, cos = np.sin, np.cos

    def u(x, y):
        return sin(w * x) * cos(2 * w * y)

    def v(x, y):
        return cos(2 * w * x) * sin(w * y)

    def viscosity(x, y):
        return 0.05 * (1 + 0.5 * sin(w * x) * cos(w * y))

    def right(x, y):
        """b at any point, both components."""
        mu = viscosity(x, y)
        mu_x, mu_y = 0.025 * w * cos(w * x) * cos(w * y), -0.025 * w * sin(w * x) * sin(w * y)
        u_x, u_y = w * cos(w * x) * cos(2 * w * y), -2 * w * sin(w * x) * sin(2 * w * y)
        v_x, v_y = -2 * w * sin(2 * w * x) * sin(w * y), w * cos(2 * w * x) * cos(w * y)
        u_xx, u_yy = -(w**2) * u(x, y), -4 * w**2 * u(x, y)
        v_xx, v_yy = -4 * w**2 * v(x, y), -(w**2) * v(x, y)
        u_xy = -2 * w**2 * cos(w * x) * sin(2 * w * y)
        v_xy = -2 * w**2 * sin(2 * w * x) * cos(w * y)
        shear = u_y + v_x
        on_u = 2 * mu_x * u_x + 2 * mu * u_xx + mu_y * shear + mu * (u_yy + v_xy)
        on_v = 2 * mu_y * v_y + 2 * mu * v_yy + mu_x * shear + mu * (u_xy + v_xx)
        return u(x, y) - dt * on_u, v(x, y) - dt * on_v

    errors = []
    for n in (16, 32, 64):
        face, centre = np.arange(n + 1) / n, (np.arange(n) + 0.5) / n
        on_u, on_v = (face, centre[:, None]), (centre, face[:, None])
        mu = viscosity(centre, centre[:, None])
        solver = make_solver(n, n, stretch=1.0, viscosity=mu, walls="periodic", diffusion_tolerance=1e-10)
        a, b = solver.rest(), solver.rest()
        solver.set_velocity(a, right(*on_u)[0], right(*on_v)[1])
        solver.diffuse(a, b, dt)
        errors.append([np.abs(b.velocity[0] - u(*on_u)).max(), np.abs(b.velocity[1] - v(*on_v)).max()])
    orders = slope(errors)
    assert np.max(errors[-1]) < 5e-3
    assert np.all(np.abs(orders - 2) < 0.1), f"orders {orders}, errors {errors}"


@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", MEDIA)
def test_energy_never_grows(device, name, walls):
    """||v'|| <= ||v|| for any medium, walls and method: viscosity and drag only take."""
    grid = Grid(37, 29, 1.0, 0.7)
    for settings in ({}, {"solver": "jacobi", "sweeps": 5}):
        diffusion = coupled(grid, *media(grid)[name], walls, device, **settings)
        velocity, layout = random_vector(diffusion, 4), diffusion.layout
        diffusion.diffuse(velocity)
        before, after = (
            sum(np.sum(to_numpy(f, layout).astype(float) ** 2) for f in v) for v in (velocity, diffusion.out)
        )
        assert after < before


def pushed(make_solver, grid, steps, dt, **fluid):
    """The state after a force beside the middle has pushed for some steps, and its strain [1/s]."""
    solver = make_solver(grid.nx, grid.ny, grid=grid, **fluid)
    force = GaussianForce((0.5, 0.22), (2.0, 0.7), 0.08)
    a, b = solver.rest(), solver.rest()
    for step in range(steps):
        solver.step(a, b, [force], step * dt, dt)
        a, b = b, a
    return solver, a, strain_rate(grid, *a.velocity)


def test_strain_in_a_stiff_disc_falls_with_the_step(make_solver):
    """Splitting leaks strain into a stiff region, less with every shorter step.

    Without the pressure of the step before, 0.24 of the unstiffened strain leaked at 1/24 s and 0.07 at
    1/96 s; with it 0.022 and 0.004.
    """
    grid = Grid(64, 64)
    inside = disc(grid, radius=0.15)[1:-1, 1:-1]
    free = pushed(make_solver, grid, 6, 1 / 24, viscosity=0.001)[2][inside].mean()
    stiff = np.where(disc(grid, radius=0.2), 10.0, 0.001)
    leaks = {
        per_second: pushed(make_solver, grid, per_second // 4, 1 / per_second, viscosity=stiff)[2][
            inside
        ].mean()
        / free
        for per_second in (24, 96)
    }
    assert leaks[24] < 0.04 and leaks[96] < 0.5 * leaks[24], leaks


def test_freezing_slows_by_its_strength_and_stops_at_full_strength(make_solver):
    """Displacement in the frozen disc falls with every degree of paint, to less than 1/100 of that around."""
    grid = Grid(64, 64)
    inside = disc(grid, 0.5, 0.22, 0.06)
    around = disc(grid, 0.5, 0.22, 0.2) & ~disc(grid, 0.5, 0.22, 0.13)
    moved = []
    for degree in (0.0, 0.25, 0.5, 0.75, 1.0):
        mask = degree * disc(grid, 0.5, 0.22, 0.1)
        _, state, _ = pushed(make_solver, grid, 24, 1 / 48, viscosity=0.001, freeze=Freeze(mask))
        d = np.hypot(*state.displacement)
        moved.append(d[inside].mean())
        assert (
            np.abs(divergence(grid, *state.velocity)).max() < 0.02 * np.abs(state.velocity[0]).max() / grid.hx
        )
    assert np.all(np.diff(moved) < 0), moved
    assert moved[-1] < 0.01 * d[around].mean(), (moved, d[around].mean())
    assert moved[0] > 0.02


def test_a_viscosity_that_moves_goes_with_the_picture(make_solver):
    """A uniform wind by whole cells on a periodic grid: mu is rolled; unless told to, it stays."""
    rng = np.random.default_rng(0)
    mu = 0.01 * rng.random((32, 32))
    for moves in (True, False):
        solver = make_solver(32, 32, stretch=1.0, viscosity=mu, viscosity_moves=moves, walls="periodic")
        a, b = solver.rest(), solver.rest()
        solver.set_velocity(a, np.full((32, 33), 1.0), np.full((33, 32), -0.5))
        for _ in range(5):  # two cells right and one up a step
            solver.step(a, b, [], 0.0, 2 / 32)
            a, b = b, a
        solver.step(a, b, [], 0.0, 2 / 32)
        got = to_numpy(solver._step.coefficients.levels[0].mu, solver.layout)
        expected = np.roll(mu, (-5, 10), (0, 1)) if moves else mu
        np.testing.assert_allclose(got, expected, atol=2e-5 * 0.01 + 1e-7)


def test_a_step_uses_the_viscosity_at_its_time(make_solver):
    """Keyed and function: the step that ends at t has the viscosity of t."""
    soft, stiff = np.full((16, 16), 0.001), np.full((16, 16), 0.1)
    for viscosity in (Keyed({1.0: stiff, 0.0: soft}), lambda t: 0.001 + 0.099 * min(max(t, 0.0), 1.0)):
        solver = make_solver(16, 16, viscosity=viscosity)
        a, b = solver.rest(), solver.rest()
        for t, expected in ((0.0, 0.02575), (0.25, 0.0505), (0.75, 0.1), (2.0, 0.1)):
            solver.step(a, b, [], t, 0.25)
            got = to_numpy(solver._step.coefficients.levels[0].mu, solver.layout)
            np.testing.assert_allclose(got, expected, rtol=1e-6)


def test_a_viscosity_function_of_constant_value_gives_the_flow_of_a_painted_one(make_solver, monkeypatch):
    """What is replayed for a viscosity of the time is what was set up for a still one.

    But for the pressure kept from step to step, which only a still one may keep.
    """
    monkeypatch.setattr(InertialStep, "pressure_part", lambda self, *last: 0.0)
    mu = np.random.default_rng(1).random((24, 32)) * 0.05
    force = GaussianForce((0.5, 0.4), (1.0, 0.5), 0.1)
    ends = []
    for viscosity in (mu, lambda t: mu * (1 + 1e-9 * t)):
        solver = make_solver(32, 24, viscosity=viscosity)
        a, b = solver.rest(), solver.rest()
        for step in range(6):
            solver.step(a, b, [force], step / 24, 1 / 24)
            a, b = b, a
        ends.append(a.velocity[0])
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-5 * np.abs(ends[0]).max())


def energy(state):
    return sum(float(np.mean(f.astype(float) ** 2)) for f in state.velocity)


@pytest.mark.parametrize("fluid", ["stiff", "frozen", "moves", "no-slip"])
def test_a_free_flow_loses_energy_over_many_steps(make_solver, fluid):
    """With whatever pressure is kept from step to step: no force, so no gain, for any medium and step."""
    patches = np.kron(np.random.default_rng(2).random((8, 8)).round(), np.ones((4, 4)))
    settings = {
        "stiff": {"viscosity": Painted(patches, 10.0, floor=1e-4)},
        "frozen": {"viscosity": 1e-3, "freeze": Freeze(patches)},
        "moves": {"viscosity": Painted(patches, 10.0, floor=1e-4), "viscosity_moves": True},
        "no-slip": {"viscosity": 1e-3, "walls": "no-slip"},
    }[fluid]
    for dt in (1 / 24, 0.2):
        solver = make_solver(32, 32, stretch=1.0, **settings)
        a, b = solver.rest(), solver.rest()
        solver.set_velocity(a, *noise_velocity(solver))
        solver.project(a, b, dt)
        a, b = b, a
        energies = [energy(a)]
        for step in range(60):
            solver.step(a, b, [], step * dt, dt)
            a, b = b, a
            energies.append(energy(a))
        ratios = np.array(energies[1:]) / np.array(energies[:-1])
        assert ratios.max() < 1.02 and energies[-1] < 0.1 * energies[0], (dt, ratios.max())


@pytest.mark.parametrize("first", [1e-39, 1e-12, 1e-4, 1 / 480, 1 / 96, 1.0])
def test_a_change_of_step_length_adds_no_energy(make_solver, first):
    """The pressure of a blow, or of a short step, is not that of the next one of 1/24 s."""
    half = np.kron(np.array([[0.0, 1.0]]), np.ones((32, 16)))
    blow = GaussianForce((0.5, 0.5), (5.0, 0.3), 0.05, Instantaneous(0.0))
    for fluid in (
        {"viscosity": Painted(half, 1.0, floor=1e-3)},
        {"freeze": Freeze(half)},
        {"walls": "no-slip"},
    ):
        solver = make_solver(32, 32, stretch=1.0, **fluid)
        a, b = solver.rest(), solver.rest()
        solver.step(a, b, [blow], 0.0, first)
        energies = [energy(b)]
        a, b = b, a
        for step in range(5):
            solver.step(a, b, [], 1 + step / 24, 1 / 24)
            a, b = b, a
            energies.append(energy(a))
        assert max(energies[1:]) < energies[0] and energies[-1] < 0.75 * energies[0], (fluid, energies)


def test_a_fluid_set_to_rest_stays_at_rest(make_solver):
    """No pressure is left over from before."""
    solver = make_solver(24, 24, walls="no-slip")
    a, b = solver.rest(), solver.rest()
    solver.step(a, b, [GaussianForce((0.5, 0.5), (5.0, 0.3), 0.1)], 0.0, 0.1)
    solver.set_velocity(b, np.zeros((24, 25)), np.zeros((25, 24)))
    solver.step(b, a, [], 0.1, 0.1)
    assert energy(a) == 0


def test_a_viscosity_at_the_limit_is_accepted_on_any_grid(make_solver):
    """Resampling rounds; what was within the range stays within."""
    solver = make_solver(24, 24, viscosity=np.full((100, 77), 1000.0))
    a, b = solver.rest(), solver.rest()
    solver.step(a, b, [], 0.0, 0.1)


def test_a_refused_viscosity_is_refused_again(make_solver):
    """A step refused for its viscosity leaves nothing half done."""
    solver = make_solver(24, 24, viscosity=lambda t: -1.0 if t > 0.5 else 0.1)
    a, b = solver.rest(), solver.rest()
    solver.step(a, b, [], 0.0, 0.1)
    for _ in range(2):
        with pytest.raises(ValueError, match=r"viscosity at 1\.1 s -1\.0"):
            solver.step(a, b, [], 1.0, 0.1)
