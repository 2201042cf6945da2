"""The backward map of one frame: for every place, its source in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.piecewise import catmull_rom
from wfluid.domain.walls import Walls
from wfluid.fields.ghosts import ghost_table
from wfluid.fields.state import State
from wfluid.kernels.cell.layout import HALO


@dataclass(frozen=True)
class CoordinateMap:
    """A backward map at the centres of a grid's cells; `source_of` and `source_at` evaluate it."""

    grid: Grid
    """Grid of the map."""
    walls: Walls
    """Boundary conditions, which determine the map beyond the edges."""
    displacement: np.ndarray
    """Source minus position at centres [longer side], (ny, nx, 2), x then y."""

    def __repr__(self) -> str:
        rows, columns, _ = self.displacement.shape
        return f"CoordinateMap({columns} x {rows} cells)"

    @classmethod
    def of_state(cls, state: State, walls: Walls) -> CoordinateMap:
        """A copy of a state's map."""
        return cls(state.grid, walls, np.stack(state.displacement, axis=2))

    @property
    def source_of(self) -> np.ndarray:
        """Source of each centre [longer side], (ny, nx, 2), x then y."""
        grid = self.grid
        x = (np.arange(grid.nx) + 0.5) * grid.hx
        y = (np.arange(grid.ny) + 0.5) * grid.hy
        return self.displacement + np.stack(np.meshgrid(x, y), axis=2)

    def source_at(self, places: np.ndarray) -> np.ndarray:
        """Sources of any places (n, 2) [longer side]: (n, 2), x then y.

        Computed by Catmull-Rom interpolation of the displacement, like look-ups of pictures.
        """
        grid, places = self.grid, np.asarray(places, dtype=np.float64)
        spacing = np.array([grid.hx, grid.hy])
        at = places / spacing - 0.5
        first = np.floor(at).astype(int)
        weights, near = catmull_rom(at - first), HALO + np.arange(-1, 3)
        found = places.copy()
        for component, (rule_x, rule_y) in enumerate(
            (self.walls.displacement_x_rules(), self.walls.displacement_y_rules())
        ):
            columns, signs_x = (a[first[:, :1] + near] for a in ghost_table(grid.nx, rule_x))
            rows, signs_y = (a[first[:, 1:] + near] for a in ghost_table(grid.ny, rule_y))
            values = self.displacement[rows[:, :, None], columns[:, None, :], component]
            weights_x, weights_y = weights[..., 0].T * signs_x, weights[..., 1].T * signs_y
            found[:, component] += np.einsum("nj,nji,ni->n", weights_y, values, weights_x)
        return found

    def slope_at(self, place: np.ndarray) -> np.ndarray:
        """The Jacobian at a place, (2, 2), a row per component of the source; one-sided at edges."""
        grid, step = self.grid, np.diag([self.grid.hx, self.grid.hy])
        ahead, behind = (np.clip(place + by, 0.0, (grid.width, grid.height)) for by in (step, -step))
        return ((self.source_at(ahead) - self.source_at(behind)) / np.diag(ahead - behind)[:, None]).T
