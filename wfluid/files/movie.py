"""MP4, WebM and GIF through PyAV, the optional extra `video`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path

import numpy as np

from wfluid.pictures.fitting import Color, display_rgb
from wfluid.pictures.picture import Picture
from wfluid.system.atomic import atomic_file

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
        """Encode the next frame."""
        import av

        frame = display_rgb(picture, self.background)
        if self._frames == 0:
            self._begin(frame.shape[0] + frame.shape[0] % 2, frame.shape[1] + frame.shape[1] % 2)
        sizes = zip((self._stream.height, self._stream.width), frame.shape[:2], strict=True)
        padded = np.pad(frame, [*((0, even - size) for even, size in sizes), (0, 0)], mode="edge")
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(padded), format="rgb24")
        image = image.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
        image.pts, image.time_base = self._frames, 1 / self._stream.codec_context.framerate
        self._container.mux(self._stream.encode(image))
        self._frames += 1

    def _begin(self, height: int, width: int) -> None:
        """Open the file for frames of a size."""
        import av

        temporary = self._open.enter_context(atomic_file(self.path))
        codec, options = CODECS[self.path.suffix.lower()]
        self._container = av.open(f"file:{temporary}", "w", options={"fflags": "+bitexact"})
        self._open.callback(self._container.close)
        rate = Fraction(self.fps).limit_denominator(1001)
        self._stream = self._container.add_stream(codec, rate=rate, options=options)
        self._stream.height, self._stream.width = height, width
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.flags |= av.codec.context.Flags.bitexact
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        context.color_range = _VIDEO_RANGE

    def close(self) -> None:
        """Finish the file and give it its name, if there are frames."""
        if self._frames:
            self._container.mux(self._stream.encode(None))
            self._open.close()
            self.written.append(self.path)
            self._frames = 0

    def abandon(self) -> None:
        """Remove the unfinished file."""
        self._open.pop_all().__exit__(RuntimeError, RuntimeError(), None)
        self._frames = 0


def write_gif(path: Path, frames: Sequence[np.ndarray], delays: Sequence[int]) -> None:
    """Write 8-bit RGB frames as an endless GIF with one palette and a delay for each frame [1/100 s]."""
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
    with av.open(f"file:{path}", "w", format="gif", options=options) as out:
        stream = out.add_stream("gif", rate=100)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        stream.codec_context.time_base = HUNDREDTH
        # every image covers its frame: some readers do not lay images over one another
        stream.options = {"gifflags": "-transdiff-offsetting"}
        for _ in frames:
            out.mux(stream.encode(sink.pull()))
        out.mux(stream.encode(None))
