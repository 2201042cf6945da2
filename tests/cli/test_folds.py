"""A picture that folds is reported by every command: where, when and how much, with exit code 1."""

import json
import re

import numpy as np
import pytest
from command import wfluid
from scenes import write_pictures

from wfluid import read_scene
from wfluid.staging.build import stage

HARD = ("--push", "30,20:20,9:period=0.4,radius=6", "--viscosity", 1e-4, "--duration", 2, "--fps", 10)
"""A swing that mixes its surroundings."""

GRID = ("--cells", 24, "--substeps", 2)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pictures, made the current one."""
    write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def determinants(frame):
    """det J at the cells' centres, by central differences; a free-slip wall mirrors what lies before it."""
    grid, moved = frame.map.grid, np.pad(frame.map.displacement, ((1, 1), (1, 1), (0, 0)), "edge")
    moved[:, [0, -1], 0] *= -1
    moved[[0, -1], :, 1] *= -1
    along_x = (moved[1:-1, 2:] - moved[1:-1, :-2]) / (2 * grid.hx) + [1, 0]
    along_y = (moved[2:, 1:-1] - moved[:-2, 1:-1]) / (2 * grid.hy) + [0, 1]
    return along_x[..., 0] * along_y[..., 1] - along_x[..., 1] * along_y[..., 0]


def test_a_fold_is_reported_with_place_time_and_size(folder):
    """The figures are those of the frames' maps; the files are written."""
    ended = wfluid("animate", "small.png", "-o", "a.gif", *HARD, *GRID, "--save-scene", "a.toml")
    assert ended.returncode == 1 and (folder / "a.gif").exists()
    frames = list(stage(read_scene("a.toml")).frames())
    least = [determinants(frame).min() for frame in frames]
    worst = int(np.argmin(least))
    row, column = np.unravel_index(determinants(frames[worst]).argmin(), determinants(frames[worst]).shape)
    cell = 60 / 24
    folded = [(determinants(frame) <= 0).sum() * cell**2 for frame in frames]
    count, total, first, number, x, y, width, height = map(
        int,
        re.search(
            r"folds in (\d+) of (\d+) frames, first in frame (\d+) .*most in frame (\d+) .* at "
            r"(\d+),(\d+) of (\d+) x (\d+) px",
            ended.stderr,
        ).groups(),
    )
    assert (count, total) == (sum(value <= 0 for value in least), len(frames))
    assert (first, number) == (next(n for n, value in enumerate(least) if value <= 0), worst)
    assert (width, height) == (60, 40)
    assert abs(x - (column + 0.5) * cell) <= 1 and abs(y - (row + 0.5) * cell) <= 1
    assert f"({worst / 10:.3g} s)" in ended.stderr and f"det J {least[worst]:.2g}" in ended.stderr
    area = float(re.search(r"up to (\S+) square px", ended.stderr)[1])
    assert area == pytest.approx(max(folded), rel=0.01)


def test_the_remedy_names_options_of_the_command_in_use(folder):
    made = wfluid("animate", "small.png", "-o", "a.gif", *HARD, *GRID, "--save-scene", "a.toml")
    for option in ("--loop oscillate", "--viscosity 0.0004", "--cells 48", "--substeps 4", "--allow-folds"):
        assert option in made.stderr
    rendered = wfluid("render", "a.toml", "-o", "b.gif")
    assert rendered.returncode == 1
    for option in (
        "time.loop=oscillate",
        "viscosity.value=0.0004",
        "fluid.cells=48",
        "time.substeps=4",
        "--allow-folds",
    ):
        assert option in rendered.stderr


def test_folds_are_accepted_where_they_are_allowed(folder):
    """By the flag of each command, or the key of a scene: exit code 0, and a warning."""
    words = ("animate", "small.png", *HARD, *GRID, "--report", "a.json")
    made = wfluid(*words, "--allow-folds", "--save-scene", "a.toml")
    assert made.returncode == 0 and "warning: the picture folds in" in made.stderr
    assert wfluid("render", "a.toml", "--report", "b.json").returncode == 0
    refused = wfluid("render", "a.toml", "--report", "c.json", "--set", "frames.allow_folds=false")
    assert refused.returncode == 1
    again = ("render", "a.toml", "--report", "d.json", "--set", "frames.allow_folds=false")
    assert wfluid(*again, "--allow-folds").returncode == 0
    folds = json.loads((folder / "a.json").read_text())["folds"]
    assert folds["frames"] > 0 and folds["worst"]["jacobian_min"] < 0 < folds["area_max_px"]


def test_a_motion_without_folds_says_nothing_of_them(folder):
    words = ("--push", "30,20:3,0", "--duration", 0.5, "--fps", 10)
    ended = wfluid("animate", "small.png", *words, *GRID, "--report", "a.json")
    assert ended.returncode == 0 and "folds" not in ended.stderr
    folds = json.loads((folder / "a.json").read_text())["folds"]
    assert folds == {"frames": 0, "area_max_px": 0.0}


def test_keyframes_that_fold_are_reported_with_their_place(folder):
    """The point arrives, though a force of the scene folds the picture; also without an output."""
    words = ("keyframes", "small.png", "--move", "50,35:50,35@2", *HARD, *GRID, "--tolerance", 60, "--quiet")
    ended = wfluid(*words, "-o", "a.gif")
    assert ended.returncode == 1 and re.search(r"folds in \d+ of \d+ frames.* at \d+,\d+ of", ended.stderr)
    assert "later arrival times" in ended.stderr and "residual" not in ended.stderr
    unwritten = wfluid(*words, "--save-scene", "a.toml")
    assert unwritten.stderr == ended.stderr and unwritten.returncode == 1
    assert wfluid(*words, "-o", "a.gif", "--allow-folds").returncode == 0
