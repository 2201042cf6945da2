"""Names of output files: frame numbers, folders."""

from __future__ import annotations

import os
import re
from pathlib import Path

from wfluid.pictures.formats import PictureError


def check_folder(path: Path) -> None:
    """Check that a file can be written at a path, without writing one.

    Raises:
        PictureError: a folder that does not exist or cannot be written, or a path that is a folder.
    """
    if not path.parent.is_dir():
        raise PictureError(f"{path.parent}: no such folder; make it first")
    if not os.access(path.parent, os.W_OK):
        raise PictureError(f"{path.parent}: this folder cannot be written to")
    if path.is_dir():
        raise PictureError(f"{path}: a folder; name a file in it")


def files_written(path: Path, start: int, frames: int) -> set[Path]:
    """Resolved paths of all files that an animation with a number of frames writes to a path."""
    pattern = numbering(path)
    if pattern is None:
        return {path.resolve()}
    return {numbered(path, pattern, n).resolve() for n in range(start, start + frames)}


def numbered(path: Path, pattern: str, number: int) -> Path:
    """The name of a frame: `pattern`, a run of # or %0Nd, replaced by its number."""
    digits = len(pattern) if pattern[0] == "#" else int(pattern.strip("%d") or 0)
    return path.with_name(path.name.replace(pattern, str(number).zfill(max(digits, 1))))


def numbering(path: Path) -> str | None:
    """The part of a name that stands for the frame's number: a run of #, or %0Nd."""
    found = re.findall(r"#+|%0?\d*d", path.name)
    if len(found) > 1:
        raise PictureError(f"{path}: more than one frame number in the name")
    return found[0] if found else None
