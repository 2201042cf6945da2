"""Reading and writing pictures: types, channels, linear light, alpha."""

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.pictures import color
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture

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


def test_the_fast_encoding_equals_the_exact_one():
    """The table over the square root gives the code of the exact formula; each code returns to itself."""
    codes = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(color.encode(color.decode(codes, srgb=True), "uint8", srgb=True), codes)
    linear = np.random.default_rng(0).random(200_000).astype(np.float32)
    exact = color.to_srgb(linear).astype(float) * 255
    assert np.abs(color.encode(linear, "uint8", srgb=True) - exact).max() < 0.5 + 2e-2
    wide = np.arange(65536, dtype=np.uint16)
    np.testing.assert_array_equal(color.encode(color.decode(wide, srgb=True), "uint16", srgb=True), wide)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("none.png", None, "no such picture"),
        ("empty.png", b"", "is empty"),
        ("text.jpg", b"this is no picture at all\n", "not a picture"),
    ],
)
def test_unreadable_pictures_are_refused_with_their_name(tmp_path, name, content, says):
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


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_applied(tmp_path, orientation):
    """Red marks the top-left of the upright picture, green its top-right (EXIF 2.32, figure 15)."""
    upright = np.zeros((24, 40, 3), np.uint8)
    upright[:8, :8, 0] = 255
    upright[:8, -8:, 1] = 255
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: np.rot90(upright, 2),
        4: upright[::-1],
        5: np.rot90(upright[:, ::-1]),
        6: np.rot90(upright),
        7: np.rot90(upright[:, ::-1], -1),
        8: np.rot90(upright, -1),
    }[orientation]
    spec = oiio.ImageSpec(stored.shape[1], stored.shape[0], 3, "uint8")
    spec.attribute("Orientation", orientation)
    out = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    assert (
        out.open(str(tmp_path / "a.tif"), spec)
        and out.write_image(np.ascontiguousarray(stored))
        and out.close()
    )
    picture = read_picture(tmp_path / "a.tif")
    assert picture.pixels.shape == (24, 40, 3)
    np.testing.assert_array_equal(picture.pixels[2, 2], (1, 0, 0))
    np.testing.assert_array_equal(picture.pixels[2, -3], (0, 1, 0))
    write_picture(tmp_path / "b.tif", picture)
    np.testing.assert_array_equal(read_picture(tmp_path / "b.tif").pixels, picture.pixels)


def test_further_channels_metadata_and_windows_are_kept(tmp_path):
    """Seven channels with their names, an attribute, a display window larger than the data."""
    spec = oiio.ImageSpec(20, 12, 7, "float")
    spec.channelnames = ("R", "G", "B", "A", "Z", "id.x", "id.y")
    spec.alpha_channel = 3
    spec.x, spec.y, spec.full_width, spec.full_height = 5, 3, 64, 32
    spec.attribute("comment", "kept")
    values = (np.random.default_rng(0).random((12, 20, 7)) * 4 - 1).astype(np.float32)
    out = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_image(values) and out.close()
    picture = read_picture(tmp_path / "a.exr")
    assert picture.pixels.shape[2] == 7 and picture.pixels.min() < 0 and picture.pixels.max() > 1
    write_picture(tmp_path / "b.exr", picture)
    a, b = (oiio.ImageBuf(str(tmp_path / name)) for name in ("a.exr", "b.exr"))
    np.testing.assert_array_equal(a.get_pixels(oiio.FLOAT), b.get_pixels(oiio.FLOAT))
    for name in ("x", "y", "full_width", "full_height", "channelnames", "alpha_channel"):
        assert getattr(a.spec(), name) == getattr(b.spec(), name), name
    assert b.spec().get_string_attribute("comment") == "kept"
    write_picture(tmp_path / "c.png", picture)  # what a PNG has no room for is dropped
    assert oiio.ImageBuf(str(tmp_path / "c.png")).spec().nchannels == 4


def test_premultiplied_edges_do_not_darken(tmp_path, device):
    """A moved white disc on transparent black stays white wherever it is visible."""
    from wfluid import Fluid, GaussianForce, animate

    x, y = np.arange(80), np.arange(80)[:, None]
    alpha = np.clip(20 - np.hypot(x - 40, y - 40), 0, 1)
    values = np.zeros((80, 80, 4), np.uint8)
    values[..., :3] = np.where(alpha[..., None] > 0, 255, 0)
    values[..., 3] = np.rint(alpha * 255)
    spec = oiio.ImageSpec(80, 80, 4, "uint8")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(str(tmp_path / "a.png"))
    assert out.open(str(tmp_path / "a.png"), spec) and out.write_image(values) and out.close()
    push = GaussianForce((0.5, 0.5), (2.0, 1.0), 0.2)
    *_, last = animate(
        read_picture(tmp_path / "a.png"), Fluid(), [push], 0.4, 10, cells=40, device=device.alias
    )
    assert last.quality.displacement_max > 0.02
    write_picture(tmp_path / "b.png", last.picture)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    back = (
        oiio.ImageInput.open(str(tmp_path / "b.png"), hints)
        .read_image(0, 0, 0, 4, "uint8")
        .reshape(80, 80, 4)
    )
    visible = back[..., 3] > 12
    assert visible.sum() > 900
    assert back[visible][:, :3].min() >= 250


@pytest.mark.parametrize(("colorspace", "value"), [("auto", 0.2140), ("srgb", 0.2140), ("linear", 0.5)])
def test_a_flag_overrides_the_colorspace(tmp_path, colorspace, value):
    write_picture(tmp_path / "a.tif", Picture(np.full((4, 4, 3), 0.2140, np.float32), dtype="uint16"))
    assert read_picture(tmp_path / "a.tif", colorspace).pixels[0, 0, 0] == pytest.approx(value, abs=1e-3)


def test_types_compressions_and_qualities_reach_the_file(tmp_path):
    picture = Picture(np.random.default_rng(0).random((40, 40, 3)).astype(np.float32), dtype="uint8")
    for type_, compression in (("half", "piz"), ("float", "zips")):
        write_picture(tmp_path / "a.exr", picture, Encoding(type_, compression))
        spec = oiio.ImageBuf(str(tmp_path / "a.exr")).nativespec()
        assert (str(spec.format), spec.get_string_attribute("compression")) == (type_, compression)
    sizes = []
    for quality in (10, 95):
        write_picture(tmp_path / "a.jpg", picture, Encoding(quality=quality))
        sizes.append((tmp_path / "a.jpg").stat().st_size)
    assert sizes[0] < sizes[1] / 2
    with pytest.raises(PictureError, match=r"not for \.png"):
        write_picture(tmp_path / "a.png", picture, Encoding(compression="piz"))
