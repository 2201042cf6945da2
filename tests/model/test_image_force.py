"""Forces from pictures: fields, the effect of pressure on them, and weights on other forces."""

import numpy as np
import pytest
from oracles import divergence

from wfluid import Constant, GaussianForce, Grid, ImageForce, Instantaneous, Painted, Picture
from wfluid.domain.walls import Walls
from wfluid.model.image_force import vectors_of

GRID = Grid(24, 18, 1.0, 0.75)
OPEN, WRAPPED = Walls(), Walls.parse("periodic")


def bumps(grid, seed=0):
    """Smooth random intensities 0 … 1, (ny, nx)."""
    rng = np.random.default_rng(seed)
    x, y = (np.arange(grid.nx) + 0.5) / grid.nx, ((np.arange(grid.ny) + 0.5) / grid.ny)[:, None]
    values = sum(
        rng.standard_normal() * np.cos(np.pi * a * x) * np.cos(np.pi * b * y)
        for a in range(4)
        for b in range(4)
    )
    return (values - values.min()) / np.ptp(values)


def test_a_gradient_points_to_the_brighter_side_with_the_given_strength():
    """A ramp along x gives a constant force between the walls and none on them."""
    ramp = np.broadcast_to((np.arange(24) + 0.5) / 24, (18, 24))
    along, across = ImageForce(ramp, strength=3.0, radius=0).fields(GRID, OPEN)[0]
    np.testing.assert_allclose(along[:, 1:], 3.0, rtol=1e-5)
    assert np.all(along[:, 0] == 0) and np.abs(across).max() < 1e-6


def test_a_contour_has_the_brighter_side_on_its_right_and_no_divergence():
    """Bright below: along +x (y points down). On a periodic grid its divergence is rounding."""
    ramp = np.broadcast_to(((np.arange(18) + 0.5) / 18)[:, None], (18, 24))
    along, across = ImageForce(ramp, "contour", 2.0, radius=0).fields(GRID, OPEN)[0]
    np.testing.assert_allclose(along[1:-1, 1:], 2.0, rtol=1e-5)
    assert np.abs(across).max() < 1e-6
    u, v = ImageForce(np.random.default_rng(1).random((18, 24)), "contour", radius=0).fields(GRID, WRAPPED)[0]
    u, v = np.hstack([u, u[:, :1]]), np.vstack([v, v[:1]])
    assert np.abs(divergence(GRID, u, v)).max() < 1e-6 / GRID.hx
    assert np.abs(u).max() > 0.3


def test_the_blur_removes_short_waves_and_keeps_long_ones():
    """A cosine of wavelength L loses exp(-(2 pi radius / L)^2 / 2) of itself: Gaussian blur's transform."""
    grid, radius = Grid(128, 4, 1.0, 4 / 128), 0.03
    x = (np.arange(128) + 0.5) / 128
    fine, wide = (0.5 + 0.25 * np.cos(2 * np.pi * n * x) + 0 * grid.ny for n in (8, 1))
    from wfluid.domain.operators import blurred

    for values, n in ((fine, 8), (wide, 1)):
        got = blurred(np.broadcast_to(values, (4, 128)), grid, radius, WRAPPED.periodic)[0]
        left = np.exp(-0.5 * (2 * np.pi * n * radius) ** 2)
        np.testing.assert_allclose(got - 0.5, left * (values - 0.5), atol=1e-4)


def test_vectors_are_read_with_zero_at_half_range():
    codes = np.array([[[128, 128, 7], [255, 128, 7], [1, 255, 7]]], dtype=np.uint8)
    picture = Picture((codes / 255).astype(np.float32), None, "uint8", srgb=False)
    expected = [[[0, 0], [1, 0], [-1, 1]]]
    np.testing.assert_allclose(vectors_of(picture), expected, atol=1e-6)
    floats = Picture(np.array([[[0.5, -2.0]]], dtype=np.float32))
    np.testing.assert_allclose(vectors_of(floats), [[[0.5, -2.0]]])
    arrow = np.zeros((18, 24, 2))
    arrow[..., 0], arrow[..., 1] = 0.5, -0.25
    force = ImageForce(arrow, "vectors", 4.0)
    along, across = force.fields(GRID, WRAPPED)[0]
    np.testing.assert_allclose(along, 2.0)
    np.testing.assert_allclose(across, -1.0)
    assert force.reach == pytest.approx(4 * np.hypot(0.5, 0.25))


@pytest.mark.parametrize(("walls", "wraps"), [("periodic,free-slip", 0), ("free-slip,periodic", 1)])
def test_vectors_meet_across_the_seam_of_their_own_axis(walls, wraps):
    """A face has the mean of the centres beside it, across a seam of the last and the first; a wall has 0."""
    vectors = np.random.default_rng(5).uniform(-1, 1, (18, 24, 2))
    force = ImageForce(vectors, "vectors", 2.0).fields(GRID, Walls.parse(walls))[0]
    for n, (got, centres) in enumerate(zip(force, np.moveaxis(vectors, 2, 0), strict=True)):
        lines, values = (np.moveaxis(f, 1 - n, 0) for f in (got, centres))
        np.testing.assert_allclose(lines[1:], values[1:] + values[:-1], atol=1e-6)
        np.testing.assert_allclose(lines[0], (values[0] + values[-1]) * (n == wraps), atol=1e-6)


