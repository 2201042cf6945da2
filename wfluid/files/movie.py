"""Moving pictures through PyAV, the optional extra `video`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path

import numpy as np

from wfluid.pictures.picture import Picture, display_rgb
from wfluid.system.atomic import atomic_file


class MovieWriter:
    """MP4 or WebM, encoded as the frames come."""

    def __init__(self, path: Path, fps: float):
        self.path, self.fps = path, fps
        self.written: list[Path] = []
        self._stack = ExitStack()
        self._movie: Movie | None = None

    def write(self, picture: Picture) -> None:
        """Encode the next frame."""
        frame = display_rgb(picture)
        if self._movie is None:
            temporary = self._stack.enter_context(atomic_file(self.path))
            self._movie = Movie(temporary, self.path.suffix.lower(), frame.shape[1], frame.shape[0], self.fps)
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


HUNDREDTH = Fraction(1, 100)

CODECS = {
    ".mp4": ("libx264", {"crf": "16", "preset": "medium"}),
    ".webm": ("libvpx-vp9", {"crf": "24", "b": "0", "row-mt": "1"}),
}
"""Endings of movies, each with its codec and the options for a visually lossless picture."""


def available() -> bool:
    """Whether PyAV is installed."""
    try:
        import av  # noqa: F401
    except ImportError:
        return False
    return True


def write_gif(path: Path, frames: Sequence[np.ndarray]) -> None:
    """Write 8-bit RGB frames as a GIF with one palette made for all of them, looping for ever.

    Delays are left for the caller to set.
    """
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
    for index, frame in enumerate(frames):
        picture = av.VideoFrame.from_ndarray(frame, format="rgb24")
        picture.pts, picture.time_base = 10 * index, HUNDREDTH
        source.push(picture)
    source.push(None)
    with av.open(f"file:{path}", "w", format="gif", options={"loop": "0"}) as out:
        stream = out.add_stream("gif", rate=100)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        stream.codec_context.time_base = HUNDREDTH
        stream.options = {
            "gifflags": "-transdiff-offsetting"
        }  # whole frames: readers that do not composite see them
        for _ in frames:
            out.mux(stream.encode(sink.pull()))
        out.mux(stream.encode(None))


class Movie:
    """A movie file that takes 8-bit RGB frames of one size; BT.709, 4:2:0, so of even width and height."""

    def __init__(self, path: Path, ending: str, width: int, height: int, fps: float):
        import av

        codec, options = CODECS[ending]
        self._av = av
        self._even = (height + height % 2, width + width % 2)
        self._out = av.open(f"file:{path}", "w", options={"fflags": "+bitexact"})
        self._stream = self._out.add_stream(
            codec, rate=Fraction(fps).limit_denominator(1001), options=options
        )
        self._stream.height, self._stream.width = self._even
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.flags |= av.codec.context.Flags.bitexact
        context.colorspace = context.color_primaries = context.color_trc = 1  # BT.709, as the conversion
        context.color_range = 1  # 16 … 235
        self._written = 0

    def write(self, frame: np.ndarray) -> None:
        """Encode the next frame; an odd last row or column is doubled."""
        room = [(0, even - size) for even, size in zip(self._even, frame.shape[:2], strict=True)]
        padded = np.pad(frame, [*room, (0, 0)], mode="edge")
        picture = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(padded), format="rgb24")
        picture = picture.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
        picture.pts, picture.time_base = self._written, 1 / self._stream.codec_context.framerate
        self._out.mux(self._stream.encode(picture))
        self._written += 1

    def close(self) -> None:
        """Finish the file."""
        self._out.mux(self._stream.encode(None))
        self._out.close()

    def abandon(self) -> None:
        """Close the file without finishing it."""
        self._out.close()
