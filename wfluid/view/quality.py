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
    fold_fraction: float
    """Fraction of the cells where the determinant is not positive: they are folded."""
    jacobian_min_at: tuple[float, float]
    """Position x, y of the cell with the least determinant [longer side]."""


def measure_map(state: State, warp: CoordinateMap) -> MapQuality:
    """The measures of a state's map; `warp` is its copy on the host (`CoordinateMap.of_state`)."""
    layout, device, grid = state.layout, state.u.device, state.grid
    rows = [zeros(layout.ny, device) for _ in range(5)]
    closed = [int(not periodic) for periodic in warp.walls.periodic]
    inputs = [state.d_x, state.d_y, layout.nx, layout.ny, layout.pitch, *closed]
    quality.row_map_extremes.launch(layout.ny, device, inputs, rows)
    least, column, greatest, folded, outside = (read(row) for row in rows)
    length = np.hypot(*np.moveaxis(warp.displacement, 2, 0))
    row, cells = int(least.argmin()), grid.nx * grid.ny
    return MapQuality(
        float(least[row]),
        float(greatest.max()),
        float(length.max()),
        float(length.mean()),
        float(outside.sum()) / cells,
        float(folded.sum()) / cells,
        ((float(column[row]) + 0.5) * grid.hx, (row + 0.5) * grid.hy),
    )
