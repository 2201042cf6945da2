"""Animations as files: numbered stills, GIF or movies, chosen by the name."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from wfluid.domain.limits import FIRST_FRAME
from wfluid.files import movie
from wfluid.files.gif import GifWriter
from wfluid.files.movie import MovieWriter
from wfluid.files.names import check_folder, numbering
from wfluid.files.stills import StillsWriter
from wfluid.pictures.fitting import display_notes, fit
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.pictures.picture import Picture


class FrameWriter(Protocol):
    """Writes frames in their order; a file has its final name only once it is complete."""

    written: list[Path]
    """Finished files."""

    def write(self, picture: Picture) -> None:
        """Write the next frame, or keep it until `close`."""
        ...

    def close(self) -> None:
        """Finish a file that contains all frames."""
        ...

    def abandon(self) -> None:
        """Remove unfinished files."""
        ...


def open_output(
    path: str | os.PathLike, fps: float, start: int = FIRST_FRAME, encoding: Encoding | None = None
) -> FrameWriter:
    """The writer for a name: `x.gif`, `x.mp4`, `x.webm`, or a sequence `x.####.png`, `x.%04d.exr`.

    `start` is the number of the first frame of a sequence, `encoding` the encoding of its stills; GIFs
    and movies have its background only.

    Raises:
        PictureError: an unknown kind of name, a name that cannot be written to, a movie without the extra
            `video`, or an encoding that the format does not support.
    """
    path, encoding = Path(path), encoding or Encoding()
    check_folder(path, start)
    numbered = numbering(path)
    if numbered is not None:
        encoding.check(path)
        if start < 0:
            raise PictureError(f"first frame {start}: expected 0 or more")
        return StillsWriter(path, numbered, start, encoding)
    encoding.check_movie(path)
    ending = path.suffix.lower()
    if ending == ".gif":
        return GifWriter(path, fps, encoding.background)
    if ending in movie.CODECS:
        if not movie.available():
            raise PictureError(f"{path}: movies need PyAV; install it with: pip install 'wfluid[video]'")
        return MovieWriter(path, fps, encoding.background)
    kinds = f"x.gif, {', '.join(f'x{known}' for known in movie.CODECS)}, or a sequence such as x.####.png"
    raise PictureError(f"{path}: cannot tell the output's kind; name it {kinds}")


def output_notes(
    path: str | os.PathLike, picture: Picture, encoding: Encoding | None = None
) -> tuple[str, ...]:
    """What an output does not hold of frames like a picture, which a user should know.

    Raises:
        PictureError: an encoding that the format does not support.
    """
    path, encoding = Path(path), encoding or Encoding()
    if numbering(path) is not None:
        return fit(path, picture, encoding).notes
    encoding.check_movie(path)
    return display_notes(path, picture)


class HasPicture(Protocol):
    """Anything that shows a picture, such as a `Frame`."""

    @property
    def picture(self) -> Picture:
        """The picture to write."""
        ...


def write_animation(
    path: str | os.PathLike,
    frames: Iterable[HasPicture],
    fps: float = 24.0,
    start: int = FIRST_FRAME,
    encoding: Encoding | None = None,
) -> list[Path]:
    """Write frames one by one as they are computed; returns the files written.

    Raises:
        PictureError: see `open_output`; nothing unfinished is left behind.
        WriteError: a file cannot be written to its end, as on a full disk.
    """
    output = open_output(path, fps, start, encoding)
    try:
        for frame in frames:
            output.write(frame.picture)
        output.close()
    except BaseException:
        output.abandon()
        raise
    return output.written
