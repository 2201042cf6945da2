"""Transposes of every linear stage of a step: <y, A x> = <A^T y, x> for noise x and y.

Both sides add some thousand products, each rounded a few hundred times on its way through a solve, mostly
at random: 1e-12 of the sum of the products' sizes is 4500 eps. What goes to conjugate gradients is but as
symmetric as they are converged.
"""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from inner_products import inner, noise, padded, put_padded
from viscous_media import DT, MEDIA, WALLS, centres, coupled, disc, frozen, media, random_vector
from wfluid.kernels.adjoint import advection as advection_adjoint
from wfluid.kernels.adjoint import scatter
from wfluid.kernels.adjoint import transport as transport_adjoint
from wfluid.kernels.cell.layout import HALO, Layout
from wfluid.kernels.cell.program import ADJOINT
from wfluid.kernels.cell.real import Real
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import advection, transport

import wfluid.gradient.functional  # noqa: F401 - all of the adjoint's kernels, before any is loaded
from wfluid import Buoyancy, Density, Fluid, GaussianForce, Grid, Growth, Painted, Source, VortexForce, Wind
from wfluid.domain.walls import Rule, Walls
from wfluid.fields.arrays import field, from_numpy, to_numpy, vector
from wfluid.fields.device import load_kernels
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.model.densities import PaintedSource
from wfluid.model.force import GaussianImpulse
from wfluid.solve.multigrid import Location
from wfluid.step.diffusion import ScalarDiffusion
from wfluid.step.forcing import Forcing
from wfluid.step.gaussians import GaussianBatch, gaussian_impulse_of
from wfluid.step.inertial import InertialStep
from wfluid.step.tape import bars, recording

pytestmark = pytest.mark.float64

GRID = Grid(23, 18, 1.0, 0.7)
LAYOUT = Layout(23, 18)
TOLERANCE = 1e-12


@pytest.fixture(autouse=True)
def loaded(device):
    load_kernels(device, ADJOINT)


def assert_transposed(y, ax, aty, x, tolerance=TOLERANCE, layout=LAYOUT):
    """<y, A x> = <A^T y, x>, and neither is 0."""
    (left, left_size), (right, right_size) = inner(y, ax, layout), inner(aty, x, layout)
    assert left_size > 0 and abs(left) > 1e-5 * left_size
    assert abs(left - right) <= tolerance * max(left_size, right_size), (left, right)


# Ghosts


@pytest.mark.parametrize("rule_y", list(Rule))
@pytest.mark.parametrize("rule_x", list(Rule))
@pytest.mark.parametrize("size", [(7, 5), (4, 4), (64, 6)], ids=str)
def test_fold_is_the_transpose_of_fill(device, rule_x, rule_y, size):
    """Over all positions, ghosts included, whatever was in them before: they come out as 0."""
    layout, rng = Layout(*size), np.random.default_rng(1)
    ghosts, f, bar = Ghosts(layout, (rule_x, rule_y), device), field(layout, device), field(layout, device)
    x, y = rng.standard_normal((2, layout.ny + 2 * HALO, layout.nx + 2 * HALO))
    put_padded(x, f, layout)
    put_padded(y, bar, layout)
    ghosts.fill(f)
    ghosts.fold(bar)
    filled, folded = padded(f, layout), padded(bar, layout)
    left, right = np.sum(y * filled), np.sum(folded * x)
    assert abs(left - right) <= 1e-14 * np.sum(np.abs(y * filled))
    inside = np.zeros_like(folded, bool)
    inside[HALO:-HALO, HALO:-HALO] = True
    inside[:, : HALO + (rule_x is Rule.FACE)] = False
    inside[: HALO + (rule_y is Rule.FACE)] = False
    assert not folded[~inside].any() and folded[inside].all()


# Scatter


KINDS = {
    "cubic": (
        scatter.scatter_cubic,
        lambda t: np.array(
            [
                (-t + 2 * t**2 - t**3) / 2,
                (2 - 5 * t**2 + 3 * t**3) / 2,
                (t + 4 * t**2 - 3 * t**3) / 2,
                (-(t**2) + t**3) / 2,
            ]
        ),
    ),
    "bilinear": (scatter.scatter_bilinear, lambda t: np.array([1 - t, t])),
}
"""Each program, and the weights of its points along an axis, a fraction t past one of them."""


