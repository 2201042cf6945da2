"""The picture misfit: its value is that of the rendered frame, its gradient that of its value."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.layout import HALO

from wfluid.animation.animation import Animation
from wfluid.domain.envelopes import Constant
from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import from_numpy, interior, read, to_numpy
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.gradient.functional import Functional
from wfluid.gradient.picture_misfit import PictureMisfit
from wfluid.gradient.variables import Free
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.pictures.picture import Picture
from wfluid.step.inertial import InertialStep
from wfluid.system.threads import free_cores, helpers
from wfluid.view.lookup import LookUp
from wfluid.view.lookup_adjoint import LookUpAdjoint

FILTERS = ("bilinear", "cubic")
EDGES = ("clamp", "mirror", "wrap", "transparent")
WIDTH, HEIGHT = 40, 29
"""Of pictures [px]."""


def smooth(width, height, channels=3, alpha=None, phase=0.0):
    """A picture of waves, one over each side: smooth where an axis wraps, too."""
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height)[:, None] + 0.5) / height
    waves = [
        0.5 + 0.3 * np.sin(2 * np.pi * x + n + phase) * np.cos(2 * np.pi * y + 2 * n - phase)
        for n in range(channels)
    ]
    return Picture(np.stack(waves, axis=2).astype(np.float32), alpha)


def noise(width, height, channels=3, seed=0):
    return Picture(np.random.default_rng(seed).random((height, width, channels)).astype(np.float32))


def moved_state(device, grid, walls, size=0.06):
    """A state whose map is a smooth wobble."""
    state = State.at_rest(grid, device)
    x, y = (np.arange(grid.nx) + 0.5) / grid.nx, (np.arange(grid.ny)[:, None] + 0.5) / grid.ny
    d_x = size / grid.hx * np.sin(2 * np.pi * x + 0.3) * np.cos(2 * np.pi * y)
    d_y = size / grid.hy * np.sin(2 * np.pi * y - 0.4) * np.cos(2 * np.pi * x)
    put(state, d_x, d_y, walls)
    return state


def put(state, d_x, d_y, walls):
    """Give a state a displacement [cells], with ghosts."""
    for values, f, rules in (
        (d_x, state.d_x, walls.displacement_x_rules()),
        (d_y, state.d_y, walls.displacement_y_rules()),
    ):
        from_numpy(values, f, state.layout)
        Ghosts(state.layout, rules, f.device).fill(f)


def with_ghosts(f, layout):
    """All of a field that has a row and a column: (ny + 4, pitch)."""
    rows = layout.ny + 2 * HALO
    return f.numpy()[: rows * layout.pitch].reshape(rows, layout.pitch)


CASES = {
    "as large": {},
    "smaller": {"size": (23, 17)},
    "larger": {"size": (70, 51)},
    "narrower and higher": {"size": (31, 40)},
    "one row": {"size": (9, 1)},
    "bilinear": {"filter": "bilinear"},
    "mirrored": {"edge": "mirror"},
    "wrapped": {"edge": "wrap"},
    "an alpha gained": {"edge": "transparent", "wanted": 4},
    "an alpha kept": {"edge": "transparent", "channels": 4, "wanted": 4, "alpha": 3},
    "one channel": {"channels": 1, "wanted": 1},
    "seven channels": {"channels": 7, "wanted": 7, "alpha": 3},
    "eight and an alpha gained": {"channels": 8, "wanted": 9, "edge": "transparent"},
    "periodic": {"walls": "periodic"},
    "no slip": {"walls": "no-slip,periodic", "size": (50, 33)},
    "weighed": {"weight": (WIDTH, HEIGHT)},
    "weighed by a painting of another size": {"weight": (7, 5), "size": (31, 40)},
}


@pytest.mark.parametrize("name", CASES)
def test_the_value_is_that_of_the_rendered_frame(device, name):
    """The pixels are those of a frame to the bit, before its alpha is clamped.

    Differences, squares and weights round four times, sums along a row of n positive numbers n times, all
    relative to what they are of.
    """
    case = {"size": (WIDTH, HEIGHT), "channels": 3, "wanted": 3, "alpha": None, "walls": "free-slip"}
    case |= {"filter": "cubic", "edge": "clamp", "weight": None} | CASES[name]
    picture = Picture(noise(WIDTH, HEIGHT, case["channels"]).pixels, case["alpha"])
    target = noise(*case["size"], case["wanted"], seed=1)
    fluid = Fluid(walls=case["walls"])
    how = {"filter": case["filter"], "edge": case["edge"]}
    animation = Animation(
        picture, fluid, [], Timeline(1), 24, target.width, target.height, **how, device=device.alias
    )
    stages = InertialStep(animation.grid, fluid, device)
    state = moved_state(device, animation.grid, fluid.walls)
    weight, factor = None, np.ones((target.height, target.width))
    if case["weight"]:
        weight = Painted(noise(*case["weight"], 1, seed=2).pixels[..., 0], scale=2.0)
        factor = weight.resampled(target.width, target.height)
        assert factor.std() > 0.05
    term = PictureMisfit(picture, target, 1.0, **how, weight=weight).term(stages, 3.0, slice(0, 0))
    term.measure(state)
    frame = animation.look_up(picture).interpolate(state.d_x, state.d_y).pixels
    squares = factor[..., None] * (frame.astype(np.float64) - target.pixels) ** 2
    area = animation.grid.width * animation.grid.height / (target.width * target.height)
    rounding = (target.width + 4) * float(np.finfo(np.float32).eps)
    assert term.value() == pytest.approx(3.0 * 0.5 * area * squares.sum(), rel=rounding)
    assert term.value() > 0.01


def test_the_value_does_not_depend_on_the_size_of_the_frame(device):
    """Of smooth pictures: means over more or fewer pixels are one integral, of waves to 1 % and better."""
    grid, fluid = Grid.for_picture(WIDTH, HEIGHT, 24), Fluid()
    state, values = moved_state(device, grid, fluid.walls), []
    for width, height in ((40, 58), (80, 29), (240, 174)):
        objective = PictureMisfit(smooth(240, 174), smooth(width, height, phase=1.0), 1.0)
        term = objective.term(InertialStep(grid, fluid, device), 1.0, slice(0, 0))
        term.measure(state)
        values.append(term.value())
    assert values == pytest.approx([values[-1]] * 3, rel=0.01)


def test_the_gradient_is_added_to_cells_and_no_ghost(device):
    """What is there stays, in ghosts and beside the map too; two calls give twice of one."""
    grid, fluid = Grid.for_picture(WIDTH, HEIGHT, 24), Fluid()
    term = PictureMisfit(smooth(40, 29), smooth(31, 40, phase=1.0), 1.0).term(
        InertialStep(grid, fluid, device), 1.0, slice(0, 0)
    )
    state, bar = moved_state(device, grid, fluid.walls), State.at_rest(grid, device)
    term.adjoint(state, bar)
    layout, cells = state.layout, np.s_[HALO : HALO + grid.ny, HALO : HALO + grid.nx]
    once = [with_ghosts(f, layout).copy() for f in (bar.d_x, bar.d_y)]
    for f in once:
        ghosts = f.copy()
        ghosts[cells] = 0
        assert np.all(ghosts == 0) and np.all(f[cells] != 0)
    term.adjoint(state, bar)
    for f, first in zip((bar.d_x, bar.d_y), once, strict=True):
        np.testing.assert_array_equal(with_ghosts(f, layout), 2 * first)
    assert not any(np.any(f.numpy()) for f in (bar.u, bar.v, bar.q))


SIZES = {
    "stretched": ((12, 9), (37, 23)),
    "shrunk": ((14, 11), (5, 4)),
    "mixed": ((13, 10), (11, 40)),
    "spans": ((70, 66), (131, 67)),
    "a pixel": ((4, 5), (1, 1)),
}


@pytest.fixture(params=SIZES)
def sizes(request):
    return SIZES[request.param]


@pytest.fixture(params=["free-slip", "no-slip", "periodic", "periodic,no-slip"])
def walls(request):
    return Walls.parse(request.param)


def seen_through(device, sizes, walls, **how):
    """A look-up of noise through random displacements, its adjoint and the state."""
    (nx, ny), (width, height) = sizes
    grid, random = Grid(nx, ny, 1.0, 0.8 * ny / nx), np.random.default_rng(5)
    look_up = LookUp(noise(30, 20), grid, walls, device, width=width, height=height, **how)
    state = State.at_rest(grid, device)
    put(state, *random.normal(size=(2, ny, nx)), walls)
    look_up.stretch(state.d_x, state.d_y)
    look_up.place()
    return look_up, LookUpAdjoint(look_up), state


def assert_transposed(out, out_bar, given, given_bar):
    """<M given, out_bar> = <given, M^T out_bar>, to rounding of sums of random signs."""
    scale = np.linalg.norm(out) * np.linalg.norm(out_bar)
    assert scale > 0
    assert abs(np.vdot(out, out_bar) - np.vdot(given, given_bar)) <= 1e-12 * scale


@pytest.mark.float64
def test_the_stretch_to_columns_of_pixels_is_transposed(device, sizes, walls):
    look_up, adjoint, state = seen_through(device, sizes, walls)
    placed = [to_numpy(f, look_up.layout) for f in look_up.coordinates]
    stretched = [to_numpy(f, look_up.strip) for f in look_up.stretched]
    state.d_x.zero_()
    state.d_y.zero_()
    look_up.stretch(state.d_x, state.d_y)
    look_up.place()
    bars = np.random.default_rng(6).normal(size=(2, look_up.height, look_up.width))
    for bar, f in zip(bars, adjoint.coordinates_bar, strict=True):
        from_numpy(bar, f, look_up.layout)
    adjoint.place()
    for axis in (0, 1):
        moved = placed[axis] - to_numpy(look_up.coordinates[axis], look_up.layout)
        found = to_numpy(adjoint.stretched_bar[axis], look_up.strip)
        assert_transposed(moved, bars[axis], stretched[axis], found)


@pytest.mark.float64
def test_the_stretch_to_rows_of_pixels_is_transposed(device, sizes, walls):
    look_up, adjoint, state = seen_through(device, sizes, walls)
    bars = np.random.default_rng(6).normal(size=(2, look_up.height, look_up.grid.nx))
    for bar, f in zip(bars, adjoint.stretched_bar, strict=True):
        from_numpy(bar, f, look_up.strip)
    bar = State.at_rest(look_up.grid, device)
    adjoint.stretch(bar.d_x, bar.d_y)
    for axis, name in enumerate(("d_x", "d_y")):
        out, given = to_numpy(look_up.stretched[axis], look_up.strip), getattr(state, name)
        found = to_numpy(getattr(bar, name), state.layout)
        assert_transposed(out, bars[axis], to_numpy(given, state.layout), found)


STEP = 1e-3
"""Of the differences [px]. They are of fourth order, exact for cubics; the rounding of pixels below 2 at
coordinates below 128 is 1.5 (2 eps + 128 eps slope) / STEP, below 2e-10 for slopes below 3 / px."""


@pytest.mark.float64
@pytest.mark.parametrize("filter", FILTERS)
@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("channels", [3, 7])
def test_the_slope_of_a_look_up_equals_differences(device, filter, edge, channels):
    """Anywhere in the picture and up to three times its size outside, where nothing has a kink nearby."""
    picture, grid, random = noise(30, 20, channels), Grid(8, 6), np.random.default_rng(3)
    look_up = LookUp(picture, grid, Walls(), device, width=75, height=60, filter=filter, edge=edge)
    adjoint, layout = LookUpAdjoint(look_up), look_up.layout
    sizes = np.array([[[30]], [[20]]])
    places = np.floor(random.uniform(-3 * sizes, 4 * sizes, size=(2, 60, 75)))
    places += random.uniform(0.01, 0.99, size=places.shape)

    def shown(places):
        """All channels, (height, width, …)."""
        for values, f in zip(places, look_up.coordinates, strict=True):
            from_numpy(values, f, layout)
        look_up.read()
        quads = [interior(read(out), layout) for out in look_up.shown]
        return np.concatenate(quads, axis=2)

    bars = random.normal(size=shown(places).shape)
    adjoint.begin()
    for n, first in enumerate(range(0, bars.shape[2], 4)):
        padded = np.zeros((layout.size, 4))
        rows = padded[: (layout.ny + 2 * HALO) * layout.pitch].reshape(-1, layout.pitch, 4)
        rows[HALO:-HALO, HALO : HALO + layout.nx] = bars[..., first : first + 4]
        adjoint.read(n, wp.array(padded, dtype=look_up.shown[n].dtype, device=device))
    for axis in (0, 1):
        by = np.zeros((2, 1, 1))
        by[axis] = STEP
        near, far = (shown(places + n * by) - shown(places - n * by) for n in (1, 2))
        expected = np.sum(bars * (8 * near - far) / (12 * STEP), axis=2)
        got = to_numpy(adjoint.coordinates_bar[axis], layout)
        assert np.abs(expected).max() > 1
        np.testing.assert_allclose(got, expected, atol=bars.shape[2] * 4 * 2e-10)


@pytest.mark.float64
@pytest.mark.parametrize("filter", FILTERS)
def test_a_place_too_far_away_has_no_slope(device, filter):
    """Where the look-up stops the coordinate, on every side; finite too, where it is not a number."""
    look_up = LookUp(noise(30, 20), Grid(8, 6), Walls(), device, filter=filter, edge="wrap")
    adjoint = LookUpAdjoint(look_up)
    far = np.resize([2e8, -3e8, np.inf, -np.inf, 1e8 + 0.5], (20, 30))
    for f in look_up.coordinates:
        from_numpy(far, f, look_up.layout)
    adjoint.begin()
    for n, shown in enumerate(look_up.shown):
        adjoint.read(n, wp.full_like(shown, 1.0))
    for f in adjoint.coordinates_bar:
        assert np.all(to_numpy(f, look_up.layout) == 0)


def of_two_forces(filter, edge, walls="free-slip", channels=3, alpha=None, frame=(31, 23), weight=None):
    """A functional of two forces that push a smooth picture for three steps.

    They are narrow: on a periodic axis only a force's nearest image counts, and half an axis away it jumps.
    """
    gains = edge == "transparent" and alpha is None
    forces = [
        GaussianForce((0.4, 0.3), (1.1, 0.7), 0.06, Constant(0, 0.2)),
        GaussianForce((0.7, 0.5), (-0.6, 0.9), 0.05, Constant(0, 0.2)),
    ]
    timeline = Timeline(0.15, 20, substeps=1)
    target = smooth(*frame, channels + gains, phase=0.7)
    picture = smooth(WIDTH, HEIGHT, channels, alpha)
    objective = PictureMisfit(picture, target, 0.15, filter, edge, weight)
    free = [Free("forces[*].vector"), Free("forces[*].center", scale=0.2)]
    fluid = Fluid(viscosity=0.001, walls=walls)
    return Functional(Grid(20, 14, 1.0, HEIGHT / WIDTH), fluid, forces, timeline, objective, free)


RUNS = {
    **{f"{filter}, {edge}": {"filter": filter, "edge": edge} for filter in FILTERS for edge in EDGES},
    **{
        f"{filter}, {walls}": {"filter": filter, "edge": "clamp", "walls": walls}
        for filter in FILTERS
        for walls in ("periodic", "periodic,free-slip", "no-slip")
    },
    "alpha": {"filter": "cubic", "edge": "transparent", "channels": 4, "alpha": 3},
    "six channels": {"filter": "cubic", "edge": "clamp", "channels": 6, "alpha": 3},
    "a smaller frame": {"filter": "cubic", "edge": "clamp", "frame": (17, 19)},
    "a larger frame": {"filter": "bilinear", "edge": "clamp", "frame": (55, 47)},
    "weighed": {"filter": "cubic", "edge": "clamp", "weight": Painted(np.eye(5))},
}


@pytest.mark.float64
@pytest.mark.parametrize("name", RUNS)
def test_the_gradient_leaves_a_remainder_of_second_order(name):
    """Taylor's: halving a step of the free numbers quarters what value and slope leave, rate 2, in the median
    of five directions. The steps are so small that hardly a pixel crosses a kink of the bilinear look-up, and
    so large that what they leave, 1e-5 of a step's change and more, is far above rounding.
    """
    functional, random = of_two_forces(**RUNS[name]), np.random.default_rng(1)
    start, rates = functional.start, []
    value, gradient = functional.value_and_gradient(start)
    assert value > 1e-4
    for _ in range(5):
        direction = random.normal(size=start.size)
        slope = gradient @ direction
        left = [
            abs(functional.value(start + h * direction) - value - h * slope) for h in (1e-4, 5e-5, 2.5e-5)
        ]
        rates.append(np.log2(left[0] / left[2]) / 2)
    assert 1.9 < np.median(rates) < 2.1, rates


@pytest.mark.skipif(free_cores() < 2, reason="two threads need two cores")
def test_two_threads_compute_the_bits_of_one(device):
    """Captured and replayed, value and gradient are those of launches one after the other."""
    if device.is_cuda:
        pytest.skip("strips are for CPU threads")
    grid, fluid = Grid(96, 72, 1.0, 0.75), Fluid()
    objective = PictureMisfit(noise(120, 90, 5), noise(150, 100, 5, seed=1), 1.0)
    term = objective.term(InertialStep(grid, fluid, device), 1.0, slice(0, 0))
    state = moved_state(device, grid, fluid.walls)
    still, bar, elsewhere = (State.at_rest(grid, device) for _ in range(3))

    def found():
        """Value and gradient, once they have been found."""
        value, arrays = term.value(), [f.numpy().copy() for f in (bar.d_x, bar.d_y)]
        for f in (bar.d_x, bar.d_y):
            f.zero_()
        return [np.array(value), *arrays]

    def put_aside():
        """Overwrite all that is kept on the way with what is of another state."""
        term.measure(still)
        term.adjoint(still, elsewhere)

    term.measure(state)
    term.adjoint(state, bar)
    one = found()
    assert all(np.any(a) for a in one)
    shared = helpers(2)
    measure = CapturedGraph(device, lambda: term.measure(state), shared)
    adjoint = CapturedGraph(device, lambda: term.adjoint(state, bar), shared)
    for _ in range(10):
        put_aside()
        adjoint.launch()
        put_aside()
        measure.launch()
        for a, b in zip(one, found(), strict=True):
            np.testing.assert_array_equal(b, a)


GOOD = SimpleNamespace(picture=smooth(8, 6), target=smooth(5, 7))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"filter": "nearest"}, "filter 'nearest' gives no gradient: expected one of bilinear, cubic"),
        ({"filter": "soft"}, "filter 'soft' gives no gradient: expected one of bilinear, cubic"),
        ({"edge": "torn"}, "edge 'torn': expected one of clamp, mirror, wrap, transparent"),
        ({"target": smooth(5, 7, 4)}, "target has 4 channels: expected the 3 of the warped picture"),
        ({"edge": "transparent"}, "target has 3 channels: expected the 4 of the warped picture, its alpha"),
        ({"target": Picture(np.zeros((5, 7), np.float32))}, r"target of shape (5, 7): expected (height, wid"),
        ({"target": Picture(np.full((5, 7, 3), np.nan))}, "PictureMisfit.target: a pixel is not finite"),
        ({"picture": Picture(np.full((5, 7, 3), np.inf))}, "PictureMisfit.picture: a pixel is not finite"),
    ],
)
def test_pictures_that_cannot_be_compared_are_refused_in_one_line(wrong, message):
    with pytest.raises(ValueError, match=re.escape(message)) as error:
        PictureMisfit(**(vars(GOOD) | {"time": 1.0} | wrong))
    assert "\n" not in str(error.value)
