"""The command: what it writes, what it refuses."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from command import wfluid, wfluid_process

from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture

IMAGES = Path(__file__).parents[2] / "examples" / "images"
REPORT = {
    "picture", "grid", "frames", "fps", "steps", "seconds", "divergence_max", "jacobian_min", "jacobian_max",
    "displacement_max_px", "displacement_mean_px", "outside_fraction", "diffusion_loss_px", "versions",
    "device",
}  # fmt: skip


@pytest.fixture
def small(tmp_path):
    """A 60 x 40 picture."""
    x = np.linspace(0, 1, 60, dtype=np.float32)
    pixels = np.stack(
        [np.broadcast_to(x, (40, 60)), np.broadcast_to(x[:40, None], (40, 60)), np.full((40, 60), 0.2)], 2
    )
    path = tmp_path / "small.png"
    write_picture(path, Picture(pixels.astype(np.float32), dtype="uint8"))
    return path


def animate(small, out, *more, run=wfluid):
    return run("animate", small, "-o", out, "--cells", 24, "--duration", 0.4, "--fps", 10, *more)


def test_animate_writes_a_gif_and_a_report(small, tmp_path):
    push = ("--push", "30,20:5,0:radius=8")
    result = animate(
        small, tmp_path / "a.gif", *push, "--report", tmp_path / "r.json", "--quiet", run=wfluid_process
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    report = json.loads((tmp_path / "r.json").read_text())
    assert report.keys() >= REPORT
    assert report["seconds"].keys() == {"compile", "simulate", "lookup", "write", "total"}
    assert (report["picture"], report["grid"], report["frames"], report["steps"]) == (
        [60, 40],
        [24, 16],
        5,
        40,
    )
    assert 1 < report["displacement_max_px"] < 6
    assert 0.9 < report["jacobian_min"] <= 1 <= report["jacobian_max"] < 1.1
    assert report["outside_fraction"] == 0
    assert oiio.ImageInput.open(str(tmp_path / "a.gif")).seek_subimage(4, 0)


@pytest.mark.parametrize("size", [(60, 40), (40, 60)], ids=["landscape", "portrait"])
def test_tracks_are_in_pixels_of_the_picture_whichever_side_is_longer(tmp_path, size):
    """Nothing moves a point that no force acts on; a push carries it by its arrow, in pixels."""
    width, height = size
    path, out = tmp_path / "picture.png", tmp_path / "t.csv"
    write_picture(path, Picture(np.full((height, width, 3), 0.5, np.float32), dtype="uint8"))
    push = ("--push", "20,25:0,4:radius=6", "--viscosity", 1e-5)
    tracks = ("--track", "20,25", "--track", "39,39", "--tracks", out, "--cells", 60)
    result = wfluid("animate", path, "-o", tmp_path / "a.gif", "--duration", 0.2, "--fps", 10, *push, *tracks)
    assert result.returncode == 0, result.stderr
    rows = [[float(value) for value in row.split(",")] for row in out.read_text().split()[1:]]
    assert rows[:2] == [[0, 0, 0, 20, 25], [0, 0, 1, 39, 39]] and len(rows) == 6
    (_, time, _, x, y), (*_, far_x, far_y) = rows[-2:]
    assert time == 0.2 and abs(x - 20) < 0.5 and 25.3 < y < 29 and math.hypot(far_x - 39, far_y - 39) < 2


def test_the_first_frame_of_a_sequence_is_the_picture_itself(small, tmp_path):
    assert animate(small, tmp_path / "f.####.png", "--push", "30,20:5,0").returncode == 0
    first, last = (oiio.ImageBuf(str(tmp_path / f"f.{n}.png")).get_pixels(oiio.UINT8) for n in (1001, 1005))
    np.testing.assert_array_equal(first, oiio.ImageBuf(str(small)).get_pixels(oiio.UINT8))
    assert np.abs(last.astype(int) - first).max() > 3


def test_the_same_command_twice_gives_the_same_bytes(small, tmp_path):
    for name in ("a", "b"):
        push = ("--push", "30,20:5,2:period=0.4")
        assert animate(small, tmp_path / f"{name}.gif", *push, run=wfluid_process).returncode == 0
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


@pytest.mark.parametrize("scheme", ["standard", "paper"])
@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic", "periodic,free-slip"])
def test_every_wall_and_scheme_runs(small, tmp_path, walls, scheme):
    options = ("--walls", walls, "--scheme", scheme, "--push", "30,20:5,2", "--width", 30)
    result = animate(small, tmp_path / "f.####.png", *options)
    assert result.returncode == 0, result.stderr


def test_warmup_says_what_it_did():
    result = wfluid("warmup")
    assert result.returncode == 0 and result.stderr.startswith("kernels for CPU")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "at least one --push"),
        (("--push", "1,2"), "expected X,Y:DX,DY"),
        (("--push", "999,2:1,1"), "outside the picture"),
        (("--push", "1,2:1,1", "--viscosity", "-1"), "--viscosity -1.0: expected a number from 0 to 1000"),
        (("--push", "1,2:1,1", "--viscosity", "nan"), "--viscosity nan: expected"),
        (("--push", "1,2:1,1", "--viscosity", "thick"), "--viscosity 'thick': expected a number"),
        (("--push", "1,2:1,1", "--walls", "soft"), "expected free-slip"),
        (("--push", "1,2:1,1", "--scheme", "best"), "expected one of standard, paper"),
        (("--push", "1,2:1,1", "--solver", "lu"), "expected one of multigrid, jacobi"),
        (("--push", "1,2:1,1", "--fps", "0"), "--fps 0.0: expected a number from 0.01"),
        (("--push", "1,2:1,1", "--duration", "inf"), "--duration inf"),
        (("--push", "1,2:1,1", "--substeps", "0"), "--substeps 0"),
        (("--push", "1,2:1,1", "--cells", "1"), "cells 1"),
        (("--push", "1,2:1,1", "--width", "-4"), "width -4"),
        (("--push", "1,2:1,1", "--device", "tpu"), "there is: cpu"),
        (("--push", "1,2:1,1", "--sharpen"), "there is no flag --sharpen"),
    ],
)
def test_bad_input_is_one_line_exit_2_and_nothing_written(small, tmp_path, options, says):
    out = tmp_path / "out"
    out.mkdir()
    result = wfluid("animate", small, "-o", out / "a.gif", *options)
    assert result.returncode == 2, result.stderr
    assert says in result.stderr and result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr and list(out.iterdir()) == []


def test_the_parser_loads_only_what_help_needs():
    """No libraries; and of the standard library none of the modules that double the time of `--help`."""
    heavy = ("warp", "OpenImageIO", "numpy", "rich", "tomlkit")
    slow = ("ast", "csv", "dataclasses", "difflib", "inspect", "subprocess", "threading")
    code = (
        "import sys; before = set(sys.modules); import wfluid.cli.main as c; c.build_parser(); "
        f"print([name for name in {heavy + slow} if name in sys.modules and name not in before])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.stdout.strip() == "[]", result.stderr
    assert wfluid_process("--help").returncode == 0
