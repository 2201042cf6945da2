"""Standard streams that are missing, closed, full or narrow, and a home that cannot be written to."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from command import wfluid_process

from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture

QUICK = ("--push", "30,20:5,0:radius=8", "--cells", "16", "--duration", "0.1", "--fps", "10")


@pytest.fixture
def folder(tmp_path):
    """Has a picture of 60 x 40, a.png."""
    values = np.random.default_rng(0).random((40, 60, 3)).astype(np.float32)
    write_picture(tmp_path / "a.png", Picture(values, dtype="uint8"))
    return tmp_path


def shell(folder, text, **environment):
    """A command line of the shell, in which $W is wfluid."""
    return subprocess.run(
        ["bash", "-c", text],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=folder,
        env={**os.environ, "W": f"{sys.executable} -m wfluid", **environment},
    )


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
@pytest.mark.parametrize("words", ["animate --help", "render --keys", "morph --help"])
def test_text_is_shown_in_any_encoding(folder, encoding, words):
    plain = shell(folder, f"$W {words}", PYTHONIOENCODING="utf-8").stdout
    result = shell(folder, f"$W {words}", PYTHONIOENCODING=encoding)
    assert (result.returncode, result.stderr) == (0, "")
    assert len(result.stdout) == len(plain) and not plain.isascii()


def test_names_that_stdout_cannot_show_are_no_failure(folder):
    flags = " ".join(QUICK)
    result = shell(folder, f"$W animate a.png -o ä.gif --dry-run {flags}", PYTHONIOENCODING="ascii")
    assert (result.returncode, result.stderr) == (0, "") and "writes    ?.gif" in result.stdout


@pytest.mark.parametrize("words", ["render --keys", "animate --help", "animate a.png -o b.gif --dry-run"])
@pytest.mark.parametrize("where", ["> /dev/full", "| (exec <&-; sleep 0.1)"])
def test_output_that_is_cut_off_is_a_failure_in_one_line(folder, words, where):
    words += " " + " ".join(QUICK) if words.endswith("run") else ""
    reader = "set -o pipefail; sleep 0.2; " if "|" in where else ""
    command = f"({'sleep 0.3; ' if '|' in where else ''}exec $W {words}) {where}"
    result = shell(folder, reader + command)
    assert result.returncode == 1, (result.returncode, result.stderr)
    assert result.stderr.startswith("wfluid: failed: what it prints was cut off (")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("where", ["2>&-", "2>/dev/full", ">&- 2>&-", "<&- >&- 2>&-"])
def test_a_run_needs_no_stderr(folder, where):
    """A closed number goes to no file that is written, which libraries could print into."""
    flags = " ".join(QUICK)
    good = shell(folder, f"$W animate a.png -o a.##.jpg {flags} {where}")
    assert good.returncode == 0 and read_picture(folder / "a.1001.jpg").width == 60
    assert shell(folder, f"$W animate none.png -o b.gif {flags} {where}").returncode == 2
    assert shell(folder, f"$W animate --none {where}").returncode == 2


@pytest.mark.parametrize("home", ["/proc/none", "/dev/null"])
def test_a_home_that_cannot_be_written_is_refused_with_the_remedy(folder, home):
    unset = {
        name: value for name, value in os.environ.items() if name not in ("WARP_CACHE_PATH", "XDG_CACHE_HOME")
    }
    result = wfluid_process(
        "animate", folder / "a.png", "-o", folder / "a.gif", *QUICK, env={**unset, "HOME": home}
    )
    assert result.returncode == 2 and result.stderr.count("\n") == 1
    assert result.stderr.startswith(f"wfluid animate: {home}")
    assert "name another one in WARP_CACHE_PATH" in result.stderr


def test_a_figure_needs_no_home(folder, device):
    pytest.importorskip("matplotlib")
    cache = str(Path(wp.config.kernel_cache_dir).parent)
    flags = (*QUICK[2:], "--quiet", "--move", "30,20:31,20", "--plot", folder / "p.png")
    environment = {**os.environ, "HOME": "/proc/none", "WARP_CACHE_PATH": cache}
    result = wfluid_process("keyframes", folder / "a.png", *flags, env=environment)
    assert result.returncode in (0, 1) and "atplotlib" not in result.stderr
    assert (folder / "p.png").exists()
