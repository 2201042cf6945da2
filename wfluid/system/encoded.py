"""What native libraries write, as bytes in memory.

Libraries overlook a full disk, hang on one, or end the process. So they never see the disk: they write to
memory, and Python writes the bytes to the disk, where a failure is an exception (`system/atomic`).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable

from wfluid.system.errors import WriteError

_COLLECT = "import sys; sys.stdout.buffer.write(sys.stdin.buffer.read())"


def encoded(write: Callable[[str], None], in_order: bool = False) -> bytes:
    """The bytes of the file that `write` writes to a path, or a ValueError that says why it cannot.

    The file is in memory. Where the system limits the size of files, the limit holds for it too. Libraries
    that write from beginning to end (`in_order`) then write to a pipe, which has no limit. On a system
    without files in memory they write to a pipe always, and others to the folder of temporary files.

    Raises:
        WriteError: the file is larger than the limit.
    """
    limit = _size_limit()
    has_memory_files = hasattr(os, "memfd_create") and os.path.isdir("/proc/self/fd")
    if in_order and os.path.isdir("/dev/fd") and not (has_memory_files and limit is None):
        return _through_pipe(write)
    if has_memory_files:
        descriptor = os.memfd_create("wfluid")
        path = f"/proc/self/fd/{descriptor}"
    else:
        descriptor, path = tempfile.mkstemp()
    try:
        write(path)
        with open(path, "rb") as file:
            data = file.read()
        if limit is None or len(data) < limit:
            return data
    except ValueError:
        if limit is None:
            raise
    finally:
        os.close(descriptor)
        if not path.startswith("/proc/"):
            os.unlink(path)
    raise WriteError(f"a file may have {limit} bytes here")


def _size_limit() -> int | None:
    """The limit of a file's size [bytes], if there is one."""
    try:
        import resource
    except ImportError:
        return None  # not on this system
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def _through_pipe(write: Callable[[str], None]) -> bytes:
    """The bytes that `write` writes to a pipe, collected by a process: libraries may block all threads."""
    command = [sys.executable, "-I", "-S", "-c", _COLLECT]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as collector:
        if collector.stdin is not None:
            write(f"/dev/fd/{collector.stdin.fileno()}")
        return collector.communicate()[0]
