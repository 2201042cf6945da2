"""Positions of tracked points, as a table of comma-separated values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wfluid.system.atomic import atomic_write_text
from wfluid.system.errors import FileError


class TrackWriter:
    """A writer of a CSV file with a row per frame and point: frame, time [s], point (from 0), x, y [px].

    `side` is the longer side of the frames [px].

    Raises:
        FileError: a name that does not end in .csv.
    """

    def __init__(self, path: Path, side: float):
        if path.suffix.lower() != ".csv":
            raise FileError(f"{path}: tracks are written as .csv")
        self.path, self._side = path, side
        self.written: list[Path] = []
        self._rows: list[str] = []
        self._frames = 0

    def write(self, time: float, points: Sequence[tuple[float, float]] | np.ndarray) -> None:
        """Add the points of the next frame, (n, 2) [longer side]."""
        for n, (x, y) in enumerate(points):
            self._rows.append(f"{self._frames},{time:.6g},{n},{x * self._side:.4f},{y * self._side:.4f}")
        self._frames += 1

    def close(self) -> None:
        """Write the file, if there are frames."""
        if self._rows:
            atomic_write_text(self.path, "\n".join(["frame,time,point,x,y", *self._rows]) + "\n")
            self.written.append(self.path)

    def abandon(self) -> None:
        """Do nothing: no file exists before `close`."""
