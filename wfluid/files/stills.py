"""Animations as numbered stills."""

from __future__ import annotations

from pathlib import Path

from wfluid.files.names import numbered
from wfluid.pictures.formats import Encoding
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture


class StillsWriter:
    """A writer of a still for each frame; `pattern` in the name stands for its number, from `start` on."""

    def __init__(self, path: Path, pattern: str, start: int, encoding: Encoding):
        self.path, self.pattern, self.next, self.encoding = path, pattern, start, encoding
        self.written: list[Path] = []

    def write(self, picture: Picture) -> None:
        """Write the still with the next number."""
        path = numbered(self.path, self.pattern, self.next)
        write_picture(path, picture, self.encoding)
        self.written.append(path)
        self.next += 1

    def close(self) -> None:
        """Do nothing: every still is complete."""

    def abandon(self) -> None:
        """Do nothing: complete stills are kept."""
