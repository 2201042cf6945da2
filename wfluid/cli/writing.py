"""Frames written by a second thread while the next are computed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.animation.frame import Frame
from wfluid.animation.run import QUEUED_FRAMES, Run
from wfluid.cli.progress import FrameProgress
from wfluid.cli.report import Report
from wfluid.files.output import FrameWriter, open_output, output_notes
from wfluid.files.tracks import TrackWriter
from wfluid.pictures.color import linear_color
from wfluid.pictures.formats import Encoding
from wfluid.pictures.picture import Picture
from wfluid.scene.format import OutputTable
from wfluid.scene.scene import Scene
from wfluid.system.interrupt import HeldInterrupt
from wfluid.view.densities import upsample


class _Writer(Protocol):
    written: list[Path]

    def close(self) -> None: ...
    def abandon(self) -> None: ...


Output = tuple[_Writer, Callable[[Frame], None]]
"""The writer of an output, and the function that gives it a frame."""


def kept_frames(scene: Scene) -> int:
    """Number of outputs that keep every frame in memory until the last."""
    return sum(Path(output.file).suffix.lower() == ".gif" for output in scene.outputs)


def open_writers(scene: Scene, animation: Animation) -> list[Output]:
    """The writers of a scene's outputs.

    Raises:
        FileError: an ending of no known format, or a folder that cannot be written.
    """
    found: list[Output] = []
    width, height = scene.picture.size or (animation.picture.width, animation.picture.height)
    for output in scene.outputs:
        if output.of == "report":
            continue
        path = scene.folder / output.file
        if output.of == "tracks":
            found.append(_track_output(path, max(width, height)))
            continue
        writer = open_output(path, scene.timeline.fps, output.start, _encoding(scene, output))
        found.append(_picture_output(writer, output.of))
    return found


def notes_of_outputs(scene: Scene, picture: Picture, layers: Mapping[str, Picture]) -> Iterator[str]:
    """What outputs do not hold of frames like a picture and of its layers, which a user should know.

    Raises:
        PictureError: an encoding that an output's format does not support.
    """
    for output in scene.outputs:
        if output.of in ("report", "tracks"):
            continue
        density = Picture(np.zeros((1, 1, 1), np.float32), data=True)
        shown = picture if output.of == "picture" else layers.get(output.of, density)
        yield from output_notes(scene.folder / output.file, shown, _encoding(scene, output))


def _encoding(scene: Scene, output: OutputTable) -> Encoding:
    """How an output of a scene is written."""
    background = scene.frames.background
    return replace(output.encoding, background=None if background is None else linear_color(background))


def _track_output(path: Path, side: float) -> Output:
    writer = TrackWriter(path, side)
    return writer, lambda frame: writer.write(frame.time, frame.points)


def _picture_output(writer: FrameWriter, of: str) -> Output:
    return writer, lambda frame: writer.write(_shown(frame, of))


def _shown(frame: Frame, of: str) -> Picture:
    """The picture, the layer or the density of a frame, by the name that an output has in `of`."""
    if of == "picture":
        return frame.picture
    if of in frame.layers:
        return frame.layers[of]
    width, height = frame.picture.width, frame.picture.height
    values = upsample(np.maximum(frame.densities[of], 0.0), width, height, frame.map.walls.periodic)
    return Picture(values[..., None], dtype="float", data=True)


def write_frames(
    run: Run,
    writers: Sequence[Output],
    report: Report,
    quiet: bool,
) -> float:
    """Compute frames and write them from a second thread; returns the seconds spent writing."""
    writing = 0.0

    def write(frame: Frame) -> None:
        nonlocal writing
        start = time.perf_counter()
        for _, take in writers:
            take(frame)
        writing += time.perf_counter() - start

    waiting: list[Future] = []
    try:
        with (
            HeldInterrupt() as interrupt,
            ThreadPoolExecutor(1) as pool,
            FrameProgress(run.frame_count, quiet) as advance,
        ):
            for frame in run:
                interrupt.check()
                report.add(frame)
                if len(waiting) >= QUEUED_FRAMES:
                    waiting.pop(0).result()
                waiting.append(pool.submit(write, frame))
                advance()
            for future in waiting:
                future.result()
        start = time.perf_counter()
        for writer, _ in writers:
            writer.close()
        return writing + time.perf_counter() - start
    except KeyboardInterrupt:
        for writer, _ in writers:
            writer.close()  # keep the frames so far: a movie ends at its last frame
        print(f"interrupted; finished: {', '.join(finished(writers)) or 'nothing'}", file=sys.stderr)
        raise
    except BaseException:
        for writer, _ in writers:
            writer.abandon()
        raise


def finished(writers: Sequence[Output]) -> list[str]:
    """The complete files of each output; of a sequence the first and the last."""
    found = []
    for writer, _ in writers:
        ends = [near(path) for path in writer.written[:1] + writer.written[1:][-1:]]
        found.append((" … " if len(writer.written) > 2 else ", ").join(ends))
    return list(filter(None, found))


def near(path: Path) -> str:
    """A name as seen from the working directory, if it lies below it."""
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else str(path)
