"""What files hold of a picture: channels by meaning, range of the type, colour space, window."""

import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.pictures.fitting import display_rgb, fit
from wfluid.pictures.formats import WRITES, Encoding, PictureError
from wfluid.pictures.pairing import paired
from wfluid.pictures.picture import Picture, intensity
from wfluid.pictures.profiles import read_profile
from wfluid.pictures.stills import read_picture, write_picture

P3 = ((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407))
"""XYZ of red, green and blue of Display P3, adapted to D50."""

P3_RED = (1.2249, -0.0420, -0.0197)
"""Red of Display P3 in linear light of Rec. 709."""


def profile(colorants=P3, gamma=2.2, space=b"RGB "):
    """An ICC profile of a matrix and one curve, a power."""
    tags = {}
    for name, xyz in zip((b"rXYZ", b"gXYZ", b"bXYZ"), colorants, strict=True):
        tags[name] = b"XYZ \0\0\0\0" + struct.pack(">3i", *(round(value * 65536) for value in xyz))
    curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"
    tags |= dict.fromkeys((b"rTRC", b"gTRC", b"bTRC", b"kTRC"), curve)
    head = b"\0\0\0\0\2\x10\0\0mntr" + space + b"XYZ " + b"\0" * 12 + b"acsp" + b"\0" * 88
    table, data, start = struct.pack(">I", len(tags)), b"", 132 + 12 * len(tags)
    for name, tag in tags.items():
        table += struct.pack(">4sII", name, start + len(data), len(tag))
        data += tag
    whole = head + table + data
    return struct.pack(">I", len(whole) + 4) + whole


def stored(path):
    """The numbers in a file, straight, and its spec."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hints)
    spec = source.spec()
    values = np.asarray(source.read_image(0, 0, 0, spec.nchannels, spec.format))
    return values.reshape(spec.height, spec.width, spec.nchannels), spec


def named(values, names, dtype="float", **window):
    """A picture whose file had channels of these names."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], len(names), dtype)
    spec.channelnames = names
    for name, value in window.items():
        setattr(spec, name, value)
    return Picture(values.astype(np.float32), names.index("A") if "A" in names else None, dtype, spec)


