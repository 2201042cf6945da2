"""Forces have their shape and impulse, follow their paths, and move the picture by their arrows."""

import math

import numpy as np
import pytest
from oracles import divergence

from wfluid.domain.envelopes import Arbitrary, Constant, Fade, Instantaneous
from wfluid.domain.grid import Grid
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Path
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import to_numpy
from wfluid.model.densities import Density, Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Group, flatten
from wfluid.model.gaussian_forces import GaussianForce, Growth, VortexForce
from wfluid.model.noise_force import NoiseForce
from wfluid.model.painted import Painted
from wfluid.model.stroke import Stroke
from wfluid.model.uniform_forces import Wind
from wfluid.scene.short_forms import parse_force
from wfluid.staging.drawing import Drawing
from wfluid.step.forcing import Forcing

STRETCHED = Grid(40, 30, 1.0, 0.71)
"""hx != hy, and 40 is no multiple of a span."""


def places(grid):
    """x, y of the first nx x-faces and ny y-faces: two pairs of arrays that broadcast to (ny, nx)."""
    x, y = np.arange(grid.nx) * grid.hx, np.arange(grid.ny)[:, None] * grid.hy
    return (x, y + grid.hy / 2), (x + grid.hx / 2, y)


def images(grid, periodic, x, y, center, reach=12):
    """The vectors from a center, or from each of its images in a lattice up to `reach` periods away."""
    shifts = range(-reach, reach + 1) if periodic else (0,)
    for n in shifts:
        for m in shifts:
            yield x - center[0] - n * grid.width, y - center[1] - m * grid.height


def pushed(make_solver, forces, t=0.0, dt=0.01, grid=STRETCHED, **fluid):
    """The velocity that forces add to u and v on the first faces, in a step from rest."""
    solver = make_solver(grid.nx, grid.ny, grid=grid, **fluid)
    solver.step(solver.rest(), solver.rest(), forces, t, dt)
    return [to_numpy(f, solver.layout) for f in solver._step.pushed]


def assert_on_faces(got, expected, periodic, atol=2e-7):
    """Equal on all faces except those on closed walls, where the force is 0."""
    for n, (f, e) in enumerate(zip(got, expected, strict=True)):
        e = np.broadcast_to(e, f.shape).copy()
        if not periodic:
            e[(slice(None), 0) if n == 0 else 0] = 0
        np.testing.assert_allclose(f, e, atol=atol)


@pytest.mark.parametrize("walls", ["free-slip", "periodic"])
def test_a_gaussian_force_has_its_shape_on_the_faces(make_solver, walls):
    """dt vector exp(-r^2 / 2 sigma^2), seven of them, wide and small, inside and beyond the edges."""
    random, periodic = np.random.default_rng(2), walls == "periodic"
    forces = [
        GaussianForce(random.uniform(-0.1, 1.0, 2), random.uniform(-3, 3, 2), radius)
        for radius in (0.3, 0.06, 0.06, 0.02, 0.02, 0.01, 0.004)
    ]
    expected = [0.0, 0.0]
    for force in forces:
        for n, (x, y) in enumerate(places(STRETCHED)):
            for dx, dy in images(STRETCHED, periodic, x, y, force.center, reach=3):
                expected[n] = expected[n] + 0.01 * force.vector[n] * np.exp(
                    -(dx**2 + dy**2) / (2 * force.radius**2)
                )
    assert_on_faces(pushed(make_solver, forces, walls=walls), expected, periodic)


def vortex(center, radius, periodic, reach=12):
    """What a vortex of spin 4 adds in 0.01 s, on the first faces."""
    expected = [0.0, 0.0]
    for n, (x, y) in enumerate(places(STRETCHED)):
        for dx, dy in images(STRETCHED, periodic, x, y, center, reach):
            arm = (-dy, dx)[n]
            expected[n] = expected[n] + 0.01 * 4.0 * arm * np.exp(-(dx**2 + dy**2) / (2 * radius**2))
    return expected


