"""Progress of a run, on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from wfluid.keyframes.search import Progress

STAGES = {"spline": "gentlest flow", "march": "first guess", "coarse": "coarse grid", "fine": "fine grid"}
"""Names of the stages of a search."""


class FrameProgress:
    """A bar on stderr with frame rate and remaining time; silent when quiet or not on a terminal."""

    def __init__(self, frames: int, quiet: bool):
        self.frames, self.quiet = frames, quiet or not sys.stderr.isatty()

    def __enter__(self) -> Callable[[], None]:
        if self.quiet:
            return lambda: None
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self.bar = Progress(
            TextColumn("frames"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]:.1f} frames/s"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        task = self.bar.add_task("frames", total=self.frames, rate=0.0)
        self.bar.start()
        start = time.perf_counter()
        done = 0

        def advance() -> None:
            nonlocal done
            done += 1
            self.bar.update(task, advance=1, rate=done / (time.perf_counter() - start))

        return advance

    def __exit__(self, *_) -> None:
        if not self.quiet:
            self.bar.stop()


class SearchProgress:
    """A line on stderr with iteration, objective and residual; silent when quiet or not on a terminal."""

    def __init__(self, side: float, quiet: bool, out: TextIO | None = None):
        self._side, self._out = side, out or sys.stderr
        self._quiet, self._shown = quiet or not self._out.isatty(), False

    def __enter__(self) -> Callable[[Progress], None]:
        return self._show

    def _show(self, at: Progress) -> None:
        """Show an iteration."""
        if self._quiet:
            return
        self._shown = True
        text = (
            f"keyframes  {STAGES[at.stage]}: iteration {at.iteration}, objective {at.value:.3g}, "
            f"residual {at.worst * self._side:.3g} px"
        )
        print(f"\r{text:<78}", end="", file=self._out, flush=True)

    def __exit__(self, *_) -> None:
        if self._shown:
            print(file=self._out)