def save_png(path, values, icc):
    """An 8-bit PNG with an ICC profile."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], "uint8")
    spec.attribute("ICCProfile", oiio.TypeDesc(f"uint8[{len(icc)}]"), np.frombuffer(icc, np.uint8))
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(values) and out.close()


@pytest.mark.parametrize("ending", WRITES)
@pytest.mark.parametrize(
    ("names", "alpha", "colors"),
    [
        (("Y",), False, 1),
        (("Y", "A"), True, 1),
        (("R", "G"), False, 3),
        (("R", "G", "B", "Z"), False, 3),
        (("R", "G", "B", "A", "Z"), True, 3),
        (("id", "spec.R", "spec.G", "spec.B"), False, 3),
    ],
)
def test_channels_are_written_by_their_meaning(tmp_path, ending, names, alpha, colors):
    """Every format takes every picture; what is no alpha never becomes one, and colours are the colours."""
    values = np.broadcast_to(0.25 + 0.125 * np.arange(len(names)), (4, 6, len(names)))
    picture = named(values, names)
    path = tmp_path / f"a{ending}"
    notes = fit(path, picture, Encoding()).notes
    write_picture(path, picture)
    back = read_picture(path)
    assert (back.alpha is not None) == (alpha and ending not in (".jpg", ".jpeg", ".hdr", ".bmp"))
    if ending in (".exr", ".tif", ".tiff"):
        assert back.pixels.shape[2] == len(names) and not notes
        return
    assert ("no room" in "".join(notes)) == any(name in names for name in ("Z", "id"))
    shown = [names.index(name) for name in names if name.split(".")[-1] in "RGBY"]
    expected = [*values[0, 0, shown], 0.0][:3] if colors == 3 else [values[0, 0, 0]] * 3
    got = back.pixels[0, 0, back.color_channels]
    np.testing.assert_allclose(np.broadcast_to(got, 3) if len(got) == 1 else got, expected, atol=0.02)


def test_half_is_clamped_to_its_range(tmp_path):
    write_picture(tmp_path / "a.exr", Picture(np.array([[[7e4, -7e4, 1]]], np.float32)), Encoding("half"))
    np.testing.assert_array_equal(stored(tmp_path / "a.exr")[0][0, 0], [65504, -65504, 1])


def test_tiff_of_type_half_is_half(tmp_path):
    write_picture(tmp_path / "a.tif", Picture(np.full((4, 4, 3), 0.5, np.float32)), Encoding("half"))
    values, spec = stored(tmp_path / "a.tif")
    assert str(spec.format) == "half" and np.all(values.view(np.float16) == 0.5)


def test_radiance_has_no_negative_light(tmp_path):
    """RGBE has no sign: OpenImageIO would write -0.02 as 0.98."""
    write_picture(tmp_path / "a.hdr", Picture(np.array([[[1.0, -0.02, 0.5]]], np.float32)))
    np.testing.assert_allclose(stored(tmp_path / "a.hdr")[0][0, 0], [1, 0, 0.5], atol=0.01)


def test_bits_per_sample_stay_with_their_file(tmp_path):
    spec = oiio.ImageSpec(8, 4, 3, "uint8")
    spec.attribute("oiio:BitsPerSample", 4)
    out = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    values = np.full((4, 8, 3), 0x88, np.uint8)
    assert out.open(str(tmp_path / "a.tif"), spec) and out.write_image(values) and out.close()
    picture = read_picture(tmp_path / "a.tif")
    for ending in ("dpx", "tif", "png"):
        write_picture(tmp_path / f"b.{ending}", picture)
        np.testing.assert_array_equal(stored(tmp_path / f"b.{ending}")[0], values)


def test_a_profile_is_converted_where_a_file_has_none(tmp_path):
    """Red of Display P3 is beyond Rec. 709; a PNG keeps code and profile, an EXR and a GIF are converted."""
    red = np.broadcast_to(np.array([255, 0, 0], np.uint8), (4, 6, 3)).copy()
    save_png(tmp_path / "a.png", red, profile())
    picture = read_picture(tmp_path / "a.png")
    np.testing.assert_allclose(picture.pixels[0, 0], P3_RED, atol=2e-3)
    write_picture(tmp_path / "b.png", picture)
    values, spec = stored(tmp_path / "b.png")
    np.testing.assert_array_equal(values, red)
    assert np.asarray(spec["ICCProfile"]).tobytes() == profile()
    for ending in ("exr", "dpx"):
        write_picture(tmp_path / f"b.{ending}", picture)
        assert stored(tmp_path / f"b.{ending}")[1].get("ICCProfile") is None
    np.testing.assert_allclose(stored(tmp_path / "b.exr")[0].view(np.float16)[0, 0], P3_RED, atol=2e-3)
    np.testing.assert_array_equal(display_rgb(picture)[0, 0], [255, 0, 0])


def test_every_code_returns_through_a_profile(tmp_path):
    codes = np.random.default_rng(0).integers(0, 256, (16, 16, 3)).astype(np.uint8)
    save_png(tmp_path / "a.png", codes, profile(gamma=1.8))
    picture = read_picture(tmp_path / "a.png")
    write_picture(tmp_path / "b.png", picture)
    np.testing.assert_array_equal(stored(tmp_path / "b.png")[0], codes)
    assert picture.pixels.min() < 0 and intensity(picture).min() >= 0


def test_a_curve_is_applied_before_the_matrix(tmp_path):
    """Grey 128 of gamma 2.2 is (128 / 255)^2.2 in linear light, whatever the primaries."""
    white = np.full((4, 4, 3), 128, np.uint8)
    save_png(tmp_path / "a.png", white, profile())
    np.testing.assert_allclose(read_picture(tmp_path / "a.png").pixels, (128 / 255) ** 2.2, atol=1e-3)


def test_srgb_profiles_change_nothing(tmp_path):
    colorants = ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410))
    assert not read_profile(profile(colorants, 2.2), 3).is_srgb  # its curve is a power
    assert np.abs(read_profile(profile(colorants), 3).matrix - np.eye(3)).max() < 1e-3


@pytest.mark.parametrize(
    ("icc", "says"),
    [
        (b"\1" * 200, "malformed"),
        (profile()[:300], "malformed"),
        (profile(space=b"CMYK"), "CMYK"),
        (profile(((0, 0, 0),) * 3), "malformed"),
    ],
)
def test_unusable_profiles_are_left_out_with_a_note(tmp_path, icc, says):
    """No profile that is malformed, or of other colours, hinders a file or says wrong colours."""
    out = oiio.ImageOutput.create(str(tmp_path / "a.jpg"))
    spec = oiio.ImageSpec(8, 8, 3, "uint8")
    spec.attribute("ICCProfile", oiio.TypeDesc(f"uint8[{len(icc)}]"), np.frombuffer(icc, np.uint8))
    assert out.open(str(tmp_path / "a.jpg"), spec)
    assert out.write_image(np.full((8, 8, 3), 100, np.uint8)) and out.close()
    picture = read_picture(tmp_path / "a.jpg")
    assert says in picture.notes[0] and "left out" in picture.notes[0]
    for ending in ("png", "jpg", "tif"):
        write_picture(tmp_path / f"b.{ending}", picture)
        values, spec = stored(tmp_path / f"b.{ending}")
        assert spec.get("ICCProfile") is None and abs(int(values[0, 0, 0]) - 100) <= 1


def test_the_second_picture_of_a_pair_keeps_its_colours(tmp_path):
    """A picture in sRGB, blended into one in Display P3, has other numbers under that profile."""
    codes = np.full((4, 4, 3), (200, 40, 90), np.uint8)
    save_png(tmp_path / "a.png", codes, profile())
    write_picture(tmp_path / "b.png", Picture(np.full((4, 4, 3), (1, 0, 0), np.float32), dtype="uint8"))
    first, second = read_picture(tmp_path / "a.png"), read_picture(tmp_path / "b.png")
    pair = paired(first, second, "fill")
    write_picture(tmp_path / "c.png", pair.a.with_pixels(pair.b.pixels))
    assert stored(tmp_path / "c.png")[1].get("ICCProfile") is not None
    np.testing.assert_allclose(read_picture(tmp_path / "c.png").pixels, second.pixels, atol=0.01)


def windowed(x, y, width, height):
    """A picture of 8 x 6 pixels at x, y of a display window."""
    values = np.arange(8 * 6 * 3).reshape(6, 8, 3) / 255
    return named(values, ("R", "G", "B"), x=x, y=y, full_width=width, full_height=height)


def test_other_formats_show_the_display_window(tmp_path):
    crop, overscan = windowed(3, 2, 20, 10), windowed(-2, -1, 4, 3)
    encoding = Encoding()
    for picture, size in ((crop, (20, 10)), (overscan, (4, 3))):
        path = tmp_path / "a.png"
        write_picture(path, picture)
        back = read_picture(path)
        assert (back.width, back.height) == size
        assert "display window" in fit(path, picture, encoding).notes[0]
        assert display_rgb(picture).shape == (size[1], size[0], 3)
    np.testing.assert_allclose(back.pixels, overscan.pixels[1:4, 2:6], atol=5e-3)
    write_picture(path, crop)
    back = read_picture(path).pixels
    np.testing.assert_allclose(back[2:8, 3:11], crop.pixels, atol=5e-3)
    assert back.sum() == pytest.approx(back[2:8, 3:11].sum())


def test_windows_are_scaled_with_the_picture(tmp_path):
    picture = windowed(3, 2, 20, 10).resized(16, 12)
    write_picture(tmp_path / "a.exr", picture)
    spec = stored(tmp_path / "a.exr")[1]
    assert (spec.x, spec.y, spec.full_width, spec.full_height) == (6, 4, 40, 20)
    assert display_rgb(picture).shape == (20, 40, 3)


def test_a_background_lies_behind_what_is_transparent(tmp_path):
    """Over sRGB 128, half transparent white is the mean of both in linear light."""
    behind = ((128 / 255 + 0.055) / 1.055) ** 2.4
    values = np.zeros((2, 2, 4), np.float32)
    values[:, 1] = 0.5
    picture = Picture(values, 3, "uint8")
    mean = round(255 * (1.055 * (0.5 + 0.5 * behind) ** (1 / 2.4) - 0.055))
    shown = display_rgb(picture, (behind, behind, behind))
    assert shown[0, 0].tolist() == [128] * 3 and abs(shown[0, 1].astype(int) - mean).max() <= 1
    assert display_rgb(picture)[0, 0].tolist() == [0, 0, 0]
    encoding = Encoding(background=(behind, behind, behind))
    write_picture(tmp_path / "a.bmp", picture, encoding)
    np.testing.assert_array_equal(stored(tmp_path / "a.bmp")[0], shown)
    write_picture(tmp_path / "a.png", picture, encoding)
    assert stored(tmp_path / "a.png")[0][0, 0, 3] == 0


@pytest.mark.parametrize("setting", [{"type": "uint8"}, {"quality": 50}, {"compression": "zip"}])
def test_movies_have_no_settings_of_stills(setting):
    for name in ("a.gif", "a.mp4"):
        with pytest.raises(PictureError, match=f"no {next(iter(setting))}; it is for stills"):
            Encoding(**setting).check_movie(Path(name))
