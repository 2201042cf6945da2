"""The last line of each command, what messages speak of, and which options hints name."""

import io
import re
import warnings

import numpy as np
import pytest
from command import wfluid

from wfluid import write_picture
from wfluid.animation.simulation import PoorSolveWarning
from wfluid.cli import progress
from wfluid.cli.hints import fitted_hint
from wfluid.cli.progress import FrameProgress, SearchProgress
from wfluid.keyframes.search import Progress

QUICK = ("--cells", 24, "--duration", 0.2, "--fps", 10)
PUSH = ("--push", "30,20:5,0:radius=8")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """a.png of 60 x 40, and the scene of a push, shot.toml."""
    monkeypatch.chdir(tmp_path)
    write_picture("a.png", np.random.default_rng(0).random((40, 60, 3)))
    assert wfluid("animate", "a.png", *QUICK, *PUSH, "--save-scene", "shot.toml").returncode == 0
    return tmp_path


def ended(*arguments, code=0):
    """The one line on stdout."""
    result = wfluid(*arguments)
    assert result.returncode == code, result.stderr
    assert result.stdout.count("\n") == 1, result.stdout
    return result.stdout.rstrip("\n")


def figures(line):
    """What moved [px], and the range of areas."""
    found = re.search(r"moved by at most ([\d.e-]+) px.*, areas ([\d.]+) … ([\d.]+) of what they were", line)
    return [float(number) for number in found.groups()]


@pytest.mark.parametrize("verb", ["animate", "render"])
def test_a_run_ends_with_what_where_how_long_and_the_worst_figures(verb):
    command = ("render", "shot.toml") if verb == "render" else ("animate", "a.png", *QUICK, *PUSH)
    line = ended(*command, "-o", "b.gif", "--report", "b.json")
    assert re.match(r"wrote b.gif, b.json in \d+\.\d s, 3 frames: ", line)
    moved, least, most = figures(line)
    assert 0.3 < moved < 9 and 0.9 < least <= 1 <= most < 1.1


def test_a_sequence_is_named_by_its_first_and_last_file():
    line = ended("animate", "a.png", *QUICK, *PUSH, "-o", "b.####.png")
    assert line.startswith("wrote b.1001.png … b.1003.png in ")


@pytest.mark.parametrize(
    ("flags", "name"), [(("--preview", "p.png"), "p.png"), (("--save-scene", "s.toml"), "s.toml")]
)
def test_what_runs_nothing_says_what_it_wrote(flags, name):
    assert re.fullmatch(rf"wrote {name} in \d+\.\d s", ended("animate", "a.png", *QUICK, *PUSH, *flags))


def test_a_search_says_how_far_the_farthest_point_is():
    keyframes = ("keyframes", "a.png", *QUICK, "--move", "30,20:32,20")
    line = ended(*keyframes, "-o", "b.gif", "--save-scene", "s.toml")
    assert line.startswith("wrote b.gif, s.toml in ")
    away = re.search(r"the farthest point ([\d.e-]+) px from its target$", line)
    assert float(away[1]) <= 0.03 and "residual" not in line
    line = ended("keyframes", "a.png", *QUICK, "--move", "0,0:9,9", "-o", "b.gif", code=1)
    assert float(re.search(r"the farthest point ([\d.]+) px", line)[1]) > 9


def test_a_morph_ends_with_its_figures():
    line = ended("morph", "a.png", "a.png", *QUICK, "--move", "30,20:32,20", "-o", "b.gif")
    assert line.startswith("wrote b.gif in ") and "the farthest point" in line


def test_quiet_prints_nothing():
    result = wfluid("animate", "a.png", *QUICK, *PUSH, "-o", "b.gif", "--quiet")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_the_test_of_gradients_ends_with_the_lowest_rate():
    result = wfluid("check-gradient", "shot.toml", "--cells", 12)
    if result.stderr:  # in double precision; otherwise another process prints
        (line,) = result.stderr.splitlines()
        assert re.fullmatch(
            r"\d+ variables .* in .* s, 0 wrong, the lowest rate is .*; nothing was written", line
        )