def numpy_scatter(weights, at, tx, ty, bar, out, pitch):
    """The same by np.add.at, one point after the other."""
    wx, wy = weights(tx), weights(ty)
    reach = len(wx) // 2 - 1
    for r in range(len(wy)):
        for q in range(len(wx)):
            np.add.at(out, at + (r - reach) * pitch + q - reach, wx[q] * wy[r] * bar)


def smooth(layout, rng):
    """Places a few cells from where they are read, by a turn about the middle; columns and rows."""
    j, i = np.mgrid[: layout.ny, : layout.nx].astype(float)
    x = i + 1.3 * np.sin(2 * j / layout.ny + 0.3) + 0.4 * np.cos(9 * i / layout.nx)
    y = j + 1.7 * np.cos(3 * i / layout.nx) - 0.3 * np.sin(5 * j / layout.ny)
    return np.clip(x, -1, layout.nx - 1e-9), np.clip(y, -1, layout.ny - 1e-9)


def wild(layout, rng):
    """Anywhere between the outermost ghosts that a foot reads: many numbers `at` - k in every span."""
    x = rng.uniform(-1, layout.nx, (layout.ny, layout.nx))
    return x, rng.uniform(-1, layout.ny, (layout.ny, layout.nx))


def half_wild(layout, rng):
    """Smooth but for every fifth cell."""
    x, y = smooth(layout, rng)
    other = rng.random(x.shape) < 0.2
    a, b = wild(layout, rng)
    return np.where(other, a, x), np.where(other, b, y)


def turned(layout, rng):
    """A periodic axis: what leaves on one side comes in on the other, within a span."""
    j, i = np.mgrid[: layout.ny, : layout.nx].astype(float)
    x, y = i + 3.4 + 0.2 * np.sin(j), j - 2.6 + 0.3 * np.cos(i / 3)
    return np.mod(x, layout.nx), np.mod(y, layout.ny)


def at_points(layout, rng):
    """Fractions of exactly 0 and 1."""
    x, y = np.floor(wild(layout, rng))
    return x, y