def test_transparent_vectors_are_0_and_alpha_is_no_component():
    """A transparent place of a picture of vectors has no force; grey with alpha has one channel only."""
    clear = Picture(np.zeros((4, 4, 4), np.float32), 3, "uint8", srgb=False)
    assert np.abs(vectors_of(clear)).max() == 0
    with pytest.raises(ValueError, match="needs two channels"):
        vectors_of(Picture(np.ones((4, 4, 2), np.float32), 1, "uint8", srgb=False))


def test_the_strength_is_the_force_at_the_steepest_place():
    """Along a diagonal too; a picture that is constant up to rounding is refused."""
    x, y = (np.arange(24) + 0.5) / 24, ((np.arange(18) + 0.5) / 24)[:, None]
    force = ImageForce((x + y) / 2, strength=3.0, radius=0).fields(GRID, OPEN)[0]
    np.testing.assert_allclose(np.hypot(*force)[1:, 1:], 3.0, rtol=1e-4)
    with pytest.raises(ValueError, match="no slopes left"):
        ImageForce(0.3 + 1e-9 * np.arange(24) * np.ones((18, 1))).fields(GRID, OPEN)[0]


def velocity_after(make_solver, forces, steps=4, dt=0.05, **fluid):
    solver = make_solver(GRID.nx, GRID.ny, grid=GRID, viscosity=0.0, pressure_cycles=8, **fluid)
    a, b = solver.rest(), solver.rest()
    for step in range(steps):
        solver.step(a, b, forces, step * dt, dt)
        a, b = b, a
    return a.velocity


def test_pressure_balances_a_gradient_and_leaves_a_contour(make_solver):
    """Grad I is grad q: an incompressible fluid stays still under it, but not under its quarter turn."""
    still, moved, weighted = (
        np.abs(velocity_after(make_solver, [ImageForce(bumps(GRID), kind, weight=weight)])[0]).max()
        for kind, weight in (("gradient", None), ("contour", None), ("gradient", Painted(bumps(GRID, 3))))
    )
    assert still < 1e-5 and moved > 0.05 and weighted > 0.003


def test_impulses_are_those_of_the_envelope(make_solver):
    """A contour is untouched by pressure: after one step at rest the velocity is force times impulse."""
    for envelope, impulse in ((Constant(0.0, 0.02), 0.02), (Instantaneous(0.01), 1.0), (Constant(), 0.05)):
        force = ImageForce(bumps(GRID), "contour", 0.3, envelope)
        expected = force.fields(GRID, WRAPPED)[0][0]
        u, _ = velocity_after(make_solver, [force], steps=1, walls="periodic")
        np.testing.assert_allclose(u[:, :-1], impulse * expected, atol=2e-5 * impulse)


def test_a_weight_scales_a_force_where_it_is_painted(make_solver):
    """Weight 1 equals no weight, 1/2 halves the force, and forces with and without weights add up."""
    full = GaussianForce((0.3, 0.4), (0.2, 0.1), 0.1)
    other = GaussianForce((0.7, 0.4), (-0.1, 0.2), 0.05)
    drawn = ImageForce(bumps(GRID), "contour", 0.1)

    def weighted(force, value):
        return GaussianForce(force.center, force.vector, force.radius, weight=Painted(np.full((2, 2), value)))

    def after(*forces):
        return velocity_after(make_solver, forces, steps=1)[0]

    np.testing.assert_allclose(after(weighted(full, 1.0)), after(full), atol=1e-7)
    np.testing.assert_allclose(after(weighted(full, 0.5)), after(full) / 2, atol=1e-7)
    together = after(full) + after(other) / 2 + after(drawn)
    np.testing.assert_allclose(after(weighted(other, 0.5), drawn, full), together, atol=1e-6)
    half = Painted(np.broadcast_to(np.arange(24) < 12, (18, 24)).astype(float))
    left = GaussianForce((0.5, 0.4), (0.0, 0.2), 0.2, weight=half)
    solver = make_solver(GRID.nx, GRID.ny, grid=GRID)
    rest, state = solver.rest(), solver.rest()
    solver._forcing_for([left]).set([left], solver.fluid, 0.0, 0.1, 0.1)
    solver._forcing_for([left]).push((rest.u, rest.v), rest.rho, (state.u, state.v))
    v = state.velocity[1]
    assert np.abs(v[:, 12:]).max() == 0 and np.abs(v[:, :12]).max() > 0.01


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ImageForce(np.ones((4, 4)), "swirl"), "expected one of gradient, contour, vectors"),
        (lambda: ImageForce(np.ones((4, 4))), "no slopes"),
        (lambda: ImageForce(bumps(GRID), strength=np.nan), "strength nan"),
        (lambda: ImageForce(bumps(GRID), strength=2e4), "at most 10000"),
        (lambda: ImageForce(bumps(GRID), radius=-1), "radius -1"),
        (lambda: ImageForce(bumps(GRID), "vectors"), r"expected \(height, width, 2\)"),
        (lambda: ImageForce(Picture(np.ones((2, 2, 1), np.float32)), "vectors"), "needs two channels"),
        (lambda: ImageForce(np.full((2, 2, 2), np.nan), "vectors"), "not finite"),
        (lambda: ImageForce(np.array([[0.0, np.nan]])), "nan"),
    ],
)
def test_invalid_forces_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_painted_force_beyond_the_limit_is_refused_with_the_number(make_solver):
    force = ImageForce(np.full((2, 2, 2), 100.0), "vectors", 9e3)
    with pytest.raises(ValueError, match=r"a force over the picture would add a velocity of 1\.27279e\+06"):
        velocity_after(make_solver, [force], steps=1, dt=1.0)