@pytest.mark.parametrize("walls", ["free-slip", "periodic"])
def test_a_vortex_turns_about_its_center(make_solver, walls):
    """dt spin (-(y - c_y), x - c_x) exp(-r^2 / 2 sigma^2), clockwise on the screen for a positive spin."""
    periodic, c = walls == "periodic", (0.85, 0.6)
    expected = vortex(c, 0.07, periodic, reach=1)
    got = pushed(make_solver, [VortexForce(c, 4.0, 0.07)], walls=walls)
    assert_on_faces(got, expected, periodic)
    row, column = int(0.6 / STRETCHED.hy), int(0.92 / STRETCHED.hx)
    assert got[1][row, column] > 0  # to the right of the center the picture goes down


@pytest.mark.parametrize("radius", [0.09, 0.15, 0.4, 0.9, 1.2])
def test_all_images_of_a_vortex_count_on_periodic_axes(make_solver, radius):
    """Opposite its center the field is smooth: a vortex of radius 0.15 jumped by 83 % of its maximum there.

    The sum of a wide one's images cancels to less than rounding.
    """
    c = (0.35, 0.25)
    got = pushed(make_solver, [VortexForce(c, 4.0, radius)], walls="periodic")
    assert_on_faces(got, vortex(c, radius, True), True, atol=2e-7)
    if radius == 0.15:
        for f, axis in zip(got, (0, 1), strict=True):  # across the velocity it jumped
            slope = np.abs(np.diff(f, axis=axis, append=f.take([0], axis))).max()
            seam = np.abs(np.diff(f, n=2, axis=axis)).max()
            assert seam < 0.5 * slope, (seam, slope)


def test_images_that_add_up_beyond_the_limit_are_refused(make_solver):
    """A push of 1e4 for 1 s adds 1e4; the images of a radius of 4 add up to 10 and 14 times that by axis."""
    force = GaussianForce((0.5, 0.3), (1e4, 0.0), 4.0)
    pushed(make_solver, [force], dt=1.0)
    with pytest.raises(ValueError, match="the limit is"):
        pushed(make_solver, [force], dt=1.0, walls="periodic")


@pytest.mark.parametrize("walls", ["free-slip", "periodic", "periodic,free-slip"])
def test_all_images_of_a_source_and_of_a_growth_count(make_solver, walls):
    """A source gives rate g, a growth rate (1 - r^2 / 2) g less its mean, summed over all images."""
    source, growth = Source((0.12, 0.65), 2.0, 0.25), Growth((0.12, 0.65), 0.5, 0.25)
    solver = make_solver(40, 30, grid=STRETCHED, densities=[Density("ink", sources=[source])], walls=walls)
    state, after = solver.rest(), solver.rest()
    solver.step(state, after, [growth], 0.0, 0.01)
    (x, _), (_, y) = places(STRETCHED)
    x, y = x + STRETCHED.hx / 2, y + STRETCHED.hy / 2
    across, down = solver.fluid.walls.periodic
    ink, swelling = 0.0, 0.0
    for n in range(-4 * across, 4 * across + 1):
        for m in range(-4 * down, 4 * down + 1):
            square = ((x - 0.12 - n) ** 2 + (y - 0.65 - m * STRETCHED.height) ** 2) / 0.25**2
            ink = ink + 2.0 * 0.01 * np.exp(-square / 2)
            swelling = swelling + 0.5 * (1 - square / 2) * np.exp(-square / 2)
    np.testing.assert_allclose(to_numpy(after.rho[0], solver.layout), ink, atol=1e-8, rtol=1e-5)
    found = divergence(STRETCHED, *after.velocity)
    left = np.abs(found - (swelling - swelling.mean())).max()
    assert left < 2e-3 * np.abs(swelling).max(), left


def test_a_wind_is_uniform_within_the_walls(make_solver):
    expected = [np.full((30, 40), 0.003), np.full((30, 40), -0.002)]
    for walls in ("free-slip", "periodic"):
        got = pushed(make_solver, [Wind((0.3, -0.2))], walls=walls)
        assert_on_faces(got, expected, walls == "periodic")


def test_a_winds_fields_do_not_depend_on_its_vector():
    """Two directions, painted by the weight and closed at walls; their integrals are the impulse."""
    grid, walls = Grid(5, 4, 1.0, 0.8), Walls.parse("free-slip")
    ramp = np.arange(20.0).reshape(4, 5)
    gale, still = (Wind(vector, Constant(0.2, 1.3), Painted(ramp)) for vector in ((3.0, -4.0), (0.0, 0.0)))
    np.testing.assert_array_equal(gale.fields(grid, walls), still.fields(grid, walls))
    (x, none_y), (none_x, y) = gale.fields(grid, walls)
    assert not none_x.any() and not none_y.any() and not x[:, 0].any() and not y[0].any()
    np.testing.assert_allclose(x[:, 1:], (ramp[:, 1:] + ramp[:, :-1]) / 2)
    np.testing.assert_allclose(y[1:], (ramp[1:] + ramp[:-1]) / 2)
    assert gale.integrals(0.0, 1.0) == pytest.approx((2.4, -3.2))