def test_messages_speak_of_pixels_and_of_residuals_only_with_verbose():
    command = ("keyframes", "a.png", *QUICK, "--move", "0,0:9,9", "-o", "b.gif")
    plain, verbose = wfluid(*command).stderr, wfluid(*command, "--verbose").stderr
    assert (
        "unreachable: the farthest point is 12.7 px from its target: at most 0.0293 px are allowed" in plain
    )
    assert not re.search(r"residual|iteration|evaluation|objective", plain)
    assert re.search(r"after \d+ iterations and \d+ evaluations", verbose)


def test_warnings_say_what_is_seen_and_the_numbers_only_with_verbose():
    command = ("animate", "a.png", *QUICK, *PUSH, "-o", "b.gif", "--scheme", "paper", "--viscosity", 0.1)
    plain, verbose = wfluid(*command).stderr, wfluid(*command, "--verbose").stderr
    assert "some areas grow or shrink that should not" in plain and "(--solver) to multigrid" in plain
    assert not re.search(r"divergence|sweeps", plain)
    assert re.search(r"sweeps left \S+ of the divergence", verbose)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.warn(PoorSolveWarning(3, "seen", "a number", "a remedy"), stacklevel=1)
    assert str(caught[0].message) == "frame 3: seen: a number; a remedy (said once)"


def test_hints_name_options_of_the_command_in_use():
    """A render has no flag --width: it sets keys of the scene."""
    text = "lower --cells or --width, use --walls=periodic; --report"
    assert fitted_hint("animate", text) == text
    assert fitted_hint("render", text) == (
        "lower --set fluid.cells=… or --set frames.width=…, use --set fluid.walls=periodic; --report"
    )
    assert fitted_hint("check-gradient", "lower --cells or --width").startswith(
        "lower --cells or --set frames"
    )
    huge = ("--set", "frames.width=30000", "--set", "time.duration=5000")
    said = wfluid("render", "shot.toml", "-o", "b.gif", *huge)
    assert said.returncode == 2 and "lower --set fluid.cells=… or --set frames.width=…" in said.stderr


def test_hints_name_keys_that_a_scene_has():
    for flag in ("--width", "--cells", "--viscosity", "--fps", "--scheme", "--edge"):
        key = re.fullmatch(r"--set ([\w.]+)=…", fitted_hint("render", flag))[1]
        said = wfluid("render", "shot.toml", "-o", "b.gif", "--set", f"{key}=nonsense").stderr
        assert f"{key}: 'nonsense': expected" in said


def test_a_scene_without_forces_is_told_of_forces(folder):
    (folder / "still.toml").write_text('wfluid = 1\n[picture]\nfile = "a.png"\n')
    said = wfluid("render", "still.toml", "-o", "b.gif")
    assert (
        said.returncode == 2 and "add a [[force]] to the scene" in said.stderr and "--push" not in said.stderr
    )


def test_without_a_terminal_a_line_comes_now_and_then(monkeypatch, capsys):
    """The first after ten seconds, then one every ten seconds."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "perf_counter", lambda: now[0])
    out = io.StringIO()
    with SearchProgress(60.0, False, out) as show:
        for second in range(1, 36):
            now[0] = second
            show(Progress("coarse", second, second, 0.5, 0.1 / second))
    lines = out.getvalue().splitlines()
    assert len(lines) == 3 and lines[0] == "keyframes  coarse grid: the farthest point is 0.6 px away"
    with FrameProgress(50, False) as advance:
        for second in range(36, 60):
            now[0] = second
            advance()
    assert capsys.readouterr().err.splitlines() == ["frames     10 of 50", "frames     20 of 50"]
    verbose = io.StringIO()
    with SearchProgress(60.0, False, verbose, verbose=True) as show:
        now[0] += 10
        show(Progress("fine", 7, 9, 0.5, 0.1))
    assert (
        verbose.getvalue()
        == "keyframes  fine grid: the farthest point is 6 px away; iteration 7, objective 0.5\n"
    )
    quiet = io.StringIO()
    with SearchProgress(60.0, True, quiet) as show:
        now[0] += 100
        show(Progress("fine", 7, 9, 0.5, 0.1))
    assert quiet.getvalue() == ""
