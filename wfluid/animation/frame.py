"""One frame of an animation, and where time was spent."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from wfluid.pictures.picture import Picture
from wfluid.step.solver import SolveReport
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import MapQuality


@dataclass(frozen=True)
class Frame:
    """One picture of an animation, with its map and how good it is."""

    index: int
    """Number of the frame, from 0."""
    time: float
    """Its time [s]."""
    picture: Picture
    """The warped picture, densities over it; that of frame 0 is the untouched one."""
    map: CoordinateMap
    """Where its colours come from."""
    quality: MapQuality
    """What the map does to the picture."""
    solve: SolveReport | None
    """What the last step's solves left; None for frame 0."""
    layers: dict[str, Picture] = field(default_factory=dict)
    """The layers, warped as the picture is, by name."""
    densities: dict[str, np.ndarray] = field(default_factory=dict)
    """The densities at the grid's centres, (ny, nx), by name."""
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    """Where the points that are followed are now [longer side], (n, 2), x and y."""


@dataclass
class FrameTimes:
    """Where the time of an animation went [s]."""

    compile: float = 0.0
    """Loading the kernels, compiling them first where the cache has none."""
    simulate: float = 0.0
    """Stepping the fluid and judging its map."""
    lookup: float = 0.0
    """Rendering pictures."""