@pytest.mark.parametrize("blow", [9.99, -9.99, 10.01])
def test_a_wind_beyond_the_limit_is_refused_with_its_velocity(device, blow):
    """The limit applies to the length of the vector, (6e3, 8e3) times the impulse: 1e5 longer sides/s."""
    wind = Wind((6e3, 8e3), blow * Instantaneous())
    fluid = Fluid(walls="periodic")
    impulses = Forcing([wind], fluid, Grid(5, 4), device)
    if abs(blow) < 10:
        impulses.set([wind], fluid, 0.0, 0.1, 0.1)
        return
    with pytest.raises(ValueError, match=r"a force over the picture would add a velocity of 100100 "):
        impulses.set([wind], fluid, 0.0, 0.1, 0.1)


@pytest.mark.parametrize("cut", [1, 4, 7])
def test_an_impulse_over_a_window_does_not_depend_on_the_steps(make_solver, cut):
    """Summed over its window, a force adds its vector times the integral of its envelope."""
    envelope = Oscillator(period=0.31, phase=0.1, centred=False, end=0.4)
    forces = [
        GaussianForce((0.5, 0.35), (0.8, -0.4), 0.05, envelope),
        VortexForce((0.2, 0.3), 3.0, 0.04, envelope),
    ]
    total = pushed(make_solver, forces, 0.0, 0.5)
    steps = [pushed(make_solver, forces, n * 0.5 / cut, 0.5 / cut) for n in range(cut)]
    for n in (0, 1):
        np.testing.assert_allclose(sum(step[n] for step in steps), total[n], atol=1e-6)
    assert np.abs(total[0]).max() == pytest.approx(0.8 * abs(envelope.integral(0, 0.5)), rel=0.05)


def test_a_moving_force_follows_its_path(make_solver):
    """The largest gain lies where the path is at the middle of the step; a function of time does the same."""
    path = Path((0.1, 0.3, 0.4), ((0.2, 0.2), (0.6, 0.5), (0.8, 0.2)))
    for center in (path, lambda t: path.at(t)):
        force = GaussianForce(center, (1.0, 0.0), 0.04)
        for t, place in ((0.0, (0.2, 0.2)), (0.195, (0.4, 0.35)), (0.345, (0.7, 0.35)), (0.9, (0.8, 0.2))):
            u = pushed(make_solver, [force], t, 0.01)[0]
            row, column = np.unravel_index(u.argmax(), u.shape)
            assert abs(column * STRETCHED.hx - place[0]) <= 0.51 * STRETCHED.hx, (t, column)
            assert abs((row + 0.5) * STRETCHED.hy - place[1]) <= 0.51 * STRETCHED.hy, (t, row)


def test_a_stroke_gives_its_strength_times_its_velocity():
    """A free particle on the path gains strength V; over a corner the pushes of both pieces add."""
    path = Path.along(((0.1, 0.3), (0.7, 0.3), (0.7, 0.5)), 0.2, 1.0)
    stroke = Stroke(path, 0.03, strength=0.5)
    assert path.times == pytest.approx((0.2, 0.8, 1.0))
    steps, gained = 960, np.zeros(2)
    for n in range(steps):
        blob = stroke.impulse(n / steps * 1.2, (n + 1) / steps * 1.2)
        distance = math.dist(blob.center, (0.4, 0.3))
        gained += np.array(blob.push) * math.exp(-(distance**2) / (2 * 0.03**2))
    np.testing.assert_allclose(gained, (0.5 * 1.0, 0.0), atol=5e-3)
    corner = stroke.impulse(0.78, 0.82).push
    assert corner[0] == pytest.approx(corner[1]) and corner[0] > 0
    assert stroke.impulse(0.0, 0.1).push == (0.0, 0.0) == stroke.impulse(1.0, 1.1).push


