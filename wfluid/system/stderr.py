"""What native libraries print is kept off stderr."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_STDERR = threading.RLock()


@contextmanager
def quiet_stderr() -> Iterator[None]:
    """Drop what native code writes to stderr; Python's own messages come as exceptions."""
    with _STDERR:  # one thread at a time, or one would keep another's silence
        if sys.stderr is not None:
            sys.stderr.flush()
        try:
            kept = os.dup(2)
        except OSError:  # there is no stderr to keep quiet
            yield
            return
        try:
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
