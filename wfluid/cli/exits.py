"""Exit codes."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Exit code of a command."""

    DONE = 0
    """Success."""
    FAILED = 1
    """The run failed, a residual is too large, or the picture folds."""
    INPUT = 2
    """Bad input; the message is one line on stderr."""
    INTERRUPTED = 130
    """Ended by Ctrl-C."""
