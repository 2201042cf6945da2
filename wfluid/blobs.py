"""Gaussians on the device: their profiles along x and y, and the boxes of cells that they reach."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
import warp as wp

from wfluid.forces import Blob
from wfluid.grid import Grid
from wfluid.kernels import forces, forces_adjoint, sources
from wfluid.kernels.cells import Indices, Layout, Real
from wfluid.state import Vector, vector
from wfluid.walls import Walls

_NUMBERS = 8
"""Of a blob on the device: center (2), radius, push (2), turn, swell, amount."""


class Blobs:
    """A number of Gaussians whose places, sizes and strengths change from step to step."""

    def __init__(self, count: int, grid: Grid, walls: Walls, device: wp.Device, gradients: bool = False):
        self.count, self.grid, self.device, self.layout = count, grid, device, Layout(grid.nx, grid.ny)
        self._x = _Axis(count, grid.nx, grid.hx, grid.width * walls.periodic[0], device)
        self._y = _Axis(count, grid.ny, grid.hy, grid.height * walls.periodic[1], device)
        self._gradients = gradients
        if gradients:
            self._sums = wp.zeros(forces_adjoint.ORDERS * count * grid.ny, dtype=Real, device=device)
        self._allocate()

    def another(self) -> Blobs:
        """The same for another step: numbers of its own, working memory in common."""
        other = copy(self)
        other._allocate()
        return other

    def _allocate(self) -> None:
        count = self.count
        self._numbers = wp.zeros(_NUMBERS * count, dtype=Real, device=self.device)
        self._center_x, self._center_y, self._radius, *self._strengths = (
            self._numbers[n * count : (n + 1) * count] for n in range(_NUMBERS)
        )
        self._boxes: Indices = wp.zeros(4 * count, dtype=wp.int32, device=self.device)
        self._table = np.zeros((_NUMBERS, count))
        if self._gradients:
            size = forces_adjoint.MOMENTS * count
            self._moments = [wp.zeros(size, dtype=Real, device=self.device) for _ in range(2)]

    def set(self, blobs: Sequence[Blob], live: Sequence[bool] = ()) -> None:
        """Put what they do in a step on the device.

        Those that are `live` act even where their strengths are 0, for the gradients with respect to these.
        """
        rows = [(*b.center, b.radius, *b.push, b.turn, b.swell, b.amount) for b in blobs]
        self._table = np.array(rows).reshape(self.count, _NUMBERS).T
        self._numbers.assign(np.ascontiguousarray(self._table).ravel())
        acting = np.any(self._table[3:], axis=0)
        self._boxes.assign(self._boxed(acting | np.array(live) if live else acting).ravel())

    def _boxed(self, acting: np.ndarray) -> np.ndarray:
        """The box of each, (blobs, 4), empty where it does not act: cells with a face or centre in reach."""
        boxes = np.zeros((self.count, 4), dtype=np.int32)
        reach = float(forces.CUT) * self._table[2]
        for n, (axis, center) in enumerate(zip((self._x, self._y), self._table, strict=False)):
            low, high = 0, axis.points
            if not axis.period:
                low = np.clip(np.floor((center - reach) / axis.h) - 1, 0, axis.points)
                high = np.clip(np.ceil((center + reach) / axis.h) + 1, 0, axis.points)
            boxes[:, 2 * n], boxes[:, 2 * n + 1] = low, high
        boxes[~acting] = 0
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

    def measure_push(self, velocity_bar: Vector) -> None:
        """Take the moments of the gradient with respect to what `push` adds to: launches only."""
        self._profile(faces=True)
        self._profile()
        x, y = self._x, self._y
        self._measure(0, velocity_bar[0], x.on_faces, y.at_centres)
        self._measure(1, velocity_bar[1], x.at_centres, y.on_faces)

    def measure_centres(self, f_bar: wp.array) -> None:
        """The same for `swell` and `pour`, which add to a field at centres: launches only."""
        self._measure(0, f_bar, *self._profile())

    def _measure(self, slot: int, f_bar: wp.array, x: Vector, y: Vector) -> None:
        (r_x, g_x), (r_y, g_y) = x, y
        ny, count, device = self.layout.ny, self.count, self.device
        inputs = [f_bar, g_x, r_x, self._boxes, ny, self.layout.pitch, self._x.layout.pitch]
        forces_adjoint.row_moments.launch(count * ny, device, inputs, [self._sums])
        inputs = [self._sums, g_y, r_y, self._boxes, ny, self._y.layout.pitch]
        forces_adjoint.moments.launch(count, device, inputs, [self._moments[slot]])

    def push_gradient(self) -> list[Blob]:
        """The gradients with respect to all numbers that the last `measure_push` found."""
        _, _, sigma, px, py, turn, *_ = self._table
        u, v = (_Moments(m, self.count) for m in self._moments)
        # the velocity gained is (px - turn r_y) g on x-faces and (py + turn r_x) g on y-faces
        center_x = (px * u(1, 0) - turn * u(1, 1) + py * v(1, 0) + turn * (v(2, 0) - v(0, 0))) / sigma
        center_y = (px * u(0, 1) - turn * (u(0, 2) - u(0, 0)) + py * v(0, 1) + turn * v(1, 1)) / sigma
        around = v(3, 0) + v(1, 2) - v(1, 0) - (u(2, 1) + u(0, 3) - u(0, 1))
        radius = (px * u.square + py * v.square + turn * around) / sigma
        columns = center_x, center_y, radius, u(0, 0), v(0, 0), v(1, 0) - u(0, 1)
        return [Blob((cx, cy), r, push=(x, y), turn=w) for cx, cy, r, x, y, w in zip(*columns, strict=True)]

    def swell_gradient(self) -> list[Blob]:
        """The same for `swell`, after `measure_centres`."""
        sigma, rate = self._table[2], self._table[6]
        s = _Moments(self._moments[0], self.count)
        # the divergence is rate (1 - r^2 / 2) g
        center_x = rate * (2 * s(1, 0) - (s(3, 0) + s(1, 2)) / 2) / sigma
        center_y = rate * (2 * s(0, 1) - (s(2, 1) + s(0, 3)) / 2) / sigma
        radius = rate * (2 * s.square - (s(4, 0) + 2 * s(2, 2) + s(0, 4)) / 2) / sigma
        columns = center_x, center_y, radius, s(0, 0) - s.square / 2
        return [Blob((cx, cy), r, swell=a) for cx, cy, r, a in zip(*columns, strict=True)]

    def pour_gradient(self) -> list[Blob]:
        """The same for `pour`, after `measure_centres`."""
        sigma, amount = self._table[2], self._table[7]
        s = _Moments(self._moments[0], self.count)
        columns = amount * s(1, 0) / sigma, amount * s(0, 1) / sigma, amount * s.square / sigma, s(0, 0)
        return [Blob((cx, cy), r, amount=a) for cx, cy, r, a in zip(*columns, strict=True)]

    def _profile(self, faces: bool = False) -> tuple[Vector, Vector]:
        """Compute, and return, distances and Gaussians of both axes, at faces or at centres."""
        for axis, center in ((self._x, self._center_x), (self._y, self._center_y)):
            start, out = (0.0, axis.on_faces) if faces else (0.5, axis.at_centres)
            inputs = [center, self._radius, start, axis.h, axis.period]
            forces.profile.launch(axis.layout, self.device, inputs, out)
        return self._x.at_centres, self._y.at_centres


class _Axis:
    """Profiles along one axis: distances [radii] and Gaussians, at faces and at centres, blob by blob."""

    def __init__(self, count: int, points: int, h: float, period: float, device: wp.Device):
        self.points, self.h, self.period = points, h, period
        self.layout = Layout(points, count)
        self.on_faces, self.at_centres = (vector(self.layout, device, 2) for _ in range(2))


class _Moments:
    """M_ab of every Gaussian (`kernels/forces_adjoint.py`), in double precision."""

    def __init__(self, values: wp.array, count: int):
        self._table = values.numpy().astype(np.float64).reshape(count, -1).T
        orders = range(forces_adjoint.ORDERS)
        self._places = [(a, b) for a in orders for b in orders if a + b < len(orders)]

    def __call__(self, a: int, b: int) -> np.ndarray:
        """Of r_x^a r_y^b g, one a Gaussian."""
        return self._table[self._places.index((a, b))]

    @property
    def square(self) -> np.ndarray:
        """Of |r|^2 g."""
        return self(2, 0) + self(0, 2)
