"""Numbered stills."""

from __future__ import annotations

from pathlib import Path

from wfluid.files.names import numbered
from wfluid.pictures.formats import Encoding
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture


class Sequence:
    """Numbered stills."""

    def __init__(self, path: Path, pattern: str, start: int, encoding: Encoding):
        self.path, self.pattern, self.next, self.encoding = path, pattern, start, encoding
        self.written: list[Path] = []

    def write(self, picture: Picture) -> None:
        """Write the next number."""
        path = numbered(self.path, self.pattern, self.next)
        write_picture(path, picture, self.encoding)
        self.written.append(path)
        self.next += 1

    def close(self) -> None:
        """Nothing is left to do."""

    def abandon(self) -> None:
        """Finished files stay."""
