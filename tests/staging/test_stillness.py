"""A drawn force that walls, masks or frozen parts hold back says why, and only then."""

import numpy as np
import pytest
from command import wfluid

from wfluid import Picture, write_picture

QUICK = ("--cells", 24, "--duration", 0.2, "--fps", 10)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """a.png of 60 x 40; grey.png and left.png, white on the left half."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    write_picture("a.png", Picture(rng.random((40, 60, 3)).astype(np.float32), dtype="uint8"))
    left = np.zeros((40, 60), np.uint8)
    left[:, :30] = 255
    for name, mask in (("grey", 0 * left + 128), ("left", left)):
        write_picture(f"{name}.png", mask)
    return tmp_path


def notes(*flags):
    """What is said, and the longest displacement [px]."""
    result = wfluid("animate", "a.png", "-o", "a.gif", *QUICK, "--report", "a.json", *flags)
    assert result.returncode == 0, result.stderr
    moved = float(result.stdout.partition("moved by at most ")[2].partition(" px")[0])
    return [line for line in result.stderr.splitlines() if line.startswith("wfluid: note: --")], moved


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (("--wind", "9,0"), "--wind 9,0: the walls hold it back"),
        (("--wind", "0,9", "--walls", "no-slip"), "the walls hold it back"),
        (("--wind", "0,9", "--walls", "periodic,free-slip"), "the walls hold it back"),
        (("--wind", "9,0", "--effect-mask", "grey.png"), "the walls hold it back"),
        (("--wind", "9,0:mask=left.png"), "the walls hold it back"),  # it varies along the wind alone
        (("--stroke", "40,20/50,20:mask=left.png"), "its mask is black where it acts"),
        (("--push", "50,20:9,0", "--effect-mask", "left.png"), "its mask is black where it acts"),
        (("--vortex", "50,20:40:mask=left.png"), "its mask is black where it acts"),
        (("--stroke", "12,10/12,30:radius=3", "--freeze", "left.png"), "the picture is frozen where it acts"),
        (("--push", "12,20:9,0", "--freeze", "left.png"), "leave the mask of --freeze black there"),
    ],
)
def test_a_force_that_hardly_moves_says_why(folder, flags, says):
    (note,), moved = notes(*flags)
    assert says in note
    assert moved < 3, "less than a third of what was drawn"


@pytest.mark.parametrize(
    "flags",
    [
        ("--wind", "9,0", "--walls", "periodic"),
        ("--wind", "9,0", "--walls", "periodic,free-slip"),
        ("--wind", "0,9:mask=left.png"),
        ("--stroke", "12,20/30,20:mask=left.png"),
        ("--stroke", "40,20/50,20:radius=4", "--freeze", "left.png"),
        ("--stroke", "20,39/40,39:radius=6"),
        ("--push", "30,20:9,0"),
    ],
)
def test_a_force_that_moves_says_nothing(folder, flags):
    said, moved = notes(*flags)
    assert said == [] and moved > 1


def test_a_scene_names_its_own_keys(folder):
    assert wfluid("animate", "a.png", *QUICK, "--wind", "9,0", "--save-scene", "a.toml").returncode == 0
    said = wfluid("render", "a.toml", "-o", "b.gif").stderr
    assert "note: force.0: the walls hold it back" in said
    assert "use --set fluid.walls=… periodic" not in said and "--set fluid.walls=periodic" in said


@pytest.mark.parametrize(
    ("flags", "place", "drawn", "says"),
    [
        (("--push", "0,20:9,0:radius=6"), "0,20", 9, "it pushes against a wall"),
        (
            ("--stroke", "20,40/40,40:radius=6", "--walls", "no-slip"),
            "30,40",
            20,
            "it acts on a no-slip wall",
        ),
    ],
)
def test_a_force_on_a_wall_hardly_moves_the_place_where_it_acts(folder, flags, place, drawn, says):
    (note,), _ = notes(*flags, "--track", place, "--tracks", "t.csv")
    assert says in note
    *_, (x, y) = np.loadtxt("t.csv", delimiter=",", skiprows=1)[:, 3:]
    there = [float(part) for part in place.split(",")]
    assert np.hypot(x - there[0], y - there[1]) < 0.1 * drawn
