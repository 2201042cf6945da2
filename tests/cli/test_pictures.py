"""Pictures of all kinds through the command: what is noted, refused, and shown."""

import numpy as np
import OpenImageIO as oiio
import pytest
from command import wfluid

from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture

QUICK = ("--push", "8,6:1,0:radius=3", "--cells", 16, "--duration", 0.1, "--fps", 10)


def animate(picture, *more):
    return wfluid("animate", picture, *QUICK, *more)


@pytest.fixture
def disc(tmp_path):
    """A white disc on transparent ground."""
    x, y = np.arange(16), np.arange(12)[:, None]
    opacity = np.clip(5 - np.hypot(x - 8, y - 6), 0, 1)[..., None]
    path = tmp_path / "disc.png"
    write_picture(path, Picture(np.repeat(opacity, 4, axis=2).astype(np.float32), 3, "uint8"))
    return path


def channels(path, names, value=0.25):
    """An EXR of one value with channels of these names."""
    spec = oiio.ImageSpec(16, 12, len(names), "half")
    spec.channelnames = names
    out = oiio.ImageOutput.create(str(path))
    values = np.full((12, 16, len(names)), value, np.float32)
    assert out.open(str(path), spec) and out.write_image(values) and out.close()
    return path


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "a.#.jpg", "a.#.bmp"])
def test_the_background_is_behind_the_picture(disc, tmp_path, name):
    if name.endswith("mp4"):
        pytest.importorskip("av")
    result = animate(disc, "-o", tmp_path / name, "--background", "#3060c0")
    assert result.returncode == 0, result.stderr
    path = tmp_path / name.replace("#", "1002")
    if name.endswith("mp4"):
        import av

        with av.open(str(path)) as file:
            shown = next(file.decode(video=0)).to_ndarray(format="rgb24")
    else:
        shown = oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8).astype(int)
    assert shown[0, 0, :3].astype(int) == pytest.approx([0x30, 0x60, 0xC0], abs=10)
    assert shown[6, 8, :3].min() > 235


def test_a_background_is_a_colour(disc, tmp_path):
    result = animate(disc, "-o", tmp_path / "a.gif", "--background", "blue")
    assert result.returncode == 2 and "expected a colour" in result.stderr


@pytest.mark.parametrize("dry", [(), ("--dry-run",)])
@pytest.mark.parametrize("setting", [("--type", "half"), ("--quality", 80), ("--compression", "zip")])
def test_settings_of_stills_are_refused_for_movies(disc, tmp_path, setting, dry):
    result = animate(disc, "-o", tmp_path / "a.gif", *setting, *dry)
    assert result.returncode == 2 and f"no {setting[0][2:]}; it is for stills" in result.stderr
    assert not (tmp_path / "a.gif").exists()


def test_settings_of_stills_hold_for_the_stills_beside_a_movie(disc, tmp_path):
    names = ("-o", tmp_path / "a.gif", "-o", tmp_path / "a.#.png")
    assert animate(disc, *names, "--type", "uint16").returncode == 0
    assert read_picture(tmp_path / "a.1001.png").dtype == "uint16" and (tmp_path / "a.gif").exists()


def test_what_a_file_does_not_hold_is_noted(tmp_path):
    depth = channels(tmp_path / "depth.exr", ("R", "G", "B", "Z"), 9.0)
    result = animate(depth, "-o", tmp_path / "a.#.png")
    assert result.returncode == 0
    assert "wfluid: note: " in result.stderr and "no room for the channels Z" in result.stderr
    assert read_picture(tmp_path / "a.1001.png").alpha is None


def test_how_a_picture_was_read_is_noted(tmp_path):
    alone = channels(tmp_path / "alone.exr", ("A",))
    for name in ("a.#.jpg", "a.#.hdr", "a.#.bmp", "a.gif"):
        result = animate(alone, "-o", tmp_path / name)
        assert result.returncode == 0, result.stderr
        assert "alone.exr: it holds alpha alone" in result.stderr
    assert read_picture(tmp_path / "a.1001.bmp").pixels.shape[2] == 1


@pytest.mark.parametrize("filter", ["cubic", "lanczos"])
def test_alpha_does_not_overshoot(disc, tmp_path, filter):
    """Filters ring at edges: alpha stays 0 … 1 in files of floats."""
    result = animate(disc, "-o", tmp_path / "a.#.exr", "--filter", filter, "--type", "float", "--scale", 3)
    assert result.returncode == 0, result.stderr
    alpha = read_picture(tmp_path / "a.1002.exr").pixels[..., 3]
    assert alpha.min() == 0 and alpha.max() == 1
