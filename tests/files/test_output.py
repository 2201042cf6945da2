"""Animations as files: names, numbers, delays, atomic writing."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.files import movie, output
from wfluid.files.gif import delays, set_delays
from wfluid.files.names import numbering
from wfluid.files.output import open_output
from wfluid.pictures.formats import PictureError
from wfluid.pictures.picture import Picture


def frames(count, width=40, height=30):
    for n in range(count):
        pixels = np.zeros((height, width, 3), np.float32)
        pixels[:, n * 4 : n * 4 + 8] = (1.0, 0.2, 0.05)
        yield Picture(pixels, dtype="uint8")


def write(path, count, fps):
    out = open_output(path, fps)
    for picture in frames(count):
        out.write(picture)
    out.close()
    return out.written


def gif_delays(data):
    """Delays [1/100 s], read by an independent parser of the blocks."""
    at, found = 13 + (3 << (data[10] & 7) + 1 if data[10] & 0x80 else 0), []
    while data[at] != 0x3B:
        if data[at] == 0x21 and data[at + 1] == 0xF9:
            found.append(int.from_bytes(data[at + 4 : at + 6], "little"))
        if data[at] == 0x21:
            at += 2
        else:
            at += 11 + (3 << (data[at + 9] & 7) + 1 if data[at + 9] & 0x80 else 0)
        while data[at]:
            at += data[at] + 1
        at += 1
    return found


@pytest.mark.parametrize("fps", [10, 12, 15, 23.976, 24, 25, 30, 50])
@pytest.mark.parametrize("count", [1, 7, 49])
def test_gif_delays_are_integers_with_an_exact_mean(fps, count):
    """15 fps is 70, 60, 70 … ms; the sum is exact to 1/200 s."""
    spread = delays(count, fps)
    assert len(spread) == count and min(spread) >= 2
    assert max(spread) - min(spread) <= 1
    assert abs(sum(spread) - 100 * count / fps) <= 0.5 + 1e-9


@pytest.mark.parametrize("with_av", [True, False])
def test_a_gif_read_back_has_its_frames_delays_and_loop(tmp_path, monkeypatch, with_av):
    if with_av and not movie.available():
        pytest.skip("the extra `video` is not installed")
    monkeypatch.setattr(movie, "available", lambda: with_av)
    assert write(tmp_path / "a.gif", 7, 15) == [tmp_path / "a.gif"]
    data = (tmp_path / "a.gif").read_bytes()
    assert gif_delays(data) == delays(7, 15)
    assert b"NETSCAPE2.0\x03\x01\x00\x00" in data, "does not loop for ever"
    source = oiio.ImageInput.open(str(tmp_path / "a.gif"))
    for n, expected in enumerate(frames(7)):
        assert source.seek_subimage(n, 0)
        got = source.read_image(n, 0, 0, 3, "uint8").astype(int)
        assert got[15, n * 4 + 4] == pytest.approx([255, 124, 64], abs=8)
        assert expected.pixels[15, n * 4 + 4, 0] == 1
        assert np.abs(got[15, n * 4 + 12 :]).max() < 12
    assert not source.seek_subimage(7, 0)


def test_setting_delays_refuses_another_number_of_frames(tmp_path):
    write(tmp_path / "a.gif", 3, 10)
    data = bytearray((tmp_path / "a.gif").read_bytes())
    with pytest.raises(PictureError, match="3 frames, expected 4"):
        set_delays(data, [5, 5, 5, 5])


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("a.####.png", "a.1001.png"),
        ("a_%06d.tif", "a_001001.tif"),
        ("a#.exr", "a1001.exr"),
        ("a.%d.png", "a.1001.png"),
    ],
)
def test_sequences_are_numbered_from_1001(tmp_path, name, first):
    written = write(tmp_path / name, 3, 24)
    assert written[0].name == first and len(written) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in written)


def test_two_numbers_in_a_name_are_refused():
    with pytest.raises(PictureError, match="more than one"):
        numbering(Path("a##_%04d.png"))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a.xyz", "cannot tell"),
        ("none/a.gif", "no such folder"),
        ("a.####.xyz", "unknown picture format"),
        (".", "a folder"),
    ],
)
def test_impossible_outputs_are_refused(tmp_path, name, says):
    with pytest.raises(PictureError, match=says):
        open_output(tmp_path / name, 15)


def test_a_gif_cannot_be_faster_than_browsers(tmp_path):
    with pytest.raises(PictureError, match="50 frames a second"):
        open_output(tmp_path / "a.gif", 60)


def test_an_abandoned_animation_leaves_no_gif(tmp_path):
    def breaks():
        yield from ()
        raise RuntimeError("the run failed")

    with pytest.raises(RuntimeError):
        output.write_animation(tmp_path / "a.gif", breaks(), 10)
    assert list(tmp_path.iterdir()) == []