def test_groups_equal_the_sum_of_their_members(make_solver):
    """Members with the common envelope and strength, in nested groups too."""
    swing = Oscillator(period=0.7, centred=False)
    one = GaussianForce((0.3, 0.3), (1.0, 0.4), 0.05)
    two = VortexForce((0.6, 0.4), 3.0, 0.08, Constant(0.0, 0.3))
    noise = NoiseForce(strength=0.5, scale=0.3, seed=3)
    group = Group([one, Group([two, noise], strength=2.0)], swing, 0.5, "all")
    got = pushed(make_solver, [group], 0.1, 0.3)
    alone = [
        pushed(make_solver, [force], 0.1, 0.3)
        for force in (
            GaussianForce(one.center, (0.5, 0.2), 0.05, swing),
            VortexForce(two.center, 3.0, 0.08, Constant(0.0, 0.3) * swing),
            NoiseForce(strength=0.5, scale=0.3, seed=3, envelope=swing),
        )
    ]
    for n in (0, 1):
        np.testing.assert_allclose(got[n], sum(f[n] for f in alone), atol=3e-7)
    assert len(flatten([group, one])) == 4


@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic", "periodic,free-slip"])
@pytest.mark.parametrize("period", [None, 0.8])
def test_curl_noise_is_free_of_divergence(walls, period):
    """The discrete divergence of the force itself, walls included, is rounding."""
    walls = Walls.parse(walls)
    for fx, fy in NoiseForce(strength=3.0, scale=0.3, seed=5, period=period).fields(STRETCHED, walls):
        u = np.concatenate([fx, fx[:, :1] if walls.periodic[0] else 0 * fx[:, :1]], axis=1)
        v = np.concatenate([fy, fy[:1] if walls.periodic[1] else 0 * fy[:1]], axis=0)
        assert np.abs(divergence(STRETCHED, u, v)).max() < 1e-10
        assert np.sqrt((fx**2 + fy**2).mean()) > 1.0


def test_curl_noise_does_not_depend_on_the_grid_and_has_the_given_strength():
    """Halving the cells: the faces in common differ by O(h^2); far from walls the rms is the strength."""
    walls, noise = Walls.parse("periodic"), NoiseForce(strength=2.0, scale=0.25, seed=1)
    coarse, fine = (noise.fields(Grid(n, n), walls)[0][0] for n in (64, 192))
    np.testing.assert_allclose(coarse, fine[1::3, ::3], atol=0.05)
    assert np.sqrt(
        np.mean([np.square(f) for f in noise.fields(Grid(96, 96), walls)[0]]) * 2
    ) == pytest.approx(2, rel=0.1)
    other = NoiseForce(strength=2.0, scale=0.25, seed=2).fields(Grid(64, 64), walls)[0][0]
    assert abs(np.corrcoef(coarse.ravel(), other.ravel())[0, 1]) < 0.3


def test_changing_noise_repeats_after_its_period(make_solver):
    noise = NoiseForce(strength=1.0, scale=0.3, period=0.4)
    first, half, total = (pushed(make_solver, [noise], t, 0.01)[0] for t in (0.0, 0.2, 0.4))
    np.testing.assert_allclose(total, first, atol=1e-6)
    np.testing.assert_allclose(half, -first, atol=1e-6)


def run(solver, forces, steps, dt, points=()):
    now, after = solver.rest(points), solver.rest(points)
    for step in range(steps):
        solver.step(now, after, forces, step * dt, dt)
        now, after = after, now
    return now


@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic"])
def test_a_growth_prescribes_its_divergence(make_solver, walls):
    """After a step div v is rate (1 - r^2 / 2) exp(-r^2 / 2) minus its mean, as exactly as the projection."""
    grid = Grid(48, 40, 1.0, 0.79)
    solver = make_solver(48, 40, grid=grid, walls=walls, pressure_cycles=8)
    state = run(solver, [Growth((0.8, 0.3), 3.0, 0.11, Constant(0.0, 0.05))], 1, 0.1)
    x, y = (np.arange(48) + 0.5) * grid.hx, (np.arange(40)[:, None] + 0.5) * grid.hy
    expected = 0.0
    for dx, dy in images(grid, walls == "periodic", x, y, (0.8, 0.3), reach=1):
        r2 = (dx**2 + dy**2) / 0.11**2
        expected = expected + 1.5 * (1 - r2 / 2) * np.exp(-r2 / 2)  # half of the step: the mean over it
    got = divergence(grid, *state.velocity)
    # single precision leaves up to 6e-5 of the right-hand side
    np.testing.assert_allclose(got, expected - expected.mean(), atol=6e-5 * 1.5)
    report = solver.report()
    assert report.prescribed == pytest.approx(1.5)
    assert report.removed == pytest.approx(expected.mean(), abs=1e-6)
    assert report.divergence < 6e-5 * 1.5


