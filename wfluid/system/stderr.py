"""Suppression of messages that native libraries write to stderr."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_STDERR = threading.RLock()


@contextmanager
def quiet_stderr() -> Iterator[None]:
    """A context that drops what native code writes to stderr."""
    with _STDERR:  # one thread at a time: another would restore the null device instead of stderr
        if sys.stderr is not None:
            sys.stderr.flush()
        try:
            kept = os.dup(2)
        except OSError:  # there is no stderr
            yield
            return
        try:
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
