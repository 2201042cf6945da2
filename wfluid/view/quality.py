"""Measures of a map: change of area, displacement, sources outside the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wfluid.fields.arrays import read, zeros
from wfluid.fields.state import State
from wfluid.kernels.view import quality
from wfluid.view.coordinate_map import CoordinateMap


@dataclass(frozen=True)
class MapQuality:
    """Measures of a backward map: change of area, displacement, sources outside the picture."""

    jacobian_min: float
    """Least determinant of the map's Jacobian over the cells; a fold if it is at most 0."""
    jacobian_max: float
    """Greatest determinant of the map's Jacobian."""
    displacement_max: float
    """Longest displacement [longer side]."""
    displacement_mean: float
    """Mean length of the displacement [longer side]."""
    outside_fraction: float
    """Fraction of the cells whose source lies beyond a closed edge."""


def measure_map(state: State, warp: CoordinateMap) -> MapQuality:
    """The measures of a state's map; `warp` is its copy on the host (`CoordinateMap.of_state`)."""
    layout, device, grid = state.layout, state.u.device, state.grid
    least, greatest, outside = (zeros(layout.ny, device) for _ in range(3))
    closed = [int(not periodic) for periodic in warp.walls.periodic]
    inputs = [state.d_x, state.d_y, layout.nx, layout.ny, layout.pitch, *closed]
    quality.row_map_extremes.launch(layout.ny, device, inputs, [least, greatest, outside])
    length = np.hypot(*np.moveaxis(warp.displacement, 2, 0))
    return MapQuality(
        float(read(least).min()),
        float(read(greatest).max()),
        float(length.max()),
        float(length.mean()),
        float(read(outside).sum()) / (grid.nx * grid.ny),
    )