@pytest.mark.parametrize("rate", [1.2, -1.2])
def test_areas_grow_by_the_integral_of_the_rate(make_solver, rate):
    """At the center, which stays: det of goes_to is exp(rate T), so that of source_of is its inverse."""
    solver = make_solver(128, 128, stretch=1, viscosity=0.0)
    growth = Growth((0.5, 0.5), rate, 0.12, Oscillator(period=0.5, phase=0.0, end=0.25, centred=False))
    steps = 48
    state = run(solver, [growth], steps, 0.5 / steps)  # the last half: all of it has come to act
    d_x, d_y = state.displacement
    h, middle = 1 / 128, slice(63, 65)
    slope = [np.gradient(d, h, axis=axis)[middle, middle].mean() for d, axis in ((d_x, 1), (d_y, 0))]
    area = 1 / ((1 + slope[0]) * (1 + slope[1]))
    assert math.log(area) == pytest.approx(rate * 0.5 / math.pi, rel=0.02)


def test_growth_keeps_the_total_area(make_solver):
    """Places beyond the ring stay in place: no displacement ten radii away."""
    solver = make_solver(96, 96, stretch=1, viscosity=0.0)
    state = run(solver, [Growth((0.5, 0.5), 2.0, 0.05)], 10, 0.02)
    d_x, _ = state.displacement
    assert np.abs(d_x).max() > 0.005
    assert np.abs(d_x[:, [0, 1, -2, -1]]).max() < 1e-5


def test_a_weight_excludes_places_from_a_growth(make_solver):
    """The prescribed divergence is the weighted one minus its mean over the picture."""
    grid = Grid(40, 40, 1.0, 1.0)
    half = Painted(np.broadcast_to(np.arange(40) < 20, (40, 40)).astype(float))
    solver = make_solver(40, 40, grid=grid, pressure_cycles=8)
    state = run(solver, [Growth((0.5, 0.5), 2.0, 0.1, weight=half)], 1, 0.05)
    x, y = (np.arange(40) + 0.5) / 40, (np.arange(40)[:, None] + 0.5) / 40
    r2 = ((x - 0.5) ** 2 + (y - 0.5) ** 2) / 0.1**2
    expected = half.values * 2.0 * (1 - r2 / 2) * np.exp(-r2 / 2)
    got = divergence(grid, *state.velocity)
    np.testing.assert_allclose(got, expected - expected.mean(), atol=6e-5 * 2)


def test_a_step_of_length_0_keeps_the_divergence_of_a_growth(make_solver):
    """A step of dt = 0 between two steps changes nothing: the divergence stays prescribed."""
    growth = Growth((0.5, 0.5), 2.0, 0.1)
    solver = make_solver(32, 32, stretch=1)
    now, after = solver.rest(), solver.rest()
    solver.step(now, after, [growth], 0.0, 0.02)
    before = after.velocity[0]
    solver.step(after, now, [growth], 0.02, 0.0)
    np.testing.assert_allclose(now.velocity[0], before, atol=1e-3 * np.abs(before).max())


def test_a_growth_of_rate_0_changes_nothing(make_solver):
    """A growth of rate 0 beside a push in a variable viscosity gives the same flow bit for bit."""
    x = (np.arange(32) + 0.5) / 32
    stiff = 0.001 + (x > 0.6) * np.ones((32, 1))
    push, ends = GaussianForce((0.5, 0.5), (2.0, 0.0), 0.1), []
    for forces in ([push], [push, Growth((0.5, 0.5), 0.0, 0.1)]):
        ends.append(run(make_solver(32, 32, stretch=1, viscosity=stiff), forces, 5, 0.02).velocity[0])
    np.testing.assert_array_equal(*ends)


