"""A run says how far it moves beside its longest arrow, and how much it strains; it warns of rough motion."""

import json
import math
import re

import pytest
from command import wfluid
from scenes import write_pictures

from wfluid import read_scene
from wfluid.cli.smoothness import LEAST_WAY, STRAIN_LIMIT, Smoothness
from wfluid.staging.build import stage, stage_all

QUICK = ("--cells", 16, "--duration", 0.4, "--fps", 10)

SUMMARY = (
    r"moved by at most (\S+) px, the longest arrow has (\S+) px, stretched by a factor of at most (\S+) in"
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pictures, made the current one."""
    write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def arrow_of(folder, *words):
    """The longest arrow of a command line [px]."""
    made = wfluid(*words, "--save-scene", "arrow.toml")
    assert made.returncode == 0, made.stderr
    arrow = stage_all(read_scene("arrow.toml")).arrow
    return None if arrow is None else pytest.approx(60 * arrow)


def test_the_summary_and_the_report_have_the_figures_of_the_frames(folder):
    words = ("animate", "small.png", "--push", "30,20:8,6", *QUICK, "--report", "a.json", "--save-scene")
    ended = wfluid(*words, "a.toml")
    frames = list(stage(read_scene("a.toml")).frames())
    longest = 60 * max(frame.quality.displacement_max for frame in frames)
    strain = max(frame.quality.log_strain for frame in frames)
    figures = json.loads((folder / "a.json").read_text())["smoothness"]
    assert figures == {
        "longest_px": pytest.approx(longest),
        "longest_arrow_px": pytest.approx(10.0),
        "log_strain_p99": pytest.approx(strain),
        "log_strain_p99_frame": 4,
    }
    shown = [float(text) for text in re.search(SUMMARY, ended.stdout).groups()]
    assert shown == pytest.approx([longest, 10.0, math.exp(strain)], rel=0.05)
    assert "warning" not in ended.stderr
    assert wfluid(*words, "a.toml", "--quiet").stderr == ""


@pytest.mark.parametrize(
    ("forces", "arrow"),
    [
        (("--push", "30,20:3,4", "--push", "10,10:6,8"), 10.0),
        (
            (
                "--push",
                "30,20:3,4:strength=-3",
            ),
            15.0,
        ),
        (("--wind", "0,7"), 7.0),
        (("--stroke", "10,10/20,10/20,30"), 30.0),
        (("--vortex", "30,20:90"), None),
        (("--push", "30,20:3,4", "--noise", "5"), None),
    ],
)
def test_the_longest_arrow_is_that_of_the_forces(folder, forces, arrow):
    assert arrow_of(folder, "animate", "small.png", *forces) == arrow


def test_the_longest_arrow_of_keyframes_and_morphs_is_the_longest_way(folder):
    moves = ("--move", "20,20:23,24", "--move", "40,20:46,12", "--cells", 16)
    keyframes = ("keyframes", "small.png", *moves, "--time", 0.25, "--tolerance", 60)
    assert arrow_of(folder, *keyframes) == 10.0
    assert arrow_of(folder, *keyframes, "--push", "30,20:0,12") == 12.0
    assert arrow_of(folder, "morph", "small.png", "other.png", *moves, "--tolerance", 60) == 10.0


def test_a_motion_farther_than_its_arrow_warns_with_the_remedy(folder):
    """Two pushes that add up carry the picture farther than either; the exit code stays 0."""
    both = ("--push", "30,20:8,0", "--push", "30,20:8,0:strength=1", "--push", "30,20:8,0")
    words = ("animate", "small.png", *both, "--viscosity", 1e-5, *QUICK, "--report", "a.json")
    ended = wfluid(*words, "--quiet")
    longest = json.loads((folder / "a.json").read_text())["smoothness"]["longest_px"]
    assert longest > 16 and ended.returncode == 0
    assert f"moves by up to {longest:.3g} px, more than twice its longest arrow of 8 px" in ended.stderr
    assert "try more viscosity (--viscosity 4e-05), or a force that is weaker" in ended.stderr


def test_a_strained_picture_warns_with_the_remedy(folder):
    words = ("animate", "small.png", "--noise", 40, "--viscosity", 1e-4, *QUICK, "--allow-folds")
    ended = wfluid(*words, "--report", "a.json", "--quiet")
    figures = json.loads((folder / "a.json").read_text())["smoothness"]
    assert figures["log_strain_p99"] > STRAIN_LIMIT and figures["longest_arrow_px"] is None
    frame = figures["log_strain_p99_frame"]
    assert f"1 % of frame {frame} ({frame / 10:.3g} s) is stretched by a factor of more than" in ended.stderr
    assert "try more viscosity (--viscosity 0.0004)" in ended.stderr


def test_a_point_that_is_only_held_is_not_moved_too_far():
    """Beside an arrow of no length, a displacement of a hair is none."""
    held = Smoothness(512, 0.0)
    held.longest = LEAST_WAY
    assert held.complaint() == ""
    held.longest = 1.01 * LEAST_WAY
    assert "more than twice its longest arrow of 0 px" in held.complaint()
