"""Standard streams that may be missing, closed, full, or unable to show every letter."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO


@contextmanager
def safe_streams() -> Iterator[Callable[[], str]]:
    """A context in which printing never fails.

    Letters that the encoding of stdout or stderr lacks become "?". What a stream does not take, as it is a
    closed pipe or on a full disk, is dropped. The context is a function that flushes stdout and returns why
    something was dropped from it, or "".
    """
    _occupy_descriptors()
    kept = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = out, _ = _Lossy(kept[0]), _Lossy(kept[1])
    try:
        yield out.failure
    finally:
        sys.stdout, sys.stderr = kept


class _Lossy:
    """A stream that drops what cannot be written."""

    def __init__(self, stream: TextIO | None):
        self._stream, self._failure = stream or open(os.devnull, "w"), ""
        if hasattr(self._stream, "reconfigure"):
            self._stream.reconfigure(errors="replace")

    def write(self, text: str) -> int:
        """Write, or drop."""
        self._try(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Write what is buffered, or drop it."""
        self._try(self._stream.flush)

    def failure(self) -> str:
        """Flush; why something was dropped, or ""."""
        self.flush()
        return self._failure

    def _try(self, work: Callable[[], object]) -> None:
        try:
            work()
        except (OSError, ValueError) as error:
            self._failure = self._failure or getattr(error, "strerror", None) or str(error)
            _silence(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _silence(stream: TextIO) -> None:
    """Send the rest of a stream to the null device, so that Python's own flush at the end succeeds."""
    with suppress(AttributeError, OSError, ValueError):
        number, nowhere = stream.fileno(), os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)
        os.close(nowhere)


def _occupy_descriptors() -> None:
    """Open the null device in place of standard streams that are closed.

    Otherwise a file that is written gets their number, and libraries print into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
