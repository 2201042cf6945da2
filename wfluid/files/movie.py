"""MP4, WebM and GIF through PyAV, the optional extra `video`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO

import numpy as np

from wfluid.domain.timeline import exact_rate
from wfluid.pictures.fitting import Color, display_rgb
from wfluid.pictures.picture import Picture
from wfluid.system.atomic import atomic_file, writing

CODECS = {
    ".mp4": ("libx264", {"crf": "16", "preset": "medium"}),
    ".webm": ("libvpx-vp9", {"crf": "24", "b": "0", "row-mt": "1"}),
}
"""Endings of movies, each with its codec and the options for a visually lossless picture."""

HUNDREDTH = Fraction(1, 100)
"""The unit of time of a GIF [s]."""

_BT709, _VIDEO_RANGE = 1, 1
"""Codes of H.273: the colours of BT.709, and 16 … 235 for black … white."""


def available() -> bool:
    """Whether PyAV is installed."""
    try:
        import av  # noqa: F401
    except ImportError:
        return False
    return True


class _Disk:
    """A file for FFmpeg, which reports a failed write late or not at all: the failure is kept for `check`."""

    def __init__(self, file: BinaryIO):
        self._file, self._failure = file, None
        self.seek, self.tell = file.seek, file.tell

    def write(self, data: bytes) -> int:
        """Write, unless a write failed before; returns the number of bytes as if all were well."""
        try:
            if self._failure is None:
                self._file.write(data)
        except OSError as error:
            self._failure = error
        return len(data)

    def check(self) -> None:
        """Report a failure.

        Raises:
            OSError: the first write that failed.
        """
        if self._failure is not None:
            raise self._failure


class MovieWriter:
    """A writer of MP4 or WebM that encodes each frame as it comes: 8-bit BT.709, 4:2:0.

    Frames are shown over a `background` in linear light, black by default, where they are transparent.
    The format requires an even width and height: an odd last row or column is repeated.
    """

    def __init__(self, path: Path, fps: float, background: Color | None = None):
        self.path, self.fps, self.background = path, fps, background
        self.written: list[Path] = []
        self._open, self._frames = ExitStack(), 0

    def write(self, picture: Picture) -> None:
        """Encode the next frame.

        Raises:
            WriteError: the file cannot be written to its end, as on a full disk.
        """
        frame = display_rgb(picture, self.background)
        with writing(self.path):
            self._encode(frame)

    def _encode(self, frame: np.ndarray) -> None:
        import av

        if self._frames == 0:
            self._begin(frame.shape[0] + frame.shape[0] % 2, frame.shape[1] + frame.shape[1] % 2)
        sizes = zip((self._stream.height, self._stream.width), frame.shape[:2], strict=True)
        padded = np.pad(frame, [*((0, even - size) for even, size in sizes), (0, 0)], mode="edge")
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(padded), format="rgb24")
        image = image.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
        image.pts, image.time_base = self._frames, 1 / self._stream.codec_context.framerate
        self._container.mux(self._stream.encode(image))
        self._disk.check()
        self._frames += 1

    def _begin(self, height: int, width: int) -> None:
        """Open the file for frames of a size."""
        import av

        ending = self.path.suffix.lower()
        self._disk = _Disk(self._open.enter_context(atomic_file(self.path)))
        self._open.callback(self._disk.check)
        codec, options = CODECS[ending]
        self._container = av.open(self._disk, "w", format=ending[1:], options={"fflags": "+bitexact"})
        self._open.callback(self._container.close)
        self._stream = self._container.add_stream(codec, rate=exact_rate(self.fps), options=options)
        self._stream.height, self._stream.width = height, width
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.flags |= av.codec.context.Flags.bitexact
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        context.color_range = _VIDEO_RANGE

    def close(self) -> None:
        """Finish the file and give it its name, if there are frames.

        Raises:
            WriteError: the file cannot be written to its end, as on a full disk.
        """
        if self._frames:
            with writing(self.path):
                self._container.mux(self._stream.encode(None))
                self._open.close()
            self.written.append(self.path)
            self._frames = 0

    def abandon(self) -> None:
        """Remove the unfinished file."""
        with suppress(OSError):  # the disk may still be full
            self._open.pop_all().__exit__(RuntimeError, RuntimeError(), None)
        self._frames = 0


def gif_bytes(_: Path, frames: Sequence[np.ndarray], delays: Sequence[int]) -> bytes:
    """8-bit RGB frames as an endless GIF with one palette and a delay for each frame [1/100 s]."""
    import av

    height, width, _ = frames[0].shape
    graph = av.filter.Graph()
    source = graph.add_buffer(width=width, height=height, format="rgb24", time_base=HUNDREDTH)
    split, sink = graph.add("split"), graph.add("buffersink")
    palette = graph.add("palettegen", "stats_mode=full")
    dither = graph.add("paletteuse", "dither=bayer:bayer_scale=3")
    source.link_to(split)
    split.link_to(palette, 0, 0)
    split.link_to(dither, 1, 0)
    palette.link_to(dither, 0, 1)
    dither.link_to(sink)
    graph.configure()
    start = 0
    for frame, delay in zip(frames, delays, strict=True):
        picture = av.VideoFrame.from_ndarray(frame, format="rgb24")
        picture.pts, picture.time_base = start, HUNDREDTH
        source.push(picture)
        start += delay
    source.push(None)
    options = {"loop": "0", "final_delay": str(delays[-1])}
    file = io.BytesIO()
    with av.open(file, "w", format="gif", options=options) as out:
        stream = out.add_stream("gif", rate=100)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        stream.codec_context.time_base = HUNDREDTH
        # every image covers its frame: some readers do not lay images over one another
        stream.options = {"gifflags": "-transdiff-offsetting"}
        for _ in frames:
            out.mux(stream.encode(sink.pull()))
        out.mux(stream.encode(None))
    return file.getvalue()
