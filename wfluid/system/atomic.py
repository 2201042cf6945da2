"""Atomic writing: files appear complete or not at all."""

from __future__ import annotations

import hashlib
import os
import platform
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wfluid.system.errors import FileError

NAME_LIMIT = 255
"""Longest name of a file on common file systems [bytes]."""

HOST_LIMIT = 64
"""Largest part of the host's name in a temporary name [bytes]."""


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """The path of a temporary file in the same folder, renamed to `path` on success and removed on failure.

    First, temporary files of `path` that killed processes of this host left behind are removed.
    """
    remove_leftovers(path)
    process = os.getpid()
    temporary = path.with_name(f"{_prefix(path)}{process}-{_started(process)}.part{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def atomic_write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8, completely or not at all.

    Raises:
        FileError: the file cannot be written.
    """
    try:
        with atomic_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror})") from error


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
    """The prefix of temporary names of a file on this host: `.STEM.wfluid-HOST-`.

    A stem that is too long is cut, and a hash of the full stem is appended.
    """
    host = re.sub(r"[^\w.-]", "_", platform.node()).encode()[-HOST_LIMIT:].decode(errors="ignore")
    rest = f".wfluid-{host}-"
    numbers = len("4194304-00000000000000000000.part")  # the longest process number and start
    room = NAME_LIMIT - 1 - len(rest.encode()) - numbers - len(os.fsencode(path.suffix))
    stem = path.stem
    if len(os.fsencode(stem)) > room:
        mark = hashlib.sha256(os.fsencode(stem)).hexdigest()[:16]
        stem = os.fsencode(stem)[: max(0, room - len(mark))].decode(errors="ignore") + mark
    return f".{stem}{rest}"


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
