"""The picture look-up against OpenImageIO's st_warp and OpenCV's remap."""

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import from_numpy
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.pictures.picture import Picture
from wfluid.view.lookup import LookUp

WIDTH, HEIGHT = 96, 70


def picture(channels=3, seed=0):
    """Smooth noise: sharp enough to tell filters apart."""
    rng = np.random.default_rng(seed)
    return Picture(rng.random((HEIGHT, WIDTH, channels)).astype(np.float32))


def moved_state(device, walls, size=0.04):
    """A state whose map is a smooth wobble on a grid that is not the picture's."""
    grid = Grid.for_picture(WIDTH, HEIGHT, 40)
    state = State.at_rest(grid, device)
    x, y = (np.arange(grid.nx) + 0.5) * grid.hx, (np.arange(grid.ny)[:, None] + 0.5) * grid.hy
    d_x = size * np.sin(2 * np.pi * x) * np.cos(3 * y) / grid.hx
    d_y = size * np.sin(np.pi * y / grid.height) * np.cos(5 * x) / grid.hy
    for values, f, rules in (
        (d_x, state.d_x, walls.displacement_x_rules()),
        (d_y, state.d_y, walls.displacement_y_rules()),
    ):
        from_numpy(values, f, state.layout)
        Ghosts(state.layout, rules, device).fill(f)
    return state


def psnr(a, b):
    return -10 * np.log10(max(np.mean((np.asarray(a, float) - b) ** 2), 1e-30))


def inner(source, margin):
    """Pixels whose source lies `margin` px inside the picture: st_warp knows no edges."""
    x, y = source[..., 0], source[..., 1]
    return (x > margin) & (x < WIDTH - 1 - margin) & (y > margin) & (y < HEIGHT - 1 - margin)


@pytest.mark.parametrize(
    ("filter", "name", "width"),
    [("bilinear", "triangle", 2.0), ("cubic", "catmull-rom", 4.0), ("lanczos", "lanczos3", 6.0)],
)
def test_look_up_equals_st_warp(device, filter, name, width):
    """More than 60 dB on white noise, the hardest picture, with OpenImageIO reading the same map."""
    walls = Walls()
    state, image = moved_state(device, walls), picture()
    look_up = LookUp(image, state.grid, walls, device, filter=filter)
    source = look_up.source_of(state.d_x, state.d_y)
    got = look_up.render(state.d_x, state.d_y).pixels
    st = np.stack([(source[..., 0] + 0.5) / WIDTH, 1 - (source[..., 1] + 0.5) / HEIGHT], axis=2)
    expected = oiio.ImageBufAlgo.st_warp(
        oiio.ImageBuf(image.pixels), oiio.ImageBuf(st.astype(np.float32)), name, width, flip_t=True
    ).get_pixels(oiio.FLOAT)
    here = inner(source, 3)
    assert here.mean() > 0.7
    assert psnr(got[here], expected[here]) > 60


def test_bilinear_look_up_equals_opencv(device):
    """Before version 5 it rounds fractions to 1/32 px: on noise of range 1 that is 1/32 an axis."""
    cv2 = pytest.importorskip("cv2")
    walls = Walls()
    state, image = moved_state(device, walls), picture()
    look_up = LookUp(image, state.grid, walls, device, filter="bilinear")
    source = look_up.source_of(state.d_x, state.d_y).astype(np.float32)
    expected = cv2.remap(image.pixels, source[..., 0], source[..., 1], cv2.INTER_LINEAR)
    here = inner(source, 1)
    difference = np.abs(look_up.render(state.d_x, state.d_y).pixels - expected)[here]
    exact = int(cv2.__version__.split(".")[0]) >= 5
    assert difference.max() < (1e-4 if exact else 2 / 32)


@pytest.mark.parametrize("filter", ["nearest", "bilinear", "cubic"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_the_identity_map_returns_the_picture(device, filter, channels):
    image, walls = picture(channels), Walls()
    state = State.at_rest(Grid.for_picture(WIDTH, HEIGHT, 31), device)
    got = LookUp(image, state.grid, walls, device, filter=filter).render(state.d_x, state.d_y)
    np.testing.assert_array_equal(got.pixels, image.pixels)


@pytest.mark.parametrize("filter", ["nearest", "bilinear", "cubic"])
@pytest.mark.parametrize(("edge", "mode"), [("clamp", "edge"), ("mirror", "symmetric"), ("wrap", "wrap")])
def test_edges_continue_the_picture(device, filter, edge, mode):
    """A shift by whole pixels that reaches beyond every edge equals np.pad's continuation."""
    right, down = 30, -20
    image, walls = picture(3), Walls.parse("periodic")  # ghosts of a uniform displacement are itself
    grid = Grid.for_picture(WIDTH, HEIGHT, WIDTH)
    state = State.at_rest(grid, device)
    for pixels, cells, f in ((right, grid.nx / WIDTH, state.d_x), (down, grid.ny / HEIGHT, state.d_y)):
        f.fill_(pixels * cells)
    look_up = LookUp(image, grid, walls, device, filter=filter)
    look_up.edges[:] = LookUp(image, grid, Walls(), device, filter=filter, edge=edge).edges
    look_up._replay = CapturedGraph(device, look_up._look_up, None)
    got = look_up.render(state.d_x, state.d_y).pixels
    padded = np.pad(image.pixels, ((100, 100), (100, 100), (0, 0)), mode=mode)
    expected = padded[100 + down : 100 + down + HEIGHT, 100 + right : 100 + right + WIDTH]
    np.testing.assert_allclose(got, expected, atol=3e-5)


def test_beyond_a_transparent_edge_there_is_nothing(device):
    """An RGB picture gains an alpha channel: zero outside, one inside, and no colour without it."""
    grid, walls = Grid.for_picture(WIDTH, HEIGHT, WIDTH), Walls()
    state = State.at_rest(grid, device)
    state.d_x.fill_(40.0)
    got = LookUp(picture(3), grid, walls, device, edge="transparent").render(state.d_x, state.d_y)
    assert got.alpha == 3
    middle = got.pixels[HEIGHT // 2]
    assert np.all(middle[60:90] == 0)
    np.testing.assert_allclose(middle[10:50, 3], 1, atol=1e-6)


@pytest.mark.parametrize("scale", [0.5, 1.7])
def test_rendering_at_another_size_samples_the_same_places(device, scale):
    """A linear ramp stays one at any output size: source coordinates scale with the picture."""
    x = (np.arange(WIDTH) + 0.5) / WIDTH
    ramp = Picture(np.broadcast_to(x[None, :, None], (HEIGHT, WIDTH, 1)).astype(np.float32).copy())
    state = State.at_rest(Grid.for_picture(WIDTH, HEIGHT, 32), device)
    width, height = round(WIDTH * scale), round(HEIGHT * scale)
    got = LookUp(ramp, state.grid, Walls(), device, width=width, height=height).render(state.d_x, state.d_y)
    expected = (np.arange(width) + 0.5) / width
    inside = slice(4, -4)
    assert got.pixels.shape == (height, width, 1)
    np.testing.assert_allclose(got.pixels[height // 2, inside, 0], expected[inside], atol=1e-5)


def test_sources_of_nonsense_are_survived(device):
    """NaN and infinite displacements read some pixel of the picture, never memory beyond it."""
    state = State.at_rest(Grid.for_picture(WIDTH, HEIGHT, 32), device)
    state.d_x.fill_(float("nan"))
    state.d_y.fill_(float("inf"))
    for filter in ("nearest", "bilinear", "cubic"):
        LookUp(picture(3), state.grid, Walls(), device, filter=filter).render(state.d_x, state.d_y)
