"""The errors of files."""

from __future__ import annotations


class FileError(ValueError):
    """A file that cannot be read or written; the message names the file, the reason and the remedy."""


class WriteError(OSError):
    """A file that could not be written to its end, as on a full disk; the message names it and the reason."""