@pytest.mark.parametrize("places", [smooth, wild, half_wild, turned, at_points])
@pytest.mark.parametrize("size", [(23, 9), (64, 9), (150, 7), (129, 5)], ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_scatter_adds_what_numpy_adds(device, kind, size, places):
    """To what is there already; what lies beyond a row's end counts for nothing.

    A point gets some hundred terms at most, summed in another order: 1e-13 is 450 eps.
    """
    layout, rng, (program, weights) = Layout(*size), np.random.default_rng(2), KINDS[kind]
    x, y = places(layout, rng)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    tx, ty = x - column, y - row
    if places is at_points:  # as `locate` has it on a wall: the interval before, at its end
        end = column == layout.nx - 1
        column, tx = np.where(end, column - 1, column), np.where(end, 1.0, tx)
    at = (row + HALO) * layout.pitch + column + HALO
    bar = rng.standard_normal(x.shape)
    before = rng.standard_normal(layout.size)
    expected = before.copy()
    numpy_scatter(weights, at.ravel(), tx.ravel(), ty.ravel(), bar.ravel(), expected, layout.pitch)

    out = wp.array(before, dtype=Real, device=device)
    t_x, t_y, f_bar = (wp.array(np.full(layout.size, np.nan), dtype=Real, device=device) for _ in range(3))
    for values, f in ((tx, t_x), (ty, t_y), (bar, f_bar)):
        from_numpy(values, f, layout)
    places_at = np.full(layout.size, 2**30)
    lines = places_at[: layout.size // layout.pitch * layout.pitch].reshape(-1, layout.pitch)
    lines[HALO : HALO + layout.ny, HALO : HALO + layout.nx] = at
    inputs = [wp.array(places_at, dtype=wp.int32, device=device), t_x, t_y, f_bar, layout.nx, layout.pitch]
    program.launch(layout, device, inputs, [out], turn=0)
    np.testing.assert_allclose(out.numpy(), expected, rtol=1e-13, atol=1e-13 * np.abs(expected).max())
    assert np.count_nonzero(out.numpy() != before) >= 0.9 * min(x.size, 4)


# Projection


def projecting(device, walls="free-slip", **fluid):
    """A step of DT, ready."""
    step = InertialStep(GRID, Fluid(walls=walls, **fluid), device)
    step.plan(DT, DT, step.update_coefficients)
    step.allow_gradients()
    return step


def ask(written, gradients):
    """Let these be the gradients with respect to what a stage is about to write."""
    for f, bar in zip(written, gradients, strict=True):
        f.grad = wp.clone(bar)


def taped(read):
    """A tape, and gradients of 0 for what a stage is about to read."""
    for f in read:
        f.grad = wp.zeros_like(f)
    return recording()


def drag(grid, hard):
    """A mask that is soft, or steps from nothing to all."""
    x, y = centres(grid)
    bump = np.exp(-((x - 0.4) ** 2 + (y - 0.3) ** 2) / 0.05)
    return frozen(np.where(disc(grid, 0.4, 0.3), 1e4, 0.0) if hard else np.expm1(np.log1p(5.0) * bump))


PROJECTIONS = {
    "multigrid": ({}, "multigrid", TOLERANCE),
    "one cycle": ({"pressure_cycles": 1}, "multigrid", TOLERANCE),
    "jacobi": ({"solver": "jacobi", "sweeps": 9}, "jacobi", TOLERANCE),
    "drag": ({"freeze": drag(GRID, hard=False)}, "multigrid", TOLERANCE),
    "drag, jacobi": ({"freeze": drag(GRID, hard=True), "solver": "jacobi"}, "jacobi", TOLERANCE),
    "hard drag": (
        {"freeze": drag(GRID, hard=True), "pressure_tolerance": 1e-13},
        "conjugate gradients",
        1e-11,
    ),
}
"""What makes a projection, the method that solves it, and how well it is transposed."""


@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_the_projection_is_transposed(device, name, walls):
    """From velocity and prescribed divergence to velocity and pressure."""
    settings, method, tolerance = PROJECTIONS[name]
    step = projecting(device, walls, **settings)
    projection, ghosts = step.projection, step.velocity_ghosts
    assert projection.method.name == method
    x, y = noise(LAYOUT, device, 2, 1, *ghosts), noise(LAYOUT, device, 2, 2, *ghosts)
    (s,), (q_bar,) = balanced(noise(LAYOUT, device, 1, 3)), balanced(noise(LAYOUT, device, 1, 4))

    class Prescribed:
        """A divergence, and the gradient with respect to it."""

        def prescribe(self, b):
            algebra.add.launch(LAYOUT, device, [s], [b])

        def prescribe_adjoint(self, minus_b_bar):
            self.minus_bar = wp.clone(minus_b_bar)

    out, prescribed, projection.accumulates_pressure = vector(LAYOUT, device, 2), Prescribed(), True
    ask((*out, projection.q), (*y, q_bar))
    with taped(x) as tape:
        projection.project(x, out, prescribed)
    q = wp.clone(projection.q, requires_grad=False)
    tape.backward()
    minus_s = wp.array(-s.numpy(), dtype=Real, device=device)
    found = *bars(x), prescribed.minus_bar
    assert_transposed((*y, q_bar), (*out, q), found, (*x, minus_s), tolerance)
    assert_transposed(y, out, bars(x), x, 1.0)  # neither part is nothing


def balanced(fields):
    """Fields whose sum is 0: closed walls have no place for another."""
    for f in fields:
        values = to_numpy(f, LAYOUT)
        from_numpy(values - values.mean(), f, LAYOUT)
    return fields


@pytest.mark.parametrize("walls", WALLS)
def test_taking_the_pressure_so_far_off_and_adding_it_again_is_transposed(device, walls):
    """v, q -> v - kept grad q, kept q: what a step does before its diffusion and after its projection."""
    step = projecting(device, walls, viscosity=media(GRID)["smooth"][0])
    ghosts = step.velocity_ghosts
    impulses = Forcing((), step.fluid, GRID, device)
    impulses.set((), step.fluid, 0.0, DT, DT, pressure_part=0.7)
    (q,) = noise(LAYOUT, device, 1, 5, Ghosts(LAYOUT, step.fluid.walls.centre_rules(), device))
    v, y = noise(LAYOUT, device, 2, 6, *ghosts), noise(LAYOUT, device, 2, 7, *ghosts)
    (out_q,) = vector(LAYOUT, device, 1)
    step.projection.q.zero_()
    (q_bar,) = noise(LAYOUT, device, 1, 8)
    ask((*step.projection.without_pressure, out_q), (*y, q_bar))
    with taped((*v, q)) as tape:
        out = step.projection.subtract_pressure(v, q, impulses)
        step.projection.add_pressure(q, impulses, out_q)
    tape.backward()
    assert_transposed((*y, q_bar), (*out, out_q), bars((*v, q)), (*v, q))


# Diffusion


SCALARS = {
    "chebyshev": ({}, 1e-4, "chebyshev"),
    "multigrid": ({}, 0.05, "multigrid"),
    "jacobi": ({"solver": "jacobi", "sweeps": 7}, 0.05, "jacobi"),
}
"""Settings, dt times the diffusivity, and the method that solves it."""


@pytest.mark.parametrize("walls", ["free-slip", "periodic", "periodic,free-slip"])
@pytest.mark.parametrize("points", ["u", "v", "centres", "conserved"])
@pytest.mark.parametrize("name", SCALARS)
def test_the_diffusion_of_one_field_is_transposed(device, name, points, walls):
    """A component of the velocity, a scalar, and a density, whose sum is kept."""
    settings, dt_mu, method = SCALARS[name]
    fluid = Fluid(walls=walls, **settings)
    components = {
        "u": Location(fluid.walls.u_rules(), (True, False)),
        "v": Location(fluid.walls.v_rules(), (False, True)),
    }
    where = components.get(points, Location(fluid.walls.centre_rules()))
    diffusion = ScalarDiffusion(GRID, fluid, where, device, conserved=points == "conserved")
    assert diffusion.plan(dt_mu).name == method
    ghosts = Ghosts(LAYOUT, where.rules, device)
    (x,), (y,) = noise(LAYOUT, device, 1, 1, ghosts), noise(LAYOUT, device, 1, 2, ghosts)
    out, bar = field(LAYOUT, device), field(LAYOUT, device)
    diffusion.diffuse(x, out)
    diffusion.adjoint(y, bar)
    assert_transposed([y], [out], [bar], [x])
    assert np.abs(to_numpy(out, LAYOUT) - to_numpy(x, LAYOUT)).max() > 0.01


COUPLED = {
    "chebyshev": ("constant", 1e-4, {}, "chebyshev", TOLERANCE),
    "multigrid": ("smooth", 0.5, {}, "multigrid", TOLERANCE),
    "jacobi": ("both", DT, {"solver": "jacobi", "sweeps": 7}, "jacobi", TOLERANCE),
    "drag": ("drag", DT, {}, "chebyshev", TOLERANCE),
    "jump": ("jump 1e2", DT, {"diffusion_tolerance": 1e-13}, "conjugate gradients", 1e-11),
    "all": ("both", DT, {"diffusion_tolerance": 1e-13}, "conjugate gradients", 1e-11),
}
"""Medium, step, settings, the method that solves it and how well it is transposed."""


@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", COUPLED)
def test_the_coupled_diffusion_is_transposed(device, name, walls):
    medium, dt, settings, method, tolerance = COUPLED[name]
    assert medium in MEDIA
    diffusion = coupled(GRID, *media(GRID)[medium], walls, device, dt, **settings)
    assert diffusion.method.name == method
    x, y, bar = random_vector(diffusion, 1), random_vector(diffusion, 2), vector(LAYOUT, device, 2)
    diffusion.diffuse(x)
    diffusion.adjoint(y, bar)
    diffusion.system.levels[0].fill(bar)
    assert_transposed(y, diffusion.out, bar, x, tolerance)


# Advection and transport


def feet(step, seed, largest):
    """Offsets of noise up to so many cells, between the walls, with ghosts."""
    rng, walls = np.random.default_rng(seed), step.fluid.walls
    for f, n, axis, wraps in zip(step.feet.foot, (23, 18), (1, 0), walls.periodic, strict=True):
        middle = (np.arange(n) + 0.5).reshape((1, n) if axis else (n, 1))
        offset = rng.uniform(-largest, largest, (18, 23))
        from_numpy(offset if wraps else np.clip(offset, -middle, n - middle), f, LAYOUT)
    for f, ghosts in zip(step.feet.foot, step.moved_ghosts, strict=True):
        ghosts.fill(f)
    return step.feet.foot


ADVECTIONS = {
    "standard": (advection.advect_face_cubic, transport.carry_map_cubic, scatter.scatter_cubic),
    "paper": (advection.advect_face_bilinear, transport.carry_map_bilinear, scatter.scatter_bilinear),
}


@pytest.mark.parametrize("largest", [0.4, 7.0])
@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("scheme", ADVECTIONS)
def test_what_is_carried_from_fixed_feet_is_scattered_back(device, scheme, walls, largest):
    """Both components of the velocity, and of the displacement, whose foot is a summand beside."""
    step = InertialStep(GRID, Fluid(scheme=scheme, walls=walls), device)
    advect, carry, scattered = ADVECTIONS[scheme]
    foot, pitch = feet(step, 3, largest), LAYOUT.pitch
    place = (wp.zeros(LAYOUT.size, dtype=wp.int32, device=device), *vector(LAYOUT, device, 2))

    def scatter_back(before, bar, ghosts):
        out = field(LAYOUT, device)
        advection_adjoint.place_feet.launch(LAYOUT, device, [*foot, before, *step.lookup_args], place)
        scattered.launch(LAYOUT, device, [*place, bar, LAYOUT.nx, pitch], [out], turn=0)
        ghosts.fold(out)
        return out

    for before, ghosts, seed in zip((1, pitch), step.velocity_ghosts, (1, 2), strict=True):
        (x,), (y,) = noise(LAYOUT, device, 1, seed, ghosts), noise(LAYOUT, device, 1, seed + 8, ghosts)
        out = field(LAYOUT, device)
        advect.launch(LAYOUT, device, [x, *foot, before, *step.lookup_args], [out])
        assert_transposed([y], [out], [scatter_back(before, y, ghosts)], [x])
    x = noise(LAYOUT, device, 2, 4, *step.moved_ghosts)
    y, out = noise(LAYOUT, device, 2, 5), vector(LAYOUT, device, 2)
    carry.launch(LAYOUT, device, [*x, *foot, *step.lookup_args], out)
    for f, to in zip(foot, out, strict=True):
        from_numpy(to_numpy(to, LAYOUT) - to_numpy(f, LAYOUT), to, LAYOUT)
    back = [scatter_back(0, bar, ghosts) for bar, ghosts in zip(y, step.moved_ghosts, strict=True)]
    assert_transposed(y, out, back, x)


@pytest.mark.parametrize("limited", [False, True], ids=["free", "limited"])
@pytest.mark.parametrize("walls", WALLS)
def test_a_densitys_transport_is_transposed(device, walls, limited):
    """About one density it is linear as far as the limit holds at the same cells.

    A slope with feet well between the points is away from the limit, but beside a wall; noise with feet
    close to the points is often limited. A part `small` of x then changes no choice, and the difference is
    that of the linear map, with the rounding of values of about 20: 20 eps / small = 5e-12, at random 400
    times.
    """
    step = InertialStep(GRID, Fluid(walls=walls, densities=[Density()]), device)
    ghosts, small = Ghosts(LAYOUT, step.fluid.walls.centre_rules(), device), 2.0**-10
    rng = np.random.default_rng(7)
    j, i = np.mgrid[:18, :23]
    rho, changed, rho_bar = vector(LAYOUT, device, 3)
    start = rng.uniform(1, 2, (18, 23)) * 8 if limited else 8.0 + 0.7 * i + 0.4 * j
    x = rng.uniform(-1, 1, (18, 23)) * (1e-3 if limited else 0.1)
    middle, around = (0.08, 0.06) if limited else (0.5, 0.2)
    for f, sign in zip(step.feet.foot, (1, -1), strict=True):
        from_numpy(sign * middle + rng.uniform(-around, around, (18, 23)), f, LAYOUT)
    outs = []
    for values, f in ((start, rho), (start + small * x, changed)):
        from_numpy(values, f, LAYOUT)
        ghosts.fill(f)
        out = field(LAYOUT, device)
        transport.carry_density.launch(LAYOUT, device, [f, *step.feet.foot, *step.lookup_args], [out])
        outs.append(to_numpy(out, LAYOUT))
    ax = (outs[1] - outs[0]) / small
    (y,) = noise(LAYOUT, device, 1, 2)
    foot_bar = vector(LAYOUT, device, 2)
    inputs = [rho, *step.feet.foot, y, *step.lookup_args]
    transport_adjoint.carry_density_adjoint.launch(LAYOUT, device, inputs, [rho_bar, *foot_bar], turn=0)
    ghosts.fold(rho_bar)
    at = [np.count_nonzero(to_numpy(f, LAYOUT) == 0) for f in foot_bar]
    assert (min(at) > 50) if limited else (max(at) < 80)
    left, right = np.sum(to_numpy(y, LAYOUT) * ax), np.sum(to_numpy(rho_bar, LAYOUT) * x)
    rounding = 20 * np.finfo(float).eps / small * np.linalg.norm(to_numpy(y, LAYOUT))
    assert abs(left) > 1e4 * rounding and abs(left - right) < 4 * rounding


@pytest.mark.parametrize("walls", WALLS)
def test_means_of_faces_at_centres_are_transposed(device, walls):
    """The Euler trace of a velocity too slow to reach a wall, -dt v at centres, is linear."""
    step = InertialStep(GRID, Fluid(scheme="paper", walls=walls), device)
    impulses = Forcing((), step.fluid, GRID, device)
    impulses.set((), step.fluid, 0.0, DT, DT)
    x = noise(LAYOUT, device, 2, 1, *step.velocity_ghosts)
    for f in x:
        f.assign(0.01 * f.numpy())
    state = replace(State.at_rest(GRID, device), u=x[0], v=x[1])
    step.allow_gradients()
    y = noise(LAYOUT, device, 2, 2)
    ask(step.feet.foot, y)
    with taped(x) as tape:
        foot = step.trace(state, impulses)
    tape.backward()
    assert_transposed(y, foot, bars(x), x)


# Forces and sources


def acting(forces, device, walls, densities=()):
    """The forces' impulses over the first step, and the ghosts of a velocity."""
    fluid = Fluid(walls=walls, densities=densities)
    impulses = Forcing(forces, fluid, GRID, device, gradients=True)
    impulses.set(forces, fluid, 0.0, DT, DT)
    rules = fluid.walls.u_rules(), fluid.walls.v_rules()
    return impulses, [Ghosts(LAYOUT, own, device) for own in rules]


def one_step(gradients, impulses):
    """What gradients make of the one step that is on the device, by force."""
    numbers, moments = impulses.numbers.numpy()[None], impulses.bars.numpy()[None]
    return {n: rows[0] for n, rows in gradients(numbers, moments).items()}


@pytest.mark.parametrize("walls", WALLS)
def test_the_lift_of_a_density_is_transposed(device, walls):
    """With respect to the density, and to the impulse: of two densities each by its own buoyancy."""
    densities = [Density("ink"), Density("smoke")]
    forces = [Buoyancy("smoke", (3.0, -2.0)), Buoyancy("ink", (-1.0, 1.5))]
    impulses, ghosts = acting(forces, device, walls, densities)
    at_centres = Ghosts(LAYOUT, Walls.parse(walls).centre_rules(), device)
    rho = noise(LAYOUT, device, 2, 1, at_centres, at_centres)
    state = replace(State.at_rest(GRID, device, 2), rho=rho)
    out, y = vector(LAYOUT, device, 2), noise(LAYOUT, device, 2, 2)
    for bar, own in zip(y, ghosts, strict=True):
        own.fill(bar)
        own.fold(bar)
    ask(out, y)
    with taped(state.arrays) as tape:
        impulses.push((state.u, state.v), state.rho, out)
    tape.backward()
    assert_transposed(y, out, bars(rho), rho)
    found = one_step(impulses.gradients, impulses)
    right = sum(np.dot(found[n], force.vector) * DT for n, force in enumerate(forces))
    left, size = inner(y, out, LAYOUT)
    assert abs(left - right) <= TOLERANCE * size


@pytest.mark.parametrize("walls", ["free-slip", "periodic,no-slip"])
def test_pushes_twirls_and_winds_are_transposed_with_respect_to_their_strengths(device, walls):
    """<y, what all gain> is the sum of strength times gradient, weights painted or not."""
    paint = Painted(np.random.default_rng(3).random((18, 23)))
    forces = [
        GaussianForce((0.3, 0.4), (2.0, -3.0), 0.15),
        VortexForce((0.8, 0.2), 9.0, 0.1),
        GaussianForce((0.95, 0.68), (-1.0, 2.0), 0.2, weight=paint),
        VortexForce((0.5, 0.5), -5.0, 0.3, weight=paint),
        Wind((0.7, 0.4), weight=paint),
    ]
    impulses, ghosts = acting(forces, device, walls)
    state, y, out = State.at_rest(GRID, device), noise(LAYOUT, device, 2, 1), vector(LAYOUT, device, 2)
    for bar, own in zip(y, ghosts, strict=True):
        own.fill(bar)
        own.fold(bar)
    ask(out, y)
    with taped(state.arrays) as tape:
        impulses.push((state.u, state.v), state.rho, out)
    tape.backward()
    found = one_step(impulses.gradients, impulses)
    right = 0.0
    for n, force in enumerate(forces):
        if isinstance(force, Wind):
            right += np.dot(found[n], force.integrals(0.0, DT))
        else:
            bar, done = gaussian_impulse_of(found[n]), force.impulse(0.0, DT)
            right += np.dot(bar.push, done.push) + bar.turn * done.turn
    left, size = inner(y, out, LAYOUT)
    assert abs(left) > 1e-3 * size and abs(left - right) <= TOLERANCE * size


@pytest.mark.parametrize("walls", ["free-slip", "periodic,no-slip"])
def test_growths_are_transposed_with_respect_to_their_rates(device, walls):
    """Their mean taken off, with a weight and without."""
    paint = Painted(np.random.default_rng(3).random((18, 23)))
    forces = [
        Growth((0.3, 0.4), 2.0, 0.15),
        Growth((0.9, 0.1), -3.0, 0.2),
        Growth((0.6, 0.6), 1.5, 0.3, weight=paint),
    ]
    impulses, _ = acting(forces, device, walls)
    (y,), (b,) = noise(LAYOUT, device, 1, 1), vector(LAYOUT, device, 1)
    impulses.prescribe(b)
    impulses.prescribe_adjoint(wp.array(-y.numpy(), dtype=Real, device=device))
    bars = one_step(impulses.gradients, impulses)
    right = sum(
        gaussian_impulse_of(bars[n]).swell * force.impulse(0.0, DT).swell for n, force in enumerate(forces)
    )
    left, size = inner([y], [b], LAYOUT)
    assert abs(to_numpy(b, LAYOUT).sum()) < 1e-11 and size > 1
    assert abs(left) > 1e-3 * size and abs(left - right) <= TOLERANCE * size


@pytest.mark.parametrize("walls", ["free-slip", "periodic,no-slip"])
def test_sources_are_transposed_with_respect_to_what_they_pour(device, walls):
    paint = Painted(np.random.default_rng(3).random((18, 23)))
    sources = [
        Source((0.3, 0.4), 2.0, 0.15),
        PaintedSource(paint),
        Source((0.95, 0.68), -3.0, 0.2),
    ]
    impulses, _ = acting((), device, walls, [Density("ink"), Density("smoke", sources=sources)])
    (y,), (rho,) = noise(LAYOUT, device, 1, 1), vector(LAYOUT, device, 1)
    impulses.sources[1].add(rho)
    impulses.sources[1].adjoint(y)
    (none, bars) = impulses.source_gradients(impulses.numbers.numpy()[None], impulses.bars.numpy()[None])
    round_ones = [gaussian_impulse_of(bars[n][0]).amount for n in (0, 2)]
    right = DT * (2.0 * round_ones[0] - 3.0 * round_ones[1] + bars[1][0, 0])
    left, size = inner([y], [rho], LAYOUT)
    assert none == {} and abs(left) > 1e-3 * size and abs(left - right) <= TOLERANCE * size


STEP = 3e-4
"""Of differences of fourth order: what a Gaussian of radius 0.13 and more adds has fifth derivatives below
about 10 / 0.13^5 = 3e5 of its strength at some 100 points, so their error, STEP^4 / 30 of the sum, is
about 1e-8; the rounding of the sum, eps 100 / STEP, 1e-10."""

BLOBS = [
    GaussianImpulse((0.31, 0.42), 0.13, push=(1.5, -0.8), turn=0.7, swell=1.2, amount=0.9),
    GaussianImpulse((0.93, 0.05), 0.21, push=(-0.4, 1.1), turn=-1.3, swell=-0.7, amount=1.4),
]


WIDE = [
    replace(BLOBS[0], center=(0.5 * GRID.hx, 4.5 * GRID.hy), radius=0.3),
    replace(BLOBS[1], center=(4.0 * GRID.hx, 0.0), radius=0.9),
]
"""Images of these count everywhere on periodic axes; faces and centres lie exactly opposite their centers."""


def changed(blob, name, by):
    """The blob with one of its numbers changed."""
    if name in ("x", "y"):
        x, y = blob.center
        return replace(blob, center=(x + by * (name == "x"), y + by * (name == "y")))
    if name in ("push_x", "push_y"):
        x, y = blob.push
        return replace(blob, push=(x + by * (name == "push_x"), y + by * (name == "push_y")))
    return replace(blob, **{name: getattr(blob, name) + by})


def number(bar, name):
    pairs = {"x": bar.center[0], "y": bar.center[1], "push_x": bar.push[0], "push_y": bar.push[1]}
    return pairs[name] if name in pairs else getattr(bar, name)


@pytest.mark.parametrize("walls", ["free-slip", "periodic", "periodic,no-slip"])
@pytest.mark.parametrize("kind", ["push", "swell", "pour"])
@pytest.mark.parametrize("pair", [BLOBS, WIDE], ids=["one in a corner", "wide"])
def test_moments_hold_the_gradient_with_respect_to_every_number(device, kind, walls, pair):
    """Of <y, what two Gaussians add> against differences of fourth order."""
    blobs = GaussianBatch(2, GRID, Walls.parse(walls), device, gradients=True)
    numbers, moments = (wp.zeros(n, dtype=Real, device=device) for n in (blobs.numbers, blobs.moments))
    boxes = wp.zeros(blobs.boxes, dtype=wp.int32, device=device)
    blobs.bind(numbers, boxes, moments)
    count = 2 if kind == "push" else 1
    y = noise(LAYOUT, device, count, 1)

    def value(all_of_them):
        for values, array in zip(blobs.row(all_of_them), (numbers, boxes), strict=True):
            array.assign(values)
        out = vector(LAYOUT, device, count)
        blobs.push(out) if kind == "push" else getattr(blobs, kind)(*out)
        return inner(y, out, LAYOUT)[0]

    names = {"push": ["push_x", "push_y", "turn"], "swell": ["swell"], "pour": ["amount"]}[kind]
    value(pair)
    blobs.measure_push(y) if kind == "push" else blobs.measure_centres(*y)
    table = getattr(blobs, f"{kind}_gradient")(numbers.numpy()[None], moments.numpy()[None])
    for n in range(len(pair)):
        bar = gaussian_impulse_of(table[:, 0, n])
        for name in ("x", "y", "radius", *names):

            def moved(by, n=n, name=name):
                return value([changed(b, name, by) if m == n else b for m, b in enumerate(pair)])

            near, far = (moved(by) - moved(-by) for by in (STEP, 2 * STEP))
            expected = (8 * near - far) / (12 * STEP)
            assert number(bar, name) == pytest.approx(expected, rel=1e-7, abs=1e-7), (n, name)
