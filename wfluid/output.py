"""Animations as files: numbered pictures, and GIF. The name decides."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

import numpy as np

from wfluid import movie
from wfluid.animation import Frame
from wfluid.picture import Picture, PictureError, check_ending, encode, whole_file, write_picture

FIRST_FRAME = 1001
"""Number of the first frame of a sequence (the convention of film work)."""

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


def open_output(path: str | os.PathLike, fps: float, start: int = FIRST_FRAME) -> Output:
    """The output for a name: `x.gif`, or a sequence `x.####.png`, `x.%04d.exr`.

    Raises:
        PictureError: a name that is neither, or a folder that does not exist or cannot be written.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise PictureError(f"{path.parent}: no such folder; make it first")
    if not os.access(path.parent, os.W_OK):
        raise PictureError(f"{path.parent}: this folder cannot be written to")
    if path.is_dir():
        raise PictureError(f"{path}: a folder; name a file, such as {path / 'frame.####.png'}")
    numbered = numbering(path)
    if numbered is not None:
        check_ending(path)
        return Sequence(path, numbered, start)
    if path.suffix.lower() == ".gif":
        return Gif(path, fps)
    raise PictureError(
        f"{path}: cannot tell the output's kind; name it x.gif or a sequence such as x.####.png"
    )


def write_animation(
    path: str | os.PathLike, frames: Iterable[Frame], fps: float = 24.0, start: int = FIRST_FRAME
) -> list[Path]:
    """Write frames as they come; returns the files written.

    Raises:
        PictureError: see `open_output`; nothing unfinished is left behind.
    """
    output = open_output(path, fps, start)
    try:
        for frame in frames:
            output.write(frame.picture)
        output.close()
    except BaseException:
        output.abandon()
        raise
    return output.written


def numbering(path: Path) -> str | None:
    """The part of a name that stands for the frame's number: a run of #, or %0Nd."""
    found = re.findall(r"#+|%0?\d*d", path.name)
    if len(found) > 1:
        raise PictureError(f"{path}: more than one frame number in the name")
    return found[0] if found else None


class Sequence:
    """Numbered stills."""

    def __init__(self, path: Path, pattern: str, start: int):
        self.path, self.pattern, self.next = path, pattern, start
        self.written: list[Path] = []

    def write(self, picture: Picture) -> None:
        """Write the next number."""
        digits = len(self.pattern) if self.pattern[0] == "#" else int(self.pattern.strip("%d") or 0)
        number = str(self.next).zfill(max(digits, 1))
        path = self.path.with_name(self.path.name.replace(self.pattern, number))
        write_picture(path, picture)
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
        if fps > 100 / LEAST_DELAY:
            raise PictureError(
                f"{path}: a GIF shows at most {100 // LEAST_DELAY} frames a second, not {fps:g}"
            )
        self.path, self.fps = path, fps
        self.written: list[Path] = []
        self._frames: list[np.ndarray] = []

    def write(self, picture: Picture) -> None:
        """Keep the frame: the format wants their number first."""
        stored, _ = encode(picture, "uint8", linear=False, with_alpha=False)
        if stored.shape[2] < 3:
            stored = np.repeat(stored[..., :1], 3, axis=2)
        self._frames.append(np.ascontiguousarray(stored[..., :3]))

    def close(self) -> None:
        """Write the file."""
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
