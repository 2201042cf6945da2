"""Animated GIFs, with delays that keep the frame rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from wfluid.files import movie
from wfluid.pictures.encoder import file_bytes
from wfluid.pictures.fitting import Color, display_rgb
from wfluid.pictures.formats import PictureError
from wfluid.pictures.picture import Picture
from wfluid.system.atomic import atomic_write

LONGEST_DELAY = 65535
"""Longest delay of a GIF, limited by two bytes [1/100 s]."""

LEAST_DELAY = 2
"""Shortest delay of a GIF that browsers respect [1/100 s]."""


class GifWriter:
    """A writer of endless GIFs, which uses PyAV if it is installed, otherwise OpenImageIO.

    Frames are shown over a `background` in linear light, black by default, where they are transparent.
    Delays are integers in units of 1/100 s. They vary by one unit, so that their mean is 1 / fps.

    Raises:
        PictureError: a frame rate beyond the limits of delays.
    """

    def __init__(self, path: Path, fps: float, background: Color | None = None):
        if not 100 / LONGEST_DELAY <= fps <= 100 / LEAST_DELAY:
            limits = f"{100 / LONGEST_DELAY:.2g} … {100 // LEAST_DELAY}"
            raise PictureError(f"{path}: a GIF shows {limits} frames a second, not {fps:g}")
        self.path, self.fps, self.background = path, fps, background
        self.written: list[Path] = []
        self._frames: list[np.ndarray] = []

    def write(self, picture: Picture) -> None:
        """Keep the frame until `close`, because the palette is common to all frames."""
        self._frames.append(display_rgb(picture, self.background))

    def close(self) -> None:
        """Write the file, if there are frames."""
        if not self._frames:
            return
        hundredths = delays(len(self._frames), self.fps)
        make = movie.gif_bytes if movie.available() else _gif_bytes
        atomic_write(self.path, make(self.path, self._frames, hundredths))
        self.written.append(self.path)

    def abandon(self) -> None:
        """Do nothing: no file exists before `close`."""


def _gif_bytes(path: Path, frames: list[np.ndarray], hundredths: list[int]) -> bytes:
    """8-bit RGB frames as a GIF made by OpenImageIO, with a palette for each frame.

    OpenImageIO gives all frames one delay, so that the delays are corrected in the finished file.
    """
    import OpenImageIO as oiio

    height, width, channels = frames[0].shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    data = bytearray(file_bytes(path, [spec] * len(frames), frames))
    set_delays(data, hundredths)
    return bytes(data)


def delays(frames: int, fps: float) -> list[int]:
    """Delays of all frames [1/100 s], integers from 2 on whose sum is the rounded duration."""
    edges = np.floor(np.arange(frames + 1) * (100.0 / fps) + 0.5 + 1e-9).astype(int)
    return [max(LEAST_DELAY, int(delay)) for delay in np.diff(edges)]


def set_delays(gif: bytearray, hundredths: list[int]) -> None:
    """Write each frame's delay into a GIF's graphic control extensions (GIF89a, section 23), in place.

    Raises:
        PictureError: another number of delays than of frames.
    """
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
