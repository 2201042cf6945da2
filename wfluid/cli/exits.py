"""Exit codes."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """What a command ends with."""

    DONE = 0
    """All went well."""
    FAILED = 1
    """The run failed, or its result is not good enough."""
    INPUT = 2
    """Bad input, said in one line on stderr."""
    INTERRUPTED = 130
    """Ended by Ctrl-C."""
