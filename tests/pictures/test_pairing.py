"""The second picture is fitted to the first one's frame, with the same channels."""

import numpy as np
import pytest

from wfluid import Picture
from wfluid.domain.limits import FITS
from wfluid.pictures.pairing import Window, alike, cropped, paired, window
from wfluid.pictures.picture import resample

SIZES = [
    ((60, 40), (60, 40)),
    ((61, 41), (30, 47)),
    ((40, 60), (64, 48)),
    ((7, 5), (300, 200)),
    ((301, 199), (33, 32)),
    ((1, 1), (300, 200)),
    ((3, 2), (2, 3)),
    ((2000, 1), (1, 2000)),
    ((1, 3000), (640, 480)),
]


@pytest.mark.parametrize(("size", "frame"), SIZES)
@pytest.mark.parametrize("how", FITS)
def test_a_window_has_the_frames_aspect_to_half_a_pixel_and_lies_in_the_middle(size, frame, how):
    """With "fill" the window lies within the picture, with "fit" around it; both touch it along one axis."""
    found = window(size, frame, how)
    x, y, width, height = found.x, found.y, found.width, found.height
    assert min(width, height) >= 1
    if how == "stretch":
        assert (x, y, width, height) == (0, 0, *size)
        return
    off = (abs(width - height * frame[0] / frame[1]), abs(height - width * frame[1] / frame[0]))
    assert min(off) <= 0.5 or 1 in (width, height), off
    assert abs(2 * x + width - size[0]) <= 1 and abs(2 * y + height - size[1]) <= 1
    assert width == size[0] or height == size[1]
    if how == "fill":
        assert x >= 0 and y >= 0 and x + width <= size[0] and y + height <= size[1]
    else:
        assert x <= 0 and y <= 0 and x + width >= size[0] and y + height >= size[1]


@pytest.mark.parametrize("how", FITS)
def test_a_picture_of_the_same_aspect_is_not_cropped(how):
    for size in ((60, 40), (3, 2), (1500, 1000)):
        assert window(size, (600, 400), how) == Window(0, 0, *size)


def test_a_fit_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="fit 'cover': expected one of fill, fit, stretch"):
        window((3, 2), (3, 2), "cover")


def noise(width, height, channels=3, seed=0):
    return Picture(np.random.default_rng(seed).random((height, width, channels)).astype(np.float32))


@pytest.mark.parametrize(
    "through",
    [
        Window(5, 0, 9, 12),
        Window(0, 3, 20, 6),
        Window(-4, 0, 28, 12),
        Window(0, -7, 20, 25),
        Window(-1, 2, 30, 5),
    ],
)
def test_cropping_gives_the_pixels_of_the_window_and_black_beyond(through):
    """Compared pixel by pixel with the definition."""
    picture = noise(20, 12)
    got = cropped(picture, through).pixels
    assert got.shape == (through.height, through.width, 3)
    for row in range(through.height):
        for column in range(through.width):
            x, y = through.x + column, through.y + row
            inside = 0 <= x < 20 and 0 <= y < 12
            np.testing.assert_array_equal(got[row, column], picture.pixels[y, x] if inside else 0)


def test_a_picture_that_is_not_cropped_is_the_same_object():
    picture = noise(20, 12)
    assert cropped(picture, Window(0, 0, 20, 12)) is picture
    assert cropped(picture, Window(1, 0, 19, 12)) is not picture


def test_bars_are_transparent_where_there_is_alpha():
    pair = paired(noise(10, 10), Picture(np.ones((4, 10, 4), np.float32), alpha=3), "fit")
    alpha = pair.b.pixels[..., pair.b.alpha]
    np.testing.assert_array_equal(alpha[:, 5], [0, 0, 0, 1, 1, 1, 1, 0, 0, 0])
    assert pair.window == Window(0, -3, 10, 10)


@pytest.mark.parametrize("how", FITS)
@pytest.mark.parametrize(
    ("size", "frame"), [((61, 40), (48, 48)), ((40, 75), (80, 60)), ((90, 31), (61, 47))]
)
def test_a_dot_appears_at_the_place_of_its_point(how, size, frame):
    """Painted into the second picture at p, stretched over the frame, its light is centred on place(p).

    Stretching by OpenImageIO's triangle filter, which keeps first moments within the picture.
    """
    (x, y), extent = (0.53 * size[0], 0.45 * size[1]), (frame[0] / max(frame), frame[1] / max(frame))
    columns, rows = np.arange(size[0]) + 0.5, (np.arange(size[1]) + 0.5)[:, None]
    dot = np.exp(-0.5 * ((columns - x) ** 2 + (rows - y) ** 2) / 2.0**2)[..., None].astype(np.float32)
    pair = paired(noise(*frame, channels=1), Picture(dot), how)
    shown = resample(pair.b.pixels, 8 * frame[0], 8 * frame[1])[..., 0].astype(np.float64)
    centre = [
        (shown.sum(axis=axis) * (np.arange(count) + 0.5)).sum() / shown.sum() / count * length
        for axis, count, length in ((0, 8 * frame[0], extent[0]), (1, 8 * frame[1], extent[1]))
    ]
    np.testing.assert_allclose(centre, pair.place((x, y), extent), rtol=0, atol=0.1 / max(frame))


