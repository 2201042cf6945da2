"""Moving pictures through PyAV, the optional extra `video`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

HUNDREDTH = Fraction(1, 100)


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
    with av.open(str(path), "w", format="gif", options={"loop": "0"}) as out:
        stream = out.add_stream("gif", rate=100)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        stream.codec_context.time_base = HUNDREDTH
        stream.options = {
            "gifflags": "-transdiff-offsetting"
        }  # whole frames: readers that do not composite see them
        for _ in frames:
            out.mux(stream.encode(sink.pull()))
        out.mux(stream.encode(None))
