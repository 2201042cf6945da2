"""What formats store, brought to one convention on reading."""

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.pictures.formats import PictureError
from wfluid.pictures.stills import read_picture

WIDTH, HEIGHT = 16, 8
STRAIGHT = np.array([200, 100, 50])
"""Colour of the picture below before it is multiplied by alpha."""


def rgba(alphas=(255, 128, 64, 0)):
    """Four columns of one colour, of four opacities."""
    values = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    values[..., :3] = STRAIGHT
    values[..., 3] = np.repeat(alphas, WIDTH // len(alphas))
    return values


def save(path, values, dtype="uint8", names=None, alpha=None, pages=(), **attributes):
    """Write a file with OpenImageIO directly; further `pages` are appended."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], dtype)
    if names:
        spec.channelnames = names
        spec.alpha_channel = names.index("A") if "A" in names else -1
    if alpha is not None:
        spec.alpha_channel = alpha
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    specs = [spec, *(oiio.ImageSpec(p.shape[1], p.shape[0], p.shape[2], dtype) for p in pages)]
    opened = out.open(str(path), tuple(specs)) if pages else out.open(str(path), spec)
    assert opened and out.write_image(np.ascontiguousarray(values)), out.geterror()
    for page, one in zip(pages, specs[1:], strict=True):
        assert out.open(str(path), one, "AppendSubimage") and out.write_image(np.ascontiguousarray(page))
    assert out.close()


def bmp(path, values, header=124):
    """A BMP of 32 bits, with a header of version 5 (124 bytes) or without a place for alpha (40 bytes)."""
    height, width, _ = values.shape
    masks = struct.pack("<4I", 0xFF0000, 0xFF00, 0xFF, 0xFF000000) if header == 124 else b""
    kind = 3 if header == 124 else 0
    info = struct.pack("<IiiHHIIiiII", header, width, height, 1, 32, kind, 4 * width * height, 0, 0, 0, 0)
    info = (info + masks + (b"BGRs" if masks else b"")).ljust(header, b"\0")
    data = np.ascontiguousarray(values[::-1, :, [2, 1, 0, 3]]).tobytes()
    start = 14 + header
    path.write_bytes(b"BM" + struct.pack("<IHHI", start + len(data), 0, 0, start) + info + data)


def check_straight(picture, opacities=(1, 128 / 255, 64 / 255, 0), atol=1e-6):
    """The colour in linear light times alpha (IEC 61966-2-1)."""
    light = ((STRAIGHT / 255 + 0.055) / 1.055) ** 2.4
    assert picture.alpha == 3
    for n, opacity in enumerate(opacities):
        got = picture.pixels[4, n * WIDTH // len(opacities) + 1]
        np.testing.assert_allclose(got, [*(light * opacity), opacity], atol=atol)


def test_straight_alpha_is_known_in_every_format(tmp_path):
    for ending, attributes in (
        ("png", {"oiio__UnassociatedAlpha": 1}),
        ("tif", {"oiio__UnassociatedAlpha": 1}),
        ("tga", {"oiio__UnassociatedAlpha": 1}),
        ("jxl", {"oiio__UnassociatedAlpha": 1, "compression": "jpegxl:100"}),
    ):
        save(tmp_path / f"a.{ending}", rgba(), **attributes)
        check_straight(read_picture(tmp_path / f"a.{ending}"))
    bmp(tmp_path / "a.bmp", rgba())
    check_straight(read_picture(tmp_path / "a.bmp"))
    check_straight(read_picture(Path(__file__).with_name("straight.jp2")))


@pytest.mark.parametrize(("dtype", "top", "atol"), [("uint8", 255, 0.02), ("uint16", 65535, 1e-4)])
def test_associated_integers_are_divided_by_alpha_before_they_are_decoded(tmp_path, dtype, top, atol):
    """The product is one of encoded numbers (TIFF 6.0, section 18): 200 at one half is stored as 100."""
    values = rgba() / 255
    values[..., :3] *= values[..., 3:]
    save(tmp_path / "a.tif", np.rint(values * top).astype(dtype), dtype)
    check_straight(read_picture(tmp_path / "a.tif"), atol=atol)


def test_the_transparent_index_of_a_gif_is_alpha(tmp_path):
    """Two pixels, the second of which has the transparent index (GIF89a, sections 18 to 23)."""
    screen = b"GIF89a" + struct.pack("<HHBBB", 2, 1, 0x80, 0, 0) + bytes([*STRAIGHT, 9, 9, 9])
    control = bytes([0x21, 0xF9, 4, 1, 0, 0, 1, 0])
    image = b"\x2c" + struct.pack("<HHHHB", 0, 0, 2, 1, 0) + bytes([2, 2, 0x44, 0x0A, 0])
    (tmp_path / "a.gif").write_bytes(screen + control + image + b"\x3b")
    picture = read_picture(tmp_path / "a.gif")
    assert picture.alpha == 3 and picture.metadata.alpha_channel == 3 and picture.notes == ()
    np.testing.assert_allclose(picture.pixels[0, 0, 0], ((200 / 255 + 0.055) / 1.055) ** 2.4, atol=1e-6)
    np.testing.assert_array_equal(picture.pixels[0, 0, 3], 1)
    np.testing.assert_array_equal(picture.pixels[0, 1], 0)


@pytest.mark.parametrize("header", [40, 124])
def test_an_alpha_of_zero_all_over_is_padding(tmp_path, header):
    bmp(tmp_path / "a.bmp", rgba((0, 0)), header)
    picture = read_picture(tmp_path / "a.bmp")
    assert picture.alpha is None and picture.pixels.shape == (HEIGHT, WIDTH, 3)
    np.testing.assert_allclose(picture.pixels[0, 0, 0], ((200 / 255 + 0.055) / 1.055) ** 2.4, atol=1e-6)
    assert "opaque" in picture.notes[0]


def test_a_deep_picture_is_refused(tmp_path):
    spec = oiio.ImageSpec(4, 4, 2, "float")
    spec.channelnames, spec.deep = ("A", "Z"), True
    samples = oiio.DeepData()
    samples.init(spec)
    for pixel in range(16):
        samples.set_samples(pixel, 2)
    out = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_deep_image(samples) and out.close()
    with pytest.raises(PictureError, match="flatten it first"):
        read_picture(tmp_path / "a.exr")


def test_alpha_alone_is_data(tmp_path):
    save(tmp_path / "a.exr", np.full((4, 4, 1), 0.5, np.float32), "half", ("A",))
    picture = read_picture(tmp_path / "a.exr")
    assert picture.alpha is None and picture.data and "alpha alone" in picture.notes[0]
    np.testing.assert_array_equal(picture.pixels, 0.5)


@pytest.mark.parametrize(("ending", "dtype"), [("exr", "uint"), ("tif", "int"), ("tif", "uint")])
def test_integers_of_32_bits_are_read_as_they_are(tmp_path, ending, dtype):
    values = np.arange(16, dtype=dtype + "32").reshape(4, 4, 1) * 1234
    save(tmp_path / f"a.{ending}", values, dtype, ("id",))
    picture = read_picture(tmp_path / f"a.{ending}")
    assert picture.data and picture.dtype == "float" and "32-bit" in picture.notes[0]
    np.testing.assert_array_equal(picture.pixels, values)


def test_colours_of_32_bits_are_colours(tmp_path):
    save(tmp_path / "a.tif", np.full((4, 4, 3), 2**31, np.uint32), "uint")
    picture = read_picture(tmp_path / "a.tif")
    assert not picture.data
    np.testing.assert_allclose(picture.pixels, 0.2140, atol=1e-4)  # sRGB, as other integers


def test_an_identifier_beside_colours_keeps_its_number(tmp_path):
    spec = oiio.ImageSpec(4, 4, 4, "float")
    spec.channelnames = ("R", "G", "B", "id")
    spec.channelformats = tuple(oiio.TypeDesc(name) for name in ("half", "half", "half", "uint"))
    buffer = oiio.ImageBuf(spec)
    pixels = np.concatenate([np.full((4, 4, 3), 0.5), np.full((4, 4, 1), 2.0**-8)], axis=2)
    assert buffer.set_pixels(oiio.ROI(), pixels.astype(np.float32))
    assert buffer.write(str(tmp_path / "a.exr")), buffer.geterror()
    assert oiio.ImageInput.open(str(tmp_path / "a.exr")).spec().channelformats
    picture = read_picture(tmp_path / "a.exr")
    assert not picture.data
    np.testing.assert_array_equal(picture.pixels[0, 0], [0.5, 0.5, 0.5, 2**24])


def test_the_largest_page_is_read_with_a_note(tmp_path):
    small, large = rgba()[:4, :8, :3], rgba()[..., :3]
    save(tmp_path / "a.tif", small, pages=[large, small])
    picture = read_picture(tmp_path / "a.tif")
    assert (picture.width, picture.height) == (WIDTH, HEIGHT)
    assert picture.notes == ("picture 2 of 3 in it, 16 x 8 pixels, is read: the largest",)


def test_the_first_frame_is_read_with_a_note(tmp_path):
    white, black = np.full((HEIGHT, WIDTH, 3), 255, np.uint8), np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    save(tmp_path / "a.gif", white, pages=[black])
    picture = read_picture(tmp_path / "a.gif")
    assert picture.pixels[0, 0, 0] == 1 and "first of several" in picture.notes[0]
    save(tmp_path / "b.gif", white)
    assert read_picture(tmp_path / "b.gif").notes == ()


def test_an_animated_png_is_known_by_its_chunk(tmp_path):
    save(tmp_path / "a.png", rgba())
    assert read_picture(tmp_path / "a.png").notes == ()
    still, control = (tmp_path / "a.png").read_bytes(), b"acTL" + struct.pack(">II", 2, 0)
    chunk = struct.pack(">I", 8) + control + struct.pack(">I", zlib.crc32(control))
    (tmp_path / "a.png").write_bytes(still[:33] + chunk + still[33:])  # after the header
    assert "first of several" in read_picture(tmp_path / "a.png").notes[0]


def test_a_targa_that_says_it_has_alpha_is_believed(tmp_path):
    save(tmp_path / "a.tga", rgba((0, 0)), oiio__UnassociatedAlpha=1)
    assert read_picture(tmp_path / "a.tga").alpha == 3


def test_values_that_are_not_finite_are_replaced_with_a_note(tmp_path):
    values = np.full((4, 5, 3), 0.5, dtype=np.float32)
    values[0, 0] = np.nan, np.inf, -np.inf
    values[1, 1, 0] = 1e30
    save(tmp_path / "a.exr", values, "float")
    picture = read_picture(tmp_path / "a.exr")
    assert list(picture.pixels[0, 0]) == [0, 65504, -65504] and picture.pixels[1, 1, 0] == np.float32(1e30)
    assert picture.notes == ("3 values are not finite: NaN becomes 0, infinite ones 65504",)
    with pytest.raises(PictureError, match=r"a.exr: 3 values are not finite"):
        read_picture(tmp_path / "a.exr", exact=True)
