"""Atomic writing: files appear complete or not at all."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from wfluid.system.errors import WriteError
from wfluid.system.targets import NAME_LIMIT, target_of

HOST_LIMIT = 64
"""Largest part of the host's name in a temporary name [bytes]."""


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """A context that turns a failure of the system into one that names the file.

    Raises:
        WriteError: any OSError of the body.
    """
    try:
        yield
    except WriteError:
        raise
    except OSError as error:
        raise WriteError(f"{path}: cannot be written ({error.strerror or error})") from error


@contextmanager
def atomic_file(path: Path, sync: bool = True) -> Iterator[BinaryIO]:
    """A new file, open for writing, that gets the name `path` at the end, and is removed on failure.

    Where `path` is a link, the file that it leads to is replaced. A file that is replaced keeps its mode.
    First, temporary files of `path` that killed processes of this host left behind are removed. `sync` waits
    until the disk has the file, which takes about 5 ms: too long for each of many stills.

    Raises:
        FileError: a name that cannot be written to, see `target_of`.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    target = target_of(path)
    remove_leftovers(target)
    process = os.getpid()
    temporary = target.with_name(f"{_prefix(target)}{process}-{_started(process)}.part{target.suffix}")
    try:
        with writing(path):
            with open(temporary, "wb") as file:
                yield file
                if sync:
                    file.flush()
                    os.fsync(file.fileno())
            if target.exists():
                os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
            os.replace(temporary, target)
    finally:
        with suppress(OSError):
            temporary.unlink()


def atomic_write(path: Path, data: bytes | memoryview, sync: bool = True) -> None:
    """Write bytes, completely or not at all; `sync` as in `atomic_file`.

    Raises:
        FileError: a name that cannot be written to, see `target_of`.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    with atomic_file(path, sync) as file:
        file.write(data)


def atomic_write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8, completely or not at all.

    Raises:
        FileError: a name that cannot be written to, see `target_of`.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    atomic_write(path, text.encode())


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files of `path` whose process ran on this host and is gone."""
    if os.name != "posix":
        return  # other systems cannot tell whether a process runs
    name = re.compile(re.escape(_prefix(path)) + r"(\d+)-(\d+)\.part" + re.escape(path.suffix))
    try:
        found = [name.fullmatch(entry) for entry in os.listdir(path.parent)]
    except OSError:
        return  # the folder does not exist or cannot be listed
    for leftover in filter(None, found):
        process, start = leftover.groups()
        if not _alive(int(process), start):
            path.with_name(leftover.group()).unlink(missing_ok=True)


def _prefix(path: Path) -> str:
    """The prefix of temporary names of a file on this host: `.STEM.wfluid-HOST.NAMESPACE-`.

    A stem that is too long is cut, and a hash of the full stem is appended.
    """
    host = re.sub(r"[^\w.-]", "_", platform.node()).encode()[-HOST_LIMIT:].decode(errors="ignore")
    rest = f".wfluid-{host}{_namespace()}-"
    numbers = len("4194304-00000000000000000000.part")  # the longest process number and start
    room = NAME_LIMIT - 1 - len(rest.encode()) - numbers - len(os.fsencode(path.suffix))
    stem = path.stem
    if len(os.fsencode(stem)) > room:
        mark = hashlib.sha256(os.fsencode(stem)).hexdigest()[:16]
        stem = os.fsencode(stem)[: max(0, room - len(mark))].decode(errors="ignore") + mark
    return f".{stem}{rest}"


def _namespace() -> str:
    """The namespace of process numbers, one a container, as a number after a point; "" if unknown.

    Containers may share the host's name: a process of another one has a number that means nothing here.
    """
    try:
        return "." + "".join(filter(str.isdigit, os.readlink("/proc/self/ns/pid")))  # pid:[4026531836]
    except OSError:
        return ""


def _started(process: int) -> str:
    """Start of a process [clock ticks since the system's start]; "0" if unknown."""
    try:
        after_name = Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2]
    except OSError:
        return "0"
    return after_name.split()[19].decode()  # field 22 of proc(5)


def _alive(process: int, start: str) -> bool:
    """Whether the process with this number and start still runs; numbers are reused."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return "0" in (start, _started(process)) or start == _started(process)