def test_too_much_growth_in_a_step_is_refused_with_the_remedy(make_solver):
    with pytest.raises(ValueError, match=r"by exp\(1\) in a step of 0\.02 s.*more substeps"):
        run(make_solver(16, 16), [Growth((0.5, 0.5), 50.0, 0.1)], 1, 0.02)


@pytest.mark.parametrize("walls", ["free-slip", "periodic", "periodic,free-slip", "free-slip,periodic"])
@pytest.mark.parametrize("scale", [0.3, 1.0, 2.0])
def test_the_strength_of_noise_stays_near_the_given_one_for_any_seed(walls, scale):
    """On periodic axes and between walls, the root mean square for 20 seeds stays near the strength."""
    grid = Grid(48, 36, 1.0, 0.75)
    for seed in range(20):
        force = NoiseForce(strength=1.0, scale=scale, seed=seed)
        ((fx, fy),) = force.fields(grid, Walls.parse(walls))
        rms, most = math.sqrt((fx**2 + fy**2).mean()), np.hypot(fx, fy).max()
        assert 0.1 < rms < 3, (seed, rms)
        assert most < force.reach, (seed, most)


def test_growth_beside_a_stiff_disc_converges_with_the_step(make_solver):
    """First order in dt: a quarter of the step leaves at most 0.4 of the error.

    The pressure of a growth is of its step alone; kept for the next it would push on.
    """
    x = (np.arange(48) + 0.5) / 48
    stiff = 0.001 + (np.hypot(x - 0.62, x[:, None] - 0.5) < 0.12)
    growth = Growth((0.45, 0.5), 2.0, 0.08, Oscillator(period=0.25, phase=0.0, centred=False))
    ends = []
    for steps in (24, 96, 384):
        solver = make_solver(48, 48, stretch=1, viscosity=stiff)
        ends.append(np.stack(run(solver, [growth], steps, 0.5 / steps).displacement))
    coarse, fine = (np.abs(end - ends[-1]).max() for end in ends[:-1])
    assert fine < 0.4 * coarse, (coarse, fine)


def test_wind_between_walls_moves_nothing_and_weighted_or_wrapped_it_does(make_solver):
    """The pressure balances a uniform force in a closed box; the largest speed of three cases."""

    def speed(wind, **fluid):
        solver = make_solver(32, 32, viscosity=0.0, **fluid)
        return np.abs(run(solver, [wind], 5, 0.02).velocity[0]).max()

    half = Painted((np.arange(32)[:, None] < 16) * np.ones(32))
    assert speed(Wind((1.0, 0.0))) < 1e-3
    assert speed(Wind((1.0, 0.0)), walls="periodic") == pytest.approx(0.1, rel=1e-4)
    assert speed(Wind((1.0, 0.0), weight=half)) > 0.02


def carried(make_solver, force, duration, steps, n=128):
    """Path of the particle that starts at the force's center (velocity read bilinearly, Heun steps)."""
    solver = make_solver(n, n, stretch=1, viscosity=0.0)
    now, after = solver.rest(), solver.rest()
    place, path, dt = np.array(force.center), [], duration / steps

    def velocity(state):
        u, v = state.velocity
        i, j = place[0] * n, place[1] * n
        row, column = int(j), int(i)
        return np.array([u[row, column : column + 2].mean(), v[row : row + 2, column].mean()])

    for step in range(steps):
        solver.step(now, after, [force], step * dt, dt)
        place = place + dt * (velocity(now) + velocity(after)) / 2
        now, after = after, now
        path.append(place.copy())
    return np.array(path)


@pytest.mark.parametrize(
    ("text", "motion"),
    [
        ("256,256:6,3:radius=40", "end"),
        ("256,256:6,3:radius=40,at=0", "end"),
        ("256,256:6,3:radius=40,period=0.5", "swing"),
        ("256,256:-6,-3:radius=40,period=0.5,phase=0.75", "swing"),
    ],
)
def test_a_push_moves_its_center_by_its_arrow(make_solver, text, motion):
    """Inviscid, arrow short beside the radius: within 10 % (walls, and the blob moves off its force)."""
    force = Drawing(512, 512, 1.0).force(parse_force("push", text))
    way = (carried(make_solver, force, 1.0, 96) - force.center) * 512
    reached = way[-1] if motion == "end" else (way[48:].max(axis=0) - way[48:].min(axis=0)) / 2
    np.testing.assert_allclose(reached, (6, 3), rtol=0.1)


