"""Suppression of messages that native libraries write to stdout and stderr."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TextIO

_LOCK = threading.RLock()


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """A context that drops what native code writes to stdout and stderr."""
    with _LOCK, ExitStack() as stack:  # one thread at a time: another would restore the null device
        for number, stream in ((1, sys.stdout), (2, sys.stderr)):
            stack.enter_context(_dropped(number, stream))
        yield


@contextmanager
def _dropped(number: int, stream: TextIO | None) -> Iterator[None]:
    """A context that drops what is written to a file descriptor, after what its stream holds already."""
    if stream is None:  # its number may be that of another file
        yield
        return
    with suppress(OSError, ValueError):  # what cannot be written stays in the stream
        stream.flush()
    try:
        kept = os.dup(number)
    except OSError:
        yield
        return
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), number)
        yield
    finally:
        os.dup2(kept, number)
        os.close(kept)
