"""Files appear complete or not at all; temporary files of killed processes are removed."""

import os
import platform
import subprocess
import sys

import pytest

from wfluid.files.names import check_folder
from wfluid.keyframes.plot import check_plot
from wfluid.system.atomic import NAME_LIMIT, atomic_file

KILLED = """
import os, platform, signal, sys
from pathlib import Path
from wfluid.system.atomic import atomic_file
if len(sys.argv) > 2:
    platform.node = lambda: sys.argv[2]
with atomic_file(Path(sys.argv[1])) as temporary:
    temporary.write_bytes(b"x")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def killed_while_writing(path, *host):
    """The temporary file of a process that was killed while it wrote `path`, perhaps on another host."""
    before = set(path.parent.iterdir())
    subprocess.run([sys.executable, "-c", KILLED, path, *host], check=False)
    (left,) = set(path.parent.iterdir()) - before
    return left


def write(path):
    with atomic_file(path) as temporary:
        temporary.write_bytes(b"y")
        return temporary.name


def test_a_writer_removes_the_temporary_file_of_a_killed_process(tmp_path):
    left = killed_while_writing(tmp_path / "a.png")
    write(tmp_path / "a.png")
    assert not left.exists() and [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_temporary_files_of_other_files_are_kept(tmp_path):
    """Only the writer of a file may remove its temporary files."""
    left = [killed_while_writing(tmp_path / name) for name in ("a.png", "b.gif", "ab.png", "a.1001.png")]
    write(tmp_path / "b.png")
    check_folder(tmp_path / "b.png")
    assert all(path.exists() for path in left)


def test_temporary_files_of_other_hosts_are_kept(tmp_path):
    """In a shared folder, a process number that is unused on this host may be used on another."""
    left = killed_while_writing(tmp_path / "a.png", "another-machine")
    check_folder(tmp_path / "a.png")
    write(tmp_path / "a.png")
    assert left.exists()


@pytest.mark.parametrize(
    "name", [".backup.2023.part.zip", ".movie.99999999.part.mkv", ".a.99999999.part.png"]
)
def test_files_of_other_programs_are_kept(tmp_path, name):
    (tmp_path / name).write_bytes(b"x")
    for path in (tmp_path / "a.png", tmp_path / "movie.mkv", tmp_path / "backup.zip"):
        check_folder(path)
        write(path)
    assert (tmp_path / name).exists()


def test_a_check_removes_nothing(tmp_path):
    pytest.importorskip("matplotlib")
    left = killed_while_writing(tmp_path / "a.png")
    check_folder(tmp_path / "a.png")
    check_plot(tmp_path / "a.png")
    assert left.exists()


def test_temporary_files_of_running_processes_are_kept(tmp_path):
    with atomic_file(tmp_path / "a.png") as temporary:
        temporary.write_bytes(b"x")
        subprocess.run([sys.executable, "-c", KILLED.replace("os.kill", "0 and os.kill"), tmp_path / "a.png"])
        assert (tmp_path / "a.png").read_bytes() == b"x" and temporary.exists()
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="starts of processes are not known")
def test_a_reused_process_number_does_not_protect_a_temporary_file(tmp_path):
    left = killed_while_writing(tmp_path / "a.png")
    *_, process, _ = left.name.removesuffix(".part.png").split("-")
    left.rename(tmp_path / left.name.replace(f"-{process}-", f"-{os.getpid()}-"))
    write(tmp_path / "a.png")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("ending", [".png", ".exr", ".gif", ""])
def test_a_temporary_name_is_hidden_and_keeps_the_ending(tmp_path, ending):
    """Libraries choose the format by the ending."""
    name = write(tmp_path / f"a.b{ending}")
    assert name.startswith(".a") and name.endswith(f".part{ending or '.b'}" if ending else ".part.b")


@pytest.mark.parametrize("letter", ["a", "ä", "🦝"])
def test_the_longest_names_can_be_written(tmp_path, monkeypatch, letter):
    monkeypatch.setattr(platform, "node", lambda: "h" * 64)
    names = [letter * ((NAME_LIMIT - 5) // len(letter.encode())) + tail + ".png" for tail in ("", "1")]
    temporary = [write(tmp_path / name) for name in names if len(name.encode()) <= NAME_LIMIT]
    assert all(len(name.encode()) <= NAME_LIMIT for name in temporary)
    assert len(set(temporary)) == len(temporary) == len(list(tmp_path.iterdir()))


def test_a_failure_leaves_the_old_file(tmp_path):
    write(tmp_path / "a.png")
    with pytest.raises(RuntimeError), atomic_file(tmp_path / "a.png") as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError
    assert (tmp_path / "a.png").read_bytes() == b"y" and len(list(tmp_path.iterdir())) == 1
