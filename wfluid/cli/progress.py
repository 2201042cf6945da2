"""Progress of a run: a bar or a changing line on a terminal, otherwise a line now and then."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable
from typing import Any, TextIO

from wfluid.keyframes.search import Progress

EVERY = 10.0
"""Time between lines where stderr is no terminal [s]."""

STAGES = {"spline": "gentlest flow", "march": "first guess", "coarse": "coarse grid", "fine": "fine grid"}
"""Names of the stages of a search."""


class Seldom:
    """Prints a line on stderr at most every `EVERY` seconds, the first after that time."""

    def __init__(self, out: TextIO):
        self._out, self._last = out, time.perf_counter()

    def show(self, text: str) -> None:
        """Print a line if it is time."""
        if time.perf_counter() - self._last >= EVERY:
            print(text, file=self._out, flush=True)
            self._last = time.perf_counter()


class FrameProgress:
    """A bar on stderr with frame rate and remaining time; a line now and then where it is no terminal."""

    def __init__(self, frames: int, quiet: bool):
        self.frames, self.quiet = frames, quiet
        self.bar: Any = None

    def __enter__(self) -> Callable[[], None]:
        if self.quiet:
            return lambda: None
        return self._on_terminal() if sys.stderr.isatty() else self._in_lines()

    def _in_lines(self) -> Callable[[], None]:
        lines, count = Seldom(sys.stderr), itertools.count(1)
        return lambda: lines.show(f"frames     {next(count)} of {self.frames}")

    def _on_terminal(self) -> Callable[[], None]:
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
        if self.bar is not None:
            self.bar.stop()


class SearchProgress:
    """A line on stderr with the distance that is left; a line now and then where it is no terminal.

    With `verbose`, also iteration and objective.
    """

    def __init__(self, side: float, quiet: bool, out: TextIO | None = None, verbose: bool = False):
        self._side, self._out, self._verbose = side, out or sys.stderr, verbose
        self._quiet, self._shown = quiet, False
        self._lines = None if self._out.isatty() else Seldom(self._out)

    def __enter__(self) -> Callable[[Progress], None]:
        return self._show

    def _show(self, at: Progress) -> None:
        """Show an iteration."""
        if self._quiet:
            return
        text = f"keyframes  {STAGES[at.stage]}: the farthest point is {at.worst * self._side:.3g} px away"
        if self._verbose:
            text += f"; iteration {at.iteration}, objective {at.value:.3g}"
        if self._lines:
            self._lines.show(text)
            return
        self._shown = True
        print(f"\r{text:<78}", end="", file=self._out, flush=True)

    def __exit__(self, *_) -> None:
        if self._shown:
            print(file=self._out)
