"""A full disk: every format fails in one line, and leaves no file that is not complete."""

import resource
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from command import wfluid_process

from wfluid.files import movie
from wfluid.pictures.formats import WRITES, PictureError
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.system.encoded import encoded

QUICK = ("--push", "40,30:3,0:radius=10", "--cells", "16", "--duration", "0.1", "--fps", "10", "--quiet")
LIMIT = 20_000

WRITE_ALL = """
import sys
from pathlib import Path
import numpy as np
from wfluid.files import movie
from wfluid.files.output import open_output
from wfluid.files.tracks import TrackWriter
from wfluid.pictures.formats import WRITES
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.system.atomic import atomic_write_text
from wfluid.system.errors import WriteError

folder = Path(sys.argv[1])
noise = Picture(np.random.default_rng(0).random((320, 400, 3)).astype(np.float32), dtype="uint8")

def movie_of(name):
    output = open_output(folder / name, 10)
    try:
        for _ in range(4):
            output.write(noise)
        output.close()
    except BaseException:
        output.abandon()
        raise

def tracks(name):
    writer = TrackWriter(folder / name, 100)
    writer.write(0.0, np.zeros((3000, 2)))
    writer.close()

movies = [".gif", *(movie.CODECS if movie.available() else ())]
writers = {ending: lambda name: write_picture(folder / name, noise) for ending in WRITES}
writers |= dict.fromkeys(movies, movie_of)
writers |= {".csv": tracks, ".json": lambda name: atomic_write_text(folder / name, "x" * 50_000)}
for ending, write in writers.items():
    try:
        write(f"a{ending}")
        print(ending, "was written")
    except WriteError as error:
        assert "cannot be written (" in str(error) and f"a{ending}" in str(error), error
        assert "\\n" not in str(error), error
movie.available = lambda: False
try:
    movie_of("a.gif")
    print("gif was written")
except WriteError:
    pass
print(len(writers), "formats")
"""


def limit():
    """Files of this process may have so many bytes; Python ignores the signal that says so."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT))


@contextmanager
def small_disk(folder):
    """A file system of 40 kB."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=40k", "none", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True).returncode == 0
    except FileNotFoundError:
        mounted = False
    if not mounted:
        pytest.skip("file systems cannot be mounted here")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fails_everywhere(folder, **settings):
    command = [sys.executable, "-c", WRITE_ALL, str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, **settings)
    assert (result.returncode, result.stderr) == (0, "")
    count = len(WRITES) + (3 if movie.available() else 1) + 2
    assert result.stdout == f"{count} formats\n"
    assert list(folder.iterdir()) == []


def test_no_format_is_written_beyond_the_size_that_files_may_have(tmp_path):
    (tmp_path / "out").mkdir()
    fails_everywhere(tmp_path / "out", preexec_fn=limit)


def test_no_format_is_written_to_a_full_disk(tmp_path):
    with small_disk(tmp_path / "out"):
        fails_everywhere(tmp_path / "out")


def test_a_file_that_just_fits_is_written_whatever_the_limit(tmp_path):
    code = WRITE_ALL.replace("320, 400, 3", "12, 16, 3").replace("3000", "2").replace("50_000", "3")
    result = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, preexec_fn=limit
    )
    assert result.stdout.count("was written") == len(list(tmp_path.iterdir())) + 1, result.stderr


@pytest.mark.parametrize(
    "name", ["a.####.png", *(pytest.param(f"a{ending}", marks=pytest.mark.long) for ending in
                              (".####.jpg", ".####.webp", ".####.tga", ".gif", ".mp4", ".webm"))]
)  # fmt: skip
def test_a_run_on_a_full_disk_fails_in_one_line(tmp_path, name):
    values = np.random.default_rng(0).random((120, 160, 3)).astype(np.float32)
    write_picture(tmp_path / "noise.png", Picture(values, dtype="uint8"))
    (tmp_path / "out").mkdir()
    out = tmp_path / "out" / name
    result = wfluid_process("animate", tmp_path / "noise.png", "-o", out, *QUICK, preexec_fn=limit)
    assert result.returncode == 1, (result.returncode, result.stderr)
    assert result.stderr.count("\n") == 1 and "Traceback" not in result.stderr, result.stderr
    assert f"{name.replace('####', '1001')}: cannot be written (" in result.stderr
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(
    "flags", [("--report", "a.json"), ("--dry-run", "--save-scene", "a.toml"),
              ("--track", "9,9", "--tracks", "a.csv")]
)  # fmt: skip
def test_reports_scenes_and_tracks_on_a_full_disk_fail_in_one_line(tmp_path, flags):
    write_picture(tmp_path / "a.png", Picture(np.zeros((60, 80, 3), np.float32), dtype="uint8"))

    def tiny():
        resource.setrlimit(resource.RLIMIT_FSIZE, (40, 40))

    result = wfluid_process("animate", "a.png", *flags, *QUICK, preexec_fn=tiny, cwd=tmp_path)
    assert result.returncode == 1, (result.returncode, result.stderr)
    assert result.stderr.count("\n") == 1 and "cannot be written (" in result.stderr, result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_library_that_hangs_on_a_full_pipe_does_not(tmp_path):
    """What is collected is more than a pipe holds, and the library lets no other thread run."""
    code = """
import ctypes, os, sys
from wfluid.system.encoded import encoded
write = ctypes.PyDLL(None).write
def fill(path):
    with open(path, "wb") as file:
        for _ in range(50):
            assert write(file.fileno(), b"x" * 10_000, 10_000) == 10_000
print(len(encoded(fill, in_order=True)))
"""
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30, preexec_fn=limit)
    assert (result.stdout, result.stderr) == ("500000\n", "")


def test_what_cannot_be_encoded_is_no_full_disk():
    def refuse(_):
        raise PictureError("too wide")

    with pytest.raises(PictureError, match="too wide"):
        encoded(refuse)


@pytest.mark.parametrize(("ending", "side"), [(".jpg", 65_501), (".webp", 16_384)])
def test_a_side_beyond_the_formats_is_refused(tmp_path, ending, side):
    """Libjpeg would end the process."""
    with pytest.raises(PictureError, match=f"a side of {side} pixels"):
        write_picture(tmp_path / f"a{ending}", Picture(np.zeros((1, side, 3), np.float32), dtype="uint8"))
    assert list(tmp_path.iterdir()) == []


def test_a_dpx_knows_its_name(tmp_path):
    """Not that of a temporary file, which differs from run to run."""
    write_picture(tmp_path / "a.dpx", Picture(np.zeros((4, 4, 3), np.float32), dtype="uint8"))
    assert (tmp_path / "a.dpx").read_bytes()[36:136] == b"a.dpx".ljust(100, b"\0")


@pytest.mark.parametrize("ending", [".jpg", ".exr"])
def test_a_system_without_files_in_memory_writes_the_same(tmp_path, monkeypatch, ending):
    picture = Picture(np.random.default_rng(0).random((40, 60, 3)).astype(np.float32), dtype="uint8")
    write_picture(tmp_path / f"a{ending}", picture)
    monkeypatch.delattr("os.memfd_create")
    write_picture(tmp_path / f"b{ending}", picture)
    first, second = (read_picture(tmp_path / f"{name}{ending}").pixels for name in "ab")
    assert np.array_equal(first, second)
