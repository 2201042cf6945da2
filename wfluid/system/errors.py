"""The error of files."""

from __future__ import annotations


class FileError(ValueError):
    """A file that cannot be read or written; the message names the file, the reason and the remedy."""