def test_corners_of_the_window_are_corners_of_the_frame():
    pair = paired(noise(64, 48), noise(40, 60), "fill")
    w, extent = pair.window, (1.0, 0.75)
    for across, down in ((0, 0), (1, 0), (0, 1), (1, 1)):
        place = pair.place((w.x + across * w.width, w.y + down * w.height), extent)
        np.testing.assert_allclose(place, (across * extent[0], down * extent[1]), atol=1e-12)
    np.testing.assert_allclose(w.pixels(extent), (w.width / 1.0, w.height / 0.75))


@pytest.mark.parametrize("point", [(-0.1, 5), (40.1, 5), (5, -1), (5, 60.5), (float("nan"), 5)])
@pytest.mark.parametrize("how", FITS)
def test_a_point_outside_the_second_picture_is_refused(how, point):
    """Points in bars count as outside."""
    pair = paired(noise(64, 48), noise(40, 60), how)
    with pytest.raises(ValueError, match="of the second picture lies outside it, 40 x 60"):
        pair.place(point, (1.0, 0.75))


def test_a_cropped_point_is_refused_with_fill_and_accepted_with_fit():
    a, b = noise(64, 48), noise(40, 60)
    with pytest.raises(ValueError, match="the point 20,5 of the second picture is cut off: fit or stretch"):
        paired(a, b, "fill").place((20, 5), (1.0, 0.75))
    for how in ("fit", "stretch"):
        np.testing.assert_allclose(paired(a, b, how).place((20, 5), (1.0, 0.75)), (0.5, 0.75 / 12))


def test_pictures_of_one_kind_are_left_as_they_are():
    a, b = noise(4, 3), noise(4, 3, seed=1)
    one, other, said = alike(a, b)
    assert one is a and other is b and said == []


def with_alpha(picture, at):
    opacity = np.full((picture.height, picture.width, 1), 0.5, np.float32)
    return Picture(np.insert(picture.pixels, [at], opacity, axis=2), alpha=at)


@pytest.mark.parametrize("swapped", [False, True])
def test_grey_beside_colours_becomes_colours_with_a_note(swapped):
    grey, colours = noise(4, 3, 1), noise(4, 3, 3)
    pair = (colours, grey) if swapped else (grey, colours)
    found = alike(*pair)
    np.testing.assert_array_equal(found[swapped].pixels, np.repeat(grey.pixels, 3, axis=2))
    np.testing.assert_array_equal(found[not swapped].pixels, colours.pixels)
    assert found[2] == [
        f"the {('first', 'second')[swapped]} picture is grey, the other has colours: it is shown as colours"
    ]


@pytest.mark.parametrize("at", [0, 3])
@pytest.mark.parametrize("swapped", [False, True])
def test_a_picture_without_alpha_becomes_opaque_with_a_note(swapped, at):
    """For any position of alpha; colours keep their order."""
    clear, solid = with_alpha(noise(4, 3), at), noise(4, 3, seed=1)
    pair = (clear, solid) if swapped else (solid, clear)
    found = alike(*pair)
    one, other = found[swapped], found[not swapped]
    assert one.alpha == other.alpha == 3
    np.testing.assert_array_equal(one.pixels[..., 3], 1)
    np.testing.assert_array_equal(other.pixels[..., 3], 0.5)
    np.testing.assert_array_equal(one.pixels[..., :3], solid.pixels)
    np.testing.assert_array_equal(other.pixels[..., :3], noise(4, 3).pixels)
    assert len(found[2]) == 1 and "has no alpha" in found[2][0]
    assert found[2][0].startswith(f"the {('first', 'second')[swapped]} ")


def test_grey_without_and_colours_with_alpha_get_both():
    one, other, said = alike(noise(4, 3, 1), with_alpha(noise(4, 3), 3))
    assert one.pixels.shape == other.pixels.shape == (3, 4, 4) and len(said) == 2
    np.testing.assert_array_equal(one.pixels[..., :3], np.repeat(noise(4, 3, 1).pixels, 3, axis=2))


@pytest.mark.parametrize(("one", "other"), [(2, 3), (3, 2), (1, 2), (5, 3)])
def test_other_numbers_of_channels_are_refused(one, other):
    with pytest.raises(ValueError, match=f"{one} channels and {other}: pictures of one kind can be blended"):
        paired(noise(4, 3, one), noise(4, 3, other), "fill")


def test_data_and_colours_are_refused():
    numbers = Picture(noise(4, 3).pixels, data=True)
    for pair in ((numbers, noise(4, 3)), (noise(4, 3), numbers)):
        with pytest.raises(ValueError, match="one picture has colours, the other numbers"):
            alike(*pair)
