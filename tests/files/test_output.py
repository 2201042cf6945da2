"""Animations as files: names, numbers, delays, atomic writing."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid import Animation, Fluid, GaussianForce, Timeline, write_picture
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


@pytest.mark.parametrize("name", ["take#1.gif", "100%done.gif", "take#1.webm"])
def test_a_file_that_holds_all_frames_may_have_a_number_sign_in_its_name(tmp_path, name):
    if not name.endswith(".gif") and not movie.available():
        pytest.skip("the extra `video` is not installed")
    assert write(tmp_path / name, 2, 10) == [tmp_path / name]
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.####.gif", "a.%04d.gif", "a.%d.gif", "a.##.mp4"])
def test_a_file_that_holds_all_frames_has_no_frame_number(tmp_path, name):
    with pytest.raises(PictureError, match=r"holds all frames; name it without a number, or .* x\.####\.png"):
        open_output(tmp_path / name, 10)


def test_a_percent_before_a_word_is_no_number(tmp_path):
    assert [path.name for path in write(tmp_path / "100%done.%02d.png", 2, 10)] == [
        "100%done.1001.png",
        "100%done.1002.png",
    ]


def test_a_movie_of_television_has_its_exact_rate(tmp_path):
    av = pytest.importorskip("av")
    write(tmp_path / "a.mp4", 3, 29.97)
    with av.open(str(tmp_path / "a.mp4")) as container:
        assert container.streams.video[0].average_rate == Fraction(30000, 1001)


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


@pytest.fixture
def shot():
    """Three frames at 10 a second of an 8 x 6 picture."""
    picture = np.random.default_rng(0).random((6, 8, 3))
    push = GaussianForce((0.5, 0.4), (1.0, 0.0), 0.2)
    return Animation(picture, Fluid(), push, Timeline(0.2, 10), cells=8)


@pytest.mark.parametrize("of", ["run", "list", "every other", "generator", "backwards"])
def test_frames_know_their_rate(shot, tmp_path, of):
    """A run says it; frames have times, and every other one of them is half as many a second."""
    frames = {
        "run": lambda: shot.frames(),
        "list": lambda: list(shot.frames()),
        "every other": lambda: list(shot.frames())[::2],
        "generator": lambda: (frame for frame in shot.frames()),
        "backwards": lambda: list(shot.frames())[::-1],
    }[of]()
    assert shot.frames().fps == 10
    output.write_animation(tmp_path / "a.gif", frames)
    waits = set(gif_delays((tmp_path / "a.gif").read_bytes()))
    assert waits == {20 if of == "every other" else 10}


def test_a_given_rate_and_that_of_plain_pictures(shot, tmp_path):
    """Arrays, paths and pictures are frames too; they have no times."""
    output.write_animation(tmp_path / "a.gif", shot.frames(), 20)
    assert set(gif_delays((tmp_path / "a.gif").read_bytes())) == {5}
    codes = np.zeros((6, 8, 3), np.uint8)
    write_picture(tmp_path / "one.png", codes)
    for frames in ([codes, codes + 200], [tmp_path / "one.png", Picture.of(codes)], np.stack([codes, codes])):
        output.write_animation(tmp_path / "b.gif", frames, 10)
        assert oiio.ImageInput.open(str(tmp_path / "b.gif")).seek_subimage(1, 0)
    assert output.write_animation(tmp_path / "c.gif", [codes]) == [tmp_path / "c.gif"]


@pytest.mark.parametrize("frames", [3, "a.png", np.zeros((6, 8, 3), np.uint8), [3]])
def test_frames_that_are_none_are_refused_in_one_line(tmp_path, frames):
    with pytest.raises(TypeError, match="frames: expected"):
        output.write_animation(tmp_path / "a.gif", frames)
    assert list(tmp_path.iterdir()) == []
