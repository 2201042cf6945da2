"""Animations as files: numbered stills, GIF or movies, chosen by the name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Protocol

import numpy as np

from wfluid.domain.limits import FIRST_FRAME, FPS
from wfluid.files import movie
from wfluid.files.gif import GifWriter
from wfluid.files.movie import MovieWriter
from wfluid.files.names import check_folder, numbering
from wfluid.files.stills import StillsWriter
from wfluid.pictures.fitting import display_notes, fit
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.pictures.picture import Picture, PictureLike, picture_of


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
            raise PictureError(
                f"{path}: movies need PyAV; install it in the clone of wfluid: pip install -e '.[video]'"
            )
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
    frames: Iterable[HasPicture | PictureLike],
    fps: float | None = None,
    start: int = FIRST_FRAME,
    encoding: Encoding | None = None,
) -> list[Path]:
    """Write frames one by one as they are computed; returns the files written.

    Frames are those of an animation or a morph, or anything that `Picture.of` takes. `fps` is the frame rate
    [1/s]; by default that of the frames, which have times, and 24 for pictures, which have none.

    Raises:
        TypeError: frames that are no pictures.
        PictureError: see `open_output`; nothing unfinished is left behind.
        WriteError: a file cannot be written to its end, as on a full disk.
    """
    one = isinstance(frames, str | os.PathLike | Picture) or (
        isinstance(frames, np.ndarray) and frames.ndim < 4
    )
    if one or not isinstance(frames, Iterable):
        got = "one picture" if one else type(frames).__name__
        raise TypeError(f"frames: expected a list of frames or pictures, got {got}")
    if fps is None and hasattr(frames, "fps"):
        fps = frames.fps
    elif fps is None:
        frames = iter(frames)
        first = list(islice(frames, 2))
        fps, frames = _rate_of(first), chain(first, frames)
    output = open_output(path, fps, start, encoding)
    try:
        for frame in frames:
            output.write(picture_of("frames", getattr(frame, "picture", frame)))
        output.close()
    except BaseException:
        output.abandon()
        raise
    return output.written


def _rate_of(first: Sequence[object]) -> float:
    """The frame rate of the first two frames [1/s]."""
    times = [frame.time for frame in first if hasattr(frame, "time")]
    if len(times) < 2 or times[0] == times[1]:
        return FPS
    return round(1 / abs(times[1] - times[0]), 6)
