"""Exit codes."""

from __future__ import annotations

EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED = 1, 2, 130