def test_an_oscillators_drift_per_period_is_bounded(make_solver):
    """Centred: after four periods the swing's middle is within half an amplitude of the place.

    The paper's sine walks away by about 2 pi amplitudes a period.
    """
    drift = {}
    for phase in (0.25, 0.0):
        text = f"256,256:5,0:radius=50,period=0.5,phase={phase}"
        way = (
            carried(make_solver, Drawing(512, 512, 2.0).force(parse_force("push", text)), 2.0, 192) - 0.5
        ) * 512
        last = way[-48:, 0]
        drift[phase] = abs(last.max() + last.min()) / 2 / 5
    assert drift[0.25] < 0.5, drift
    assert drift[0.0] > 5, drift


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("3,4", "expected X,Y:DX,DY"),
        ("3:4,5", "the point X,Y is '3': expected two numbers"),
        ("3,4:5", "the arrow DX,DY is '5': expected two numbers"),
        ("3,x:1,1", "'x' is not a number"),
        ("3,4:1,nan", "not finite"),
        ("3,4:1,1:mass=3", "'mass=3' is not key=value"),
        ("3,4:1,1:radius", "'radius' is not key=value"),
        ("3,4:1,1:radius=0", "radius: 0.0: expected a number above 0"),
        ("3,4:1,1:radius=1,radius=2", "given twice"),
        ("3,4:1,1:phase=0.2", "phase= needs period="),
        ("3,4:1,1:at=0,period=1", "at= is an impulse"),
        ("3,4:1,1:start=2,end=1", "end 1 is not after start 2"),
        ("3,4:1,1:at=-1", "at: -1.0: expected a number from 0"),
    ],
)
def test_a_malformed_push_is_refused_with_the_invalid_part(text, says):
    with pytest.raises(ValueError, match=says):
        Drawing(100, 100, 3.0).force(parse_force("push", text))


@pytest.mark.parametrize(
    ("text", "says"),
    [("900,4:1,1", "outside the picture"), ("3,4:1,1:at=5", "lasts 1 s"), ("3,4:1,1:start=1", "lasts 1 s")],
)
def test_a_push_that_does_not_fit_is_refused(text, says):
    with pytest.raises(ValueError, match=says):
        Drawing(100, 100, 1.0).force(parse_force("push", text))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: GaussianForce((0.1, math.nan), (1, 1), 0.1),
        lambda: GaussianForce((0.1, 0.1), (2e4, 1), 0.1),
        lambda: GaussianForce((0.1, 0.1), (1, 1), 0.0),
        lambda: GaussianForce((0.1,), (1, 1), 0.1),
        lambda: Constant(1.0, 0.5),
        lambda: Arbitrary(),
        lambda: Arbitrary(times=(0, 1), values=(1,)),
        lambda: Arbitrary(times=(1, 0), values=(1, 2)),
        lambda: Oscillator(period=0),
        lambda: Instantaneous(math.inf),
        lambda: Fade(rise=1, end=0.5),
        lambda: Fade(fall=0.5),
        lambda: VortexForce((0.1, 0.1), math.nan, 0.1),
        lambda: VortexForce((0.1, 0.1), 1e6, 0.1),
        lambda: Growth((0.1, 0.1), 1e3, 0.1),
        lambda: Growth((0.1, 0.1), 1.0, 0.1, Instantaneous(0.1)),
        lambda: GaussianForce((0.1, 0.1), (1, 1), 1e-40),
        lambda: Path((0, 1), ((0, 0),)),
        lambda: Path((1, 0), ((0, 0), (1, 1))),
        lambda: Path.along(((0, 0), (0, 0)), 0, 1),
        lambda: Stroke(Path((0, 1e-6), ((0, 0), (1, 1))), 0.1),
        lambda: Wind((math.inf, 0)),
        lambda: NoiseForce(strength=1.0, scale=0.0),
        lambda: NoiseForce(strength=1.0, seed=-1),
        lambda: Group([GaussianForce((0.1, 0.1), (1, 1), 0.1)], strength=math.nan),
    ],
)
def test_impossible_forces_are_refused(wrong):
    with pytest.raises(ValueError):
        wrong()
