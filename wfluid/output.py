"""Animations as files: numbered pictures, GIF and movies. The name decides."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol

import numpy as np

from wfluid import movie
from wfluid.files import remove_leftovers, whole_file
from wfluid.picture import Encoding, Picture, PictureError, encode, write_picture

FIRST_FRAME = 1001
"""Number of the first frame of a sequence (the convention of film work)."""

LONGEST_DELAY = 65535
"""Longest GIF delay that its two bytes hold [1/100 s]."""

LEAST_DELAY = 2
"""Shortest GIF delay that browsers obey [1/100 s]."""


class Output(Protocol):
    """Where frames go, in order; nothing is there under its final name before it is whole."""

    written: list[Path]
    """Files that are finished."""

    def write(self, picture: Picture) -> None:
        """Take the next frame."""
        ...

    def close(self) -> None:
        """Finish what is written one file for all frames."""
        ...

    def abandon(self) -> None:
        """Remove what is unfinished."""
        ...


def open_output(
    path: str | os.PathLike, fps: float, start: int = FIRST_FRAME, encoding: Encoding | None = None
) -> Output:
    """The output for a name: `x.gif`, `x.mp4`, `x.webm`, or a sequence `x.####.png`, `x.%04d.exr`.

    `start` is the number of a sequence's first frame, `encoding` how its stills are written.

    Raises:
        PictureError: a name that is none of these, a folder that does not exist or cannot be written, a
            movie without the extra `video`, or an encoding that the format does not have.
    """
    path, encoding = Path(path), encoding or Encoding()
    check_folder(path)
    numbered = numbering(path)
    if numbered is not None:
        encoding.check(path)
        if start < 0:
            raise PictureError(f"first frame {start}: expected 0 or more")
        return Sequence(path, numbered, start, encoding)
    ending = path.suffix.lower()
    if ending == ".gif":
        return Gif(path, fps)
    if ending in movie.CODECS:
        if not movie.available():
            raise PictureError(f"{path}: movies need PyAV; install it with: pip install 'wfluid[video]'")
        return MovieFile(path, fps)
    kinds = f"x.gif, {', '.join(f'x{known}' for known in movie.CODECS)}, or a sequence such as x.####.png"
    raise PictureError(f"{path}: cannot tell the output's kind; name it {kinds}")


def check_folder(path: Path) -> None:
    """Refuse a file whose folder is not there or cannot be written; clear what killed runs left in it.

    Raises:
        PictureError: with the reason.
    """
    if not path.parent.is_dir():
        raise PictureError(f"{path.parent}: no such folder; make it first")
    if not os.access(path.parent, os.W_OK):
        raise PictureError(f"{path.parent}: this folder cannot be written to")
    if path.is_dir():
        raise PictureError(f"{path}: a folder; name a file in it")
    remove_leftovers(path.parent)


class HasPicture(Protocol):
    """Anything that shows a picture, such as a `Frame`."""

    picture: Picture


def write_animation(
    path: str | os.PathLike,
    frames: Iterable[HasPicture],
    fps: float = 24.0,
    start: int = FIRST_FRAME,
    encoding: Encoding | None = None,
) -> list[Path]:
    """Write frames as they come; returns the files written.

    Raises:
        PictureError: see `open_output`; nothing unfinished is left behind.
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


def names(path: Path, start: int, frames: int) -> set[Path]:
    """Every file that an animation of so many frames writes under a name, resolved."""
    pattern = numbering(path)
    if pattern is None:
        return {path.resolve()}
    return {_numbered(path, pattern, n).resolve() for n in range(start, start + frames)}


def _numbered(path: Path, pattern: str, number: int) -> Path:
    digits = len(pattern) if pattern[0] == "#" else int(pattern.strip("%d") or 0)
    return path.with_name(path.name.replace(pattern, str(number).zfill(max(digits, 1))))


def numbering(path: Path) -> str | None:
    """The part of a name that stands for the frame's number: a run of #, or %0Nd."""
    found = re.findall(r"#+|%0?\d*d", path.name)
    if len(found) > 1:
        raise PictureError(f"{path}: more than one frame number in the name")
    return found[0] if found else None


class Sequence:
    """Numbered stills."""

    def __init__(self, path: Path, pattern: str, start: int, encoding: Encoding):
        self.path, self.pattern, self.next, self.encoding = path, pattern, start, encoding
        self.written: list[Path] = []

    def write(self, picture: Picture) -> None:
        """Write the next number."""
        path = _numbered(self.path, self.pattern, self.next)
        write_picture(path, picture, self.encoding)
        self.written.append(path)
        self.next += 1

    def close(self) -> None:
        """Nothing is left to do."""

    def abandon(self) -> None:
        """Finished files stay."""


