"""What goes wrong with files."""

from __future__ import annotations


class FileError(ValueError):
    """A file that cannot be read or written; the message says which, why and what to do."""
