"""What a name leads to: links are written through, and what is no file to write is refused."""

import os
import stat

import pytest
from command import wfluid

from wfluid.system.atomic import atomic_file, atomic_write
from wfluid.system.errors import FileError, WriteError
from wfluid.system.targets import NAME_LIMIT, target_of


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "folder").mkdir()
    real, link = tmp_path / "folder" / "real", tmp_path / "link"
    link.symlink_to("folder/real")
    for content in (b"new", b"again"):  # at first the link leads nowhere
        atomic_write(link, content)
        assert link.is_symlink() and real.read_bytes() == content
    assert {path.name for path in tmp_path.iterdir()} == {"folder", "link"}
    assert [path.name for path in real.parent.iterdir()] == ["real"]


def test_a_file_that_is_replaced_keeps_its_mode(tmp_path):
    for bits in (0o640, 0o600, 0o777):
        atomic_write(tmp_path / "a", b"x")
        os.chmod(tmp_path / "a", bits)
        atomic_write(tmp_path / "a", b"y")
        assert mode(tmp_path / "a") == bits and (tmp_path / "a").read_bytes() == b"y"


def test_a_new_file_has_the_mode_that_new_files_have(tmp_path):
    (tmp_path / "other").write_bytes(b"")
    atomic_write(tmp_path / "a", b"x")
    assert mode(tmp_path / "a") == mode(tmp_path / "other")


def make_read_only(path):
    path.write_bytes(b"x")
    path.chmod(0o444)


REFUSED = {
    "read-only": (make_read_only, "this file is read-only; make it writable"),
    "pipe": (os.mkfifo, "a pipe or a device; name a file"),
    "folder": (lambda path: path.mkdir(), "a folder; name a file in it"),
    "loop": (lambda path: path.symlink_to(path.name), "cannot be written"),
    "link to a pipe": (lambda path: path.symlink_to("/dev/null"), "a pipe or a device"),
    "link to no folder": (lambda path: path.symlink_to("none/a"), "no such folder"),
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.parametrize("name", ["a.gif", "a.1002.png"])
def test_what_is_no_file_to_write_is_refused_before_the_run(tmp_path, case, name):
    make, says = REFUSED[case]
    make(tmp_path / name)
    before = sorted(os.lstat(path) for path in tmp_path.iterdir())
    with pytest.raises(FileError, match=says):
        target_of(tmp_path / name)
    with pytest.raises(FileError, match=says), atomic_file(tmp_path / name):
        pass
    pattern = tmp_path / name.replace("1002", "####")
    flags = ("--push", "3,3:1,0:radius=2", "--duration", "0.1", "--fps", "10", "--quiet")
    result = wfluid("animate", "tests/cli/none.png", "-o", pattern, *flags)
    assert result.returncode == 2 and says in result.stderr and result.stderr.count("\n") == 1
    assert sorted(os.lstat(path) for path in tmp_path.iterdir()) == before


@pytest.mark.parametrize("letter", ["a", "ä", "🦝"])
def test_names_are_as_long_as_the_folder_allows(tmp_path, letter):
    longest = letter * (NAME_LIMIT // len(letter.encode()))
    atomic_write(tmp_path / longest, b"x")
    with pytest.raises(FileError, match="possible here"):
        atomic_write(tmp_path / (longest + letter), b"x")
    with pytest.raises(FileError, match=r"cannot be written|possible here"):
        target_of(tmp_path / ("a" * 5000))
    assert len(list(tmp_path.iterdir())) == 1


def test_a_failure_of_the_system_names_the_file(tmp_path):
    with pytest.raises(WriteError, match=r"a\.png: cannot be written \(No space left on device\)$"):
        with atomic_file(tmp_path / "a.png"):
            raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []
