"""One frame of an animation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from wfluid.pictures.picture import Picture
from wfluid.step.solver import SolveReport
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import MapQuality


@dataclass(frozen=True)
class Frame:
    """One picture of an animation, with its map and the measures of that map."""

    index: int
    """Number of the frame, from 0."""
    time: float
    """Time of the frame [s]."""
    picture: Picture
    """The warped picture with the densities over it; in frame 0 the untouched picture."""
    map: CoordinateMap
    """Backward map: the source in the untouched picture of every place of the frame."""
    quality: MapQuality
    """Measures of the map."""
    solve: SolveReport | None
    """Residuals of the last step's solves; None for frame 0."""
    layers: dict[str, Picture] = field(default_factory=dict)
    """The layers, warped by the same map, by name."""
    densities: dict[str, np.ndarray] = field(default_factory=dict)
    """The densities at the grid's centres, (ny, nx), by name."""
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    """Positions of the tracked points [longer side], (n, 2), x and y."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.index}, {self.time:.6g} s, {self.picture})"
