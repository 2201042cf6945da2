"""Names of output files: frame numbers, folders."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from wfluid.files.movie import CODECS
from wfluid.pictures.formats import PictureError
from wfluid.system.targets import target_of

_NUMBER = re.compile(r"#+|%0?\d*d(?![^\W\d_])")
"""A number's place: #, ####, %d or %04d, which no letter follows as in "100%done"."""


def check_folder(path: Path, start: int = 0, frames: int = 1) -> None:
    """Check that every file of an animation with a number of frames can be written, without writing one.

    Raises:
        PictureError: a name that cannot be written to, see `target_of`.
    """
    for name in _names(path, start, frames):
        target_of(name, PictureError)


def files_written(path: Path, start: int, frames: int) -> set[Path]:
    """Resolved paths of all files that an animation with a number of frames writes to a path."""
    return {name.resolve() for name in _names(path, start, frames)}


def _names(path: Path, start: int, frames: int) -> Iterator[Path]:
    pattern = numbering(path)
    if pattern is None:
        return iter([path])
    return (numbered(path, pattern, n) for n in range(start, start + frames))


def numbered(path: Path, pattern: str, number: int) -> Path:
    """The name of a frame: `pattern`, a run of # or %0Nd, replaced by its number."""
    digits = len(pattern) if pattern[0] == "#" else int(pattern.strip("%d") or 0)
    return path.with_name(_NUMBER.sub(str(number).zfill(max(digits, 1)), path.name))


def numbering(path: Path) -> str | None:
    """The part of a name that stands for the frame's number: a run of #, or %0Nd.

    A file that holds all frames has no number: a # in its name is a letter.

    Raises:
        PictureError: more than one number, or one in the name of a file that holds all frames.
    """
    found = _NUMBER.findall(path.name)
    if path.suffix.lower() in (".gif", *CODECS):
        if any(pattern != "#" for pattern in found):
            raise PictureError(
                f"{path}: {path.suffix} holds all frames; name it without a number, or the frames x.####.png"
            )
        return None
    if len(found) > 1:
        raise PictureError(f"{path}: more than one frame number in the name")
    return found[0] if found else None
