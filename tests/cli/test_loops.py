"""Loops from the command line: what arrows mean in them, and that they close without a jump."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from command import wfluid
from scenes import write_pictures

from wfluid import read_scene
from wfluid.staging.build import stage

ROOT = Path(__file__).parents[2]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pictures, made the current one."""
    write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def longest(*words):
    """The longest displacement of a push on small.png [px]."""
    push = ("--push", "30,20:6,0:radius=6", "--fps", 10, "--cells", 32, "--viscosity", 1e-4)
    ended = wfluid("animate", "small.png", "--report", "a.json", *push, *words)
    assert ended.returncode == 0, ended.stderr
    return json.loads(Path("a.json").read_text())["smoothness"]["longest_px"]


def test_a_pingpong_reaches_its_arrow_at_the_turn(folder):
    """As an animation as long as the way out does; it reached a quarter."""
    assert longest("--duration", 2, "--loop", "pingpong") == pytest.approx(longest("--duration", 1), rel=1e-4)


def test_a_force_after_the_turn_of_a_pingpong_is_refused(folder):
    words = ("--push", "30,20:6,0:start=1", "--duration", 2, "--loop", "pingpong", "-o", "a.gif")
    ended = wfluid("animate", "small.png", *words)
    assert ended.returncode == 2 and "start=1: the way out of the pingpong lasts 1 s" in ended.stderr


@pytest.mark.long
def test_the_first_command_of_the_readme_loops_without_a_jump(tmp_path):
    """The step from the last frame to the first is no larger than the others, and no frame folds."""
    (line,) = re.findall(r"\.venv/bin/(wfluid animate .*)", (ROOT / "README.md").read_text())
    words = shlex.split(line)[1:]
    words[1], words[words.index("-o") + 1] = ROOT / words[1], tmp_path / "raccoon.gif"
    ended = wfluid(*words, "--save-scene", tmp_path / "a.toml", "--preview", tmp_path / "a.png")
    assert ended.returncode == 0, ended.stderr
    frames = list(stage(read_scene(tmp_path / "a.toml")).frames())
    maps = np.array([frame.map.displacement for frame in frames])
    steps = np.hypot(*np.moveaxis(np.roll(maps, -1, axis=0) - maps, -1, 0)).max(axis=(1, 2))
    assert steps[-1] <= steps[:-1].max()
    assert min(frame.quality.jacobian_min for frame in frames) > 0.9
