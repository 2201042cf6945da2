"""Paths, images of Pillow and arrays are taken as pictures, and pictures as arrays."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from wfluid import Density, Freeze, ImageForce, Painted, Picture, PictureError, read_picture, write_picture
from wfluid.pictures import color

CAT = Path(__file__).parents[2] / "examples" / "images" / "cat.png"


@dataclass
class Pillow:
    """What of Pillow's images is used: mode, size, numbers and conversion."""

    mode: str
    numbers: np.ndarray
    info: dict = field(default_factory=dict)
    asked: str = ""

    @property
    def size(self):
        return self.numbers.shape[1], self.numbers.shape[0]

    @property
    def __array_interface__(self):
        return self.numbers.__array_interface__

    def convert(self, mode):
        channels = {"L": 1, "RGB": 3, "RGBA": 4}[mode]
        return Pillow(mode, np.repeat(self.numbers[..., None] // 2, channels, axis=2), asked=mode)


def test_a_path_is_the_picture_of_its_file():
    for path in (CAT, str(CAT)):
        np.testing.assert_array_equal(Picture.of(path).pixels, read_picture(CAT).pixels)
    assert Picture.of(CAT, "linear").pixels.max() == pytest.approx(read_picture(CAT, "linear").pixels.max())
    picture = read_picture(CAT)
    assert Picture.of(picture) is picture


@pytest.mark.parametrize("shape", [(3, 5), (3, 5, 1), (3, 5, 2), (3, 5, 3), (3, 5, 4)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_arrays_are_srgb_and_come_back_as_they_went_in(shape, dtype):
    rng = np.random.default_rng(1)
    if np.issubdtype(dtype, np.integer):
        top = np.iinfo(dtype).max
        array = rng.integers(1, top, shape, endpoint=True).astype(dtype)
    else:
        top, array = 1.0, rng.uniform(0.01, 1, shape).astype(dtype)
    picture = Picture.of(array)
    alpha = {2: 1, 4: 3}.get(shape[2] if len(shape) == 3 else 1)
    assert (picture.width, picture.height, picture.alpha) == (5, 3, alpha)
    straight = array.reshape(3, 5, -1) / top
    opacity = straight[..., [alpha]] if alpha else 1.0
    np.testing.assert_allclose(
        picture.pixels[..., picture.color_channels],
        (color.to_linear(straight) * opacity)[..., picture.color_channels],
        atol=1e-6,
    )
    back = np.asarray(picture)
    assert back.shape == picture.pixels.shape and back.dtype == (dtype if top > 1 else np.float32)
    np.testing.assert_allclose(back, array.reshape(back.shape), rtol=0, atol=0 if top > 1 else 2e-6)


def test_light_and_data_are_taken_as_they_are():
    array = np.array([[0.25, 3.0]])
    np.testing.assert_array_equal(Picture.of(array, "linear").pixels[..., 0], np.float32(array))
    data = Picture.of(np.float32([[[0.2, 0.5]]]), "data")
    assert data.data and data.alpha is None and data.pixels.tolist() == np.float32([[[0.2, 0.5]]]).tolist()


def test_true_is_white_and_the_array_may_change_afterwards():
    mask = np.array([[True, False]])
    assert Picture.of(mask).pixels[0, :, 0].tolist() == [1, 0]
    light = np.float32([[0.5]])
    picture = Picture.of(light, "linear")
    light[:] = 0
    assert picture.pixels.item() == 0.5


def test_images_of_pillow_are_taken():
    codes = np.random.default_rng(2).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    np.testing.assert_array_equal(np.asarray(Picture.of(Pillow("RGB", codes))), codes)
    np.testing.assert_array_equal(np.asarray(Picture.of(Pillow("L", codes[..., 0])))[..., 0], codes[..., 0])
    palette = codes[..., 0]
    assert Picture.of(Pillow("P", palette)).alpha is None
    assert Picture.of(Pillow("P", palette, {"transparency": 0})).alpha == 3
    np.testing.assert_array_equal(np.asarray(Picture.of(Pillow("P", palette)))[..., 1], palette // 2)
    assert Picture.of(Pillow("1", palette)).pixels.shape == (4, 6, 1)

    class Bare:
        mode, size, __array_interface__ = "CMYK", (6, 4), palette.__array_interface__

    with pytest.raises(TypeError, match=r'an image of mode CMYK: write image.convert\("RGB"\)'):
        Picture.of(Bare())


def test_a_picture_becomes_an_array_of_another_type_as_numpy_converts():
    picture = read_picture(CAT)
    codes = np.asarray(picture)
    assert codes.dtype == np.uint8 and codes.shape == (300, 451, 3)
    np.testing.assert_array_equal(np.asarray(picture, dtype=float), codes.astype(float))
    with pytest.raises(ValueError, match=r"write np.asarray\(picture\)"):
        np.array(picture, copy=False)


@pytest.mark.parametrize(
    ("thing", "error", "says"),
    [
        (None, TypeError, "as a path, a Picture, an image of Pillow or an array .*; got NoneType"),
        (3, TypeError, "got int"),
        ([[0, 1]], TypeError, "got list"),
        (np.zeros((4, 5), int), TypeError, r"an array of int64: write array.astype\(np.uint8\)"),
        (np.zeros((3, 40, 50)), PictureError, r"write array.transpose\(1, 2, 0\)"),
        (np.zeros((4, 40, 50, 3)), PictureError, r"shape \(4, 40, 50, 3\): expected \(height, width\)"),
        (np.zeros((0, 5)), PictureError, "expected"),
        (np.full((2, 2), 200.0), PictureError, "up to 200: expected 0 … 1; divide codes by 255"),
        (np.array([[np.nan, 0.5]]), PictureError, "1 values are not finite"),
        ("no/such.png", PictureError, "no such picture"),
    ],
)
def test_what_is_no_picture_is_refused_in_one_line(thing, error, says):
    with pytest.raises(error, match=says) as refused:
        Picture.of(thing)
    assert "\n" not in str(refused.value)


def test_masks_and_weights_are_taken_as_pictures_too():
    codes = np.array([[0, 255], [51, 0]], np.uint8)
    wanted = codes / 255
    for mask in (codes, Pillow("L", codes), Picture.of(codes), wanted, wanted.tolist()):
        np.testing.assert_allclose(Painted(mask).values, wanted, atol=1e-6)
        np.testing.assert_allclose(Freeze(mask).paint.values, wanted, atol=1e-6)
        np.testing.assert_allclose(Density(initial=mask).initial.values, wanted, atol=1e-6)
        if not isinstance(mask, list):
            ImageForce(mask)
    assert Painted(CAT).values.shape == (300, 451)
    assert Painted(np.array([[0.0, 300.0]])).values.max() == 300  # floats are plain values
    with pytest.raises(TypeError, match=r"Freeze.mask: expected a picture.* got NoneType"):
        Freeze(None)


def test_an_array_is_written_as_a_picture(tmp_path):
    codes = np.random.default_rng(3).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    write_picture(tmp_path / "a.png", codes)
    np.testing.assert_array_equal(np.asarray(read_picture(tmp_path / "a.png")), codes)
