"""Pictures through files: types, channels, linear light, alpha."""

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid import colour
from wfluid.picture import Picture, PictureError, read_picture, write_picture

KINDS = {"float16": "half", "float32": "float"}


def store(path, values, attributes=()):
    """Write a file with OpenImageIO directly."""
    spec = oiio.ImageSpec(
        values.shape[1], values.shape[0], values.shape[2], KINDS.get(values.dtype.name, values.dtype.name)
    )
    for name, value in attributes:
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(values) and out.close()


def random_values(dtype, channels, seed=0):
    rng = np.random.default_rng(seed)
    if np.dtype(dtype).kind == "u":
        return rng.integers(0, np.iinfo(dtype).max + 1, (13, 17, channels)).astype(dtype)
    return (rng.random((13, 17, channels)) * 3 - 0.5).astype(dtype)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("ending", "dtype"),
    [
        ("png", "uint8"),
        ("png", "uint16"),
        ("tif", "uint8"),
        ("tif", "uint16"),
        ("tif", "float32"),
        ("exr", "float16"),
        ("exr", "float32"),
    ],
)
def test_read_then_write_returns_the_stored_numbers(tmp_path, ending, dtype, channels):
    values = random_values(dtype, channels)
    if channels in (2, 4) and np.dtype(dtype).kind == "u":
        values[..., -1] = np.maximum(
            values[..., -1], np.iinfo(dtype).max // 2
        )  # little alpha keeps no colour
    store(tmp_path / f"a.{ending}", values, [("oiio:UnassociatedAlpha", 1)] if "uint" in dtype else ())
    write_picture(tmp_path / f"b.{ending}", read_picture(tmp_path / f"a.{ending}"))
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    back = oiio.ImageInput.open(str(tmp_path / f"b.{ending}"), hints)
    assert str(back.spec().format) == KINDS.get(dtype, dtype)
    got = back.read_image(0, 0, 0, channels, back.spec().format).reshape(values.shape)
    if np.dtype(dtype).kind == "u":
        assert np.abs(got.astype(int) - values.astype(int)).max() <= (
            0 if channels in (1, 3) or dtype == "uint8" else 1
        )
    else:
        np.testing.assert_array_equal(got.view(values.dtype) if got.dtype != values.dtype else got, values)


def test_integers_are_srgb_and_floats_linear(tmp_path):
    store(tmp_path / "a.png", np.full((2, 2, 3), 188, np.uint8))
    store(tmp_path / "a.exr", np.full((2, 2, 3), 0.5, np.float32))
    assert read_picture(tmp_path / "a.png").pixels[0, 0, 0] == pytest.approx(0.5029, abs=1e-4)
    assert read_picture(tmp_path / "a.exr").pixels[0, 0, 0] == 0.5


def test_unassociated_alpha_is_linearised_then_premultiplied(tmp_path):
    """Colour 188 at alpha 128/255: 0.5029 in linear light, times 0.502."""
    values = np.full((2, 2, 4), 188, np.uint8)
    values[..., 3] = 128
    store(tmp_path / "a.png", values, [("oiio:UnassociatedAlpha", 1)])
    picture = read_picture(tmp_path / "a.png")
    assert picture.alpha == 3
    assert picture.pixels[0, 0] == pytest.approx([0.5029 * 128 / 255] * 3 + [128 / 255], abs=1e-4)


def test_the_fast_encoding_is_the_exact_one():
    """The table over the square root gives the code of the exact formula; each code returns to itself."""
    codes = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(colour.encode(colour.decode(codes, srgb=True), "uint8", srgb=True), codes)
    linear = np.random.default_rng(0).random(200_000).astype(np.float32)
    exact = colour.to_srgb(linear).astype(float) * 255
    assert np.abs(colour.encode(linear, "uint8", srgb=True) - exact).max() < 0.5 + 2e-2
    wide = np.arange(65536, dtype=np.uint16)
    np.testing.assert_array_equal(colour.encode(colour.decode(wide, srgb=True), "uint16", srgb=True), wide)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("none.png", None, "no such picture"),
        ("empty.png", b"", "is empty"),
        ("text.jpg", b"this is no picture at all\n", "not a picture"),
    ],
)
def test_unreadable_pictures_are_refused_by_name(tmp_path, name, content, says):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(PictureError, match=says) as refusal:
        read_picture(tmp_path / name)
    assert name in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_folder_is_not_a_picture(tmp_path):
    with pytest.raises(PictureError, match="a folder"):
        read_picture(tmp_path)


def test_a_failed_write_leaves_nothing(tmp_path):
    (tmp_path / "kept.png").write_bytes(b"as it was")
    with pytest.raises(PictureError):
        write_picture(tmp_path / "kept.png", Picture(np.zeros((0, 0, 3), np.float32)))
    assert [path.name for path in tmp_path.iterdir()] == ["kept.png"]
    assert (tmp_path / "kept.png").read_bytes() == b"as it was"


def test_unknown_endings_are_refused_with_the_known_ones(tmp_path):
    with pytest.raises(PictureError, match=r"\.png"):
        write_picture(tmp_path / "a.xyz", Picture(np.zeros((4, 4, 3), np.float32)))