class Gif:
    """An animated GIF that loops for ever: PyAV writes it where installed, else OpenImageIO.

    GIF counts in hundredths of a second: the delays are spread so that their mean is 1 / fps.
    """

    def __init__(self, path: Path, fps: float):
        if not 100 / LONGEST_DELAY <= fps <= 100 / LEAST_DELAY:
            limits = f"{100 / LONGEST_DELAY:.2g} … {100 // LEAST_DELAY}"
            raise PictureError(f"{path}: a GIF shows {limits} frames a second, not {fps:g}")
        self.path, self.fps = path, fps
        self.written: list[Path] = []
        self._frames: list[np.ndarray] = []

    def write(self, picture: Picture) -> None:
        """Keep the frame: the format wants their number first."""
        self._frames.append(display_rgb(picture))

    def close(self) -> None:
        """Write the file, if there are frames."""
        if not self._frames:
            return
        with whole_file(self.path) as temporary:
            if movie.available():
                movie.write_gif(temporary, self._frames)
            else:
                _write_gif(temporary, self._frames)
            data = bytearray(temporary.read_bytes())
            set_delays(data, delays(len(self._frames), self.fps))
            temporary.write_bytes(data)
        self.written.append(self.path)

    def abandon(self) -> None:
        """Nothing is on the disk before `close`."""


class MovieFile:
    """MP4 or WebM, encoded as the frames come."""

    def __init__(self, path: Path, fps: float):
        self.path, self.fps = path, fps
        self.written: list[Path] = []
        self._stack = ExitStack()
        self._movie: movie.Movie | None = None

    def write(self, picture: Picture) -> None:
        """Encode the next frame."""
        frame = display_rgb(picture)
        if self._movie is None:
            temporary = self._stack.enter_context(whole_file(self.path))
            self._movie = movie.Movie(
                temporary, self.path.suffix.lower(), frame.shape[1], frame.shape[0], self.fps
            )
        self._movie.write(frame)

    def close(self) -> None:
        """Finish the file, if there are frames, and give it its name."""
        if self._movie is not None:
            self._movie.close()
            self._stack.close()
            self.written.append(self.path)
            self._movie = None

    def abandon(self) -> None:
        """Remove what is unfinished."""
        if self._movie is not None:
            self._movie.abandon()
            self._stack.pop_all().__exit__(RuntimeError, RuntimeError(), None)
            self._movie = None


def display_rgb(picture: Picture) -> np.ndarray:
    """A picture as 8-bit sRGB (height, width, 3), over black where it is transparent; grey is repeated."""
    stored, _ = encode(picture, "uint8", linear=False, channels=3)
    if stored.shape[2] < 3:
        stored = np.repeat(stored[..., :1], 3, axis=2)
    return np.ascontiguousarray(stored)


def _write_gif(path: Path, frames: list[np.ndarray]) -> None:
    """Write 8-bit RGB frames as a GIF with OpenImageIO, a palette a frame."""
    import OpenImageIO as oiio

    height, width, channels = frames[0].shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    out = oiio.ImageOutput.create(str(path))
    done = out.open(str(path), (spec,) * len(frames))
    for index, frame in enumerate(frames):
        done = done and (index == 0 or out.open(str(path), spec, "AppendSubimage"))
        done = done and out.write_image(frame)
    message = out.geterror()
    if not (out.close() and done):
        raise PictureError(f"{path}: cannot be written ({message.strip() or 'no reason given'})")


def delays(frames: int, fps: float) -> list[int]:
    """Delay of each frame [1/100 s]: whole, never below 2, their sum the animation's length rounded."""
    edges = np.floor(np.arange(frames + 1) * (100.0 / fps) + 0.5 + 1e-9).astype(int)
    return [max(LEAST_DELAY, int(delay)) for delay in np.diff(edges)]


def set_delays(gif: bytearray, hundredths: list[int]) -> None:
    """Write each frame's delay into a GIF's graphic control extensions (GIF89a, section 23), in place."""
    at = 13 + _table_size(gif[10])
    frame = 0
    while gif[at] != 0x3B:  # the trailer
        if gif[at] == 0x21:
            if gif[at + 1] == 0xF9:
                gif[at + 4 : at + 6] = hundredths[frame].to_bytes(2, "little")
                frame += 1
            at = _after_blocks(gif, at + 2)
        else:  # an image: descriptor, local palette, code size, data
            at = _after_blocks(gif, at + 10 + _table_size(gif[at + 9]) + 1)
    if frame != len(hundredths):
        raise PictureError(f"the GIF has {frame} frames, expected {len(hundredths)}")


def _table_size(flags: int) -> int:
    return 3 << ((flags & 7) + 1) if flags & 0x80 else 0


def _after_blocks(gif: bytearray, at: int) -> int:
    while gif[at]:
        at += gif[at] + 1
    return at + 1
