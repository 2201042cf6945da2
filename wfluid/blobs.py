"""Gaussians on the device: their profiles along x and y, and the boxes of cells that they reach."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.forces import Blob
from wfluid.grid import Grid
from wfluid.kernels import forces, sources
from wfluid.kernels.cells import Indices, Layout, Real
from wfluid.state import Vector, vector
from wfluid.walls import Walls

_NUMBERS = 8
"""Of a blob on the device: center (2), radius, push (2), turn, swell, amount."""


class Blobs:
    """A number of Gaussians whose places, sizes and strengths change from step to step."""

    def __init__(self, count: int, grid: Grid, walls: Walls, device: wp.Device):
        self.count, self.grid, self.device, self.layout = count, grid, device, Layout(grid.nx, grid.ny)
        self._numbers = wp.zeros(_NUMBERS * count, dtype=Real, device=device)
        center_x, center_y, self._radius, *self._strengths = (
            self._numbers[n * count : (n + 1) * count] for n in range(_NUMBERS)
        )
        self._boxes: Indices = wp.zeros(4 * count, dtype=wp.int32, device=device)
        self._x = _Axis(center_x, grid.nx, grid.hx, grid.width * walls.periodic[0])
        self._y = _Axis(center_y, grid.ny, grid.hy, grid.height * walls.periodic[1])

    def set(self, blobs: Sequence[Blob]) -> None:
        """Put what they do in a step on the device."""
        rows = [(*b.center, b.radius, *b.push, b.turn, b.swell, b.amount) for b in blobs]
        table = np.array(rows).reshape(self.count, _NUMBERS).T
        self._numbers.assign(np.ascontiguousarray(table).ravel())
        self._boxes.assign(self._boxed(table).ravel())

    def _boxed(self, table: np.ndarray) -> np.ndarray:
        """The box of each, (blobs, 4), empty where it does nothing: cells with a face or centre in reach."""
        boxes = np.zeros((self.count, 4), dtype=np.int32)
        reach = float(forces.CUT) * table[2]
        for n, (axis, center) in enumerate(zip((self._x, self._y), table, strict=False)):
            low, high = 0, axis.points
            if not axis.period:
                low = np.clip(np.floor((center - reach) / axis.h) - 1, 0, axis.points)
                high = np.clip(np.ceil((center + reach) / axis.h) + 1, 0, axis.points)
            boxes[:, 2 * n], boxes[:, 2 * n + 1] = low, high
        boxes[~np.any(table[3:], axis=0)] = 0
        return boxes

    def push(self, velocity: Vector) -> None:
        """Add their pushes and turns to the velocity, in place: launches only."""
        x, y = self._x, self._y
        self._profile(faces=True)
        self._profile()
        profiles = [x.on_faces[1], x.at_centres[1], y.at_centres[1], y.on_faces[1]]
        inputs = [
            *self._strengths[:3],
            *profiles,
            x.at_centres[0],
            y.at_centres[0],
            x.layout.pitch,
            y.layout.pitch,
        ]
        forces.push.launch(self.layout, self.device, inputs, velocity, boxes=self._boxes)

    def swell(self, s: wp.array) -> None:
        """Add the divergence they prescribe to a field, in place: launches only."""
        (r_x, g_x), (r_y, g_y) = self._profile()
        inputs = [self._strengths[3], g_x, g_y, r_x, r_y, self._x.layout.pitch, self._y.layout.pitch]
        sources.swell.launch(self.layout, self.device, inputs, [s], boxes=self._boxes)

    def pour(self, rho: wp.array) -> None:
        """Add their amounts to a density, in place: launches only."""
        (_, g_x), (_, g_y) = self._profile()
        inputs = [self._strengths[4], g_x, g_y, self._x.layout.pitch, self._y.layout.pitch]
        sources.pour.launch(self.layout, self.device, inputs, [rho], boxes=self._boxes)

    def _profile(self, faces: bool = False) -> tuple[Vector, Vector]:
        """Compute, and return, distances and Gaussians of both axes, at faces or at centres."""
        for axis in (self._x, self._y):
            start, out = (0.0, axis.on_faces) if faces else (0.5, axis.at_centres)
            inputs = [axis.center, self._radius, start, axis.h, axis.period]
            forces.profile.launch(axis.layout, self.device, inputs, out)
        return self._x.at_centres, self._y.at_centres


class _Axis:
    """Profiles along one axis: distances [radii] and Gaussians, at faces and at centres, blob by blob."""

    def __init__(self, center: wp.array, points: int, h: float, period: float):
        self.center, self.points, self.h, self.period = center, points, h, period
        self.layout = Layout(points, len(center))
        self.on_faces, self.at_centres = (vector(self.layout, center.device, 2) for _ in range(2))
