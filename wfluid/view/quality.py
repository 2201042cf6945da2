"""Measures of a map: change of area, strain, displacement, sources outside the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wfluid.fields.arrays import to_numpy, zeros
from wfluid.fields.state import State
from wfluid.kernels.view import quality
from wfluid.view.coordinate_map import CoordinateMap

STRAINED = 0.99
"""Fraction of the cells that the log-strain is that of."""


@dataclass(frozen=True)
class MapQuality:
    """Measures of a backward map: change of area, strain, displacement, sources outside the picture."""

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
    log_strain: float
    """Log-strain that 99 % of the cells do not exceed: the larger |ln s| of the two singular values."""


def measure_map(state: State, warp: CoordinateMap) -> MapQuality:
    """The measures of a state's map; `warp` is its copy on the host (`CoordinateMap.of_state`)."""
    layout, device, grid = state.layout, state.u.device, state.grid
    fields = [zeros(layout.size, device) for _ in range(3)]
    closed = [int(not periodic) for periodic in warp.walls.periodic]
    inputs = [state.d_x, state.d_y, layout.nx, layout.ny, layout.pitch, *closed]
    quality.measure.launch(layout, device, inputs, fields)
    jacobian, stretch, outside = (to_numpy(field, layout) for field in fields)
    length = np.hypot(*np.moveaxis(warp.displacement, 2, 0))
    row, column = divmod(int(jacobian.argmin()), grid.nx)
    rank = math.ceil(STRAINED * stretch.size) - 1
    return MapQuality(
        float(jacobian[row, column]),
        float(jacobian.max()),
        float(length.max()),
        float(length.mean()),
        float(outside.mean(dtype=np.float64)),
        float(np.mean(~(jacobian > 0))),
        ((column + 0.5) * grid.hx, (row + 0.5) * grid.hy),
        math.log(np.partition(stretch.ravel(), rank)[rank]),
    )
