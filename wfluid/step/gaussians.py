"""Gaussians on the device: their profiles and boxes of cells, and the forces and growths they make up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import Vector, field, fill, from_numpy, vector, zeros
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.adjoint import forces as forces_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.real import Indices
from wfluid.kernels.cell.strips import alone
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import forces, sources
from wfluid.model.force import GaussianImpulse
from wfluid.model.painted import Painted

_NUMBERS = 8
"""Numbers of a Gaussian on the device: center (2), radius, push (2), turn, swell, amount."""

_FIELDS = 2
"""Fields with moments: the two components of a velocity."""


def gaussian_impulse_of(row: Sequence[float]) -> GaussianImpulse:
    """The numbers of one Gaussian, or the gradients with respect to them, by name."""
    center_x, center_y, radius, push_x, push_y, turn, swell, amount = map(float, row)
    return GaussianImpulse((center_x, center_y), radius, (push_x, push_y), turn, swell, amount)


class GaussianBatch:
    """Gaussians whose centers, radii and strengths change from step to step.

    `row` computes the numbers and boxes of a step. `bind` sets the device arrays from which the launches
    read them.
    """

    def __init__(self, count: int, grid: Grid, walls: Walls, device: wp.Device, gradients: bool = False):
        self.count, self.device, self.layout = count, device, Layout(grid.nx, grid.ny)
        self.numbers, self.boxes = _NUMBERS * count, 4 * count
        self.moments = _FIELDS * forces_adjoint.MOMENTS * count if gradients else 0
        self._x = _Profiles(count, grid.nx, grid.hx, grid.width * walls.periodic[0], device)
        self._y = _Profiles(count, grid.ny, grid.hy, grid.height * walls.periodic[1], device)
        if gradients:
            self._sums = zeros(forces_adjoint.ORDERS * count * grid.ny, device)

    numbers: int
    """Entries of a row of numbers."""
    boxes: int
    """Entries of a row of boxes."""
    moments: int
    """Entries of a row of moments, from which gradients are computed."""

    def bind(self, numbers: wp.array, boxes: wp.array, moments: wp.array | None) -> None:
        """Set the arrays of numbers, boxes and moments; the latter None without gradients."""
        count = self.count
        self._center_x, self._center_y, self._radius, *self._strengths = (
            numbers[n * count : (n + 1) * count] for n in range(_NUMBERS)
        )
        self._boxes: Indices = boxes
        if moments is not None:
            size = self.moments // _FIELDS
            self._moments = [moments[n * size : (n + 1) * size] for n in range(_FIELDS)]

    def row(
        self, impulses: Sequence[GaussianImpulse], forced: Sequence[bool] = ()
    ) -> tuple[np.ndarray, np.ndarray]:
        """The numbers and the boxes of a step with these impulses.

        Those `forced` have a box even if their strengths are 0, for the gradients with respect to these.
        """
        rows = [(*g.center, g.radius, *g.push, g.turn, g.swell, g.amount) for g in impulses]
        table = np.array(rows).reshape(self.count, _NUMBERS).T
        acting = np.any(table[3:], axis=0)
        boxes = self._boxed(table, acting | np.array(forced) if forced else acting)
        return np.ascontiguousarray(table).ravel(), boxes.ravel()

    def _boxed(self, table: np.ndarray, acting: np.ndarray) -> np.ndarray:
        """The box of each Gaussian, (count, 4): the cells it reaches; empty if it does not act."""
        boxes = np.zeros((self.count, 4), dtype=np.int32)
        reach = float(forces.CUT) * table[2]
        for n, (axis, center) in enumerate(zip((self._x, self._y), table, strict=False)):
            low, high = 0, axis.points
            if not axis.period:
                low = np.clip(np.floor((center - reach) / axis.h) - 1, 0, axis.points)
                high = np.clip(np.ceil((center + reach) / axis.h) + 1, 0, axis.points)
            boxes[:, 2 * n], boxes[:, 2 * n + 1] = low, high
        boxes[~acting] = 0
        return boxes

    def push(self, velocity: Vector) -> None:
        """Add the pushes and turns to the velocity, in place: launches only."""
        x, y = self._x, self._y
        self._profile(faces=True)
        self._profile()
        profiles = [x.on_faces.g, x.at_centres.g, y.at_centres.g, y.on_faces.g]
        inputs = [
            *self._strengths[:3],
            *profiles,
            x.at_centres.r,
            y.at_centres.r,
            x.layout.pitch,
            y.layout.pitch,
        ]
        forces.push.launch(self.layout, self.device, inputs, velocity, boxes=self._boxes)

    def swell(self, s: wp.array) -> None:
        """Add the prescribed divergence to a field, in place: launches only."""
        x, y = self._profile()
        profiles = [x.g, y.g, x.r, y.r, x.excess[0], y.excess[0]]
        inputs = [self._strengths[3], *profiles, self._radius, self._x.period, self._y.period]
        inputs += [self._x.layout.pitch, self._y.layout.pitch]
        sources.swell.launch(self.layout, self.device, inputs, [s], boxes=self._boxes)

    def pour(self, rho: wp.array) -> None:
        """Add the amounts to a density, in place: launches only."""
        x, y = self._profile()
        inputs = [self._strengths[4], x.g, y.g, self._x.layout.pitch, self._y.layout.pitch]
        sources.pour.launch(self.layout, self.device, inputs, [rho], boxes=self._boxes)

    def measure_push(self, velocity_bar: Vector) -> None:
        """Compute the moments of the gradient with respect to the velocity after `push`: launches only."""
        self._profile(faces=True)
        self._profile()
        x, y = self._x, self._y
        self._measure(0, velocity_bar[0], x.on_faces, y.at_centres)
        self._measure(1, velocity_bar[1], x.at_centres, y.on_faces)

    def measure_centres(self, f_bar: wp.array) -> None:
        """Compute the moments of the gradient after `swell` or `pour`, a field at centres: launches only."""
        self._measure(0, f_bar, *self._profile())

    def _measure(self, component: int, f_bar: wp.array, x: _Profile, y: _Profile) -> None:
        """Compute the moments of f_bar with the profiles x and y, as those of a `component`."""
        ny, count, device = self.layout.ny, self.count, self.device
        inputs = [f_bar, *x.arrays, self._radius, self._x.period]
        inputs += [self._boxes, ny, self.layout.pitch, self._x.layout.pitch]
        forces_adjoint.row_moments.launch(count * ny, device, inputs, [self._sums])
        inputs = [self._sums, *y.arrays, self._radius, self._y.period]
        inputs += [self._boxes, ny, self._y.layout.pitch]
        forces_adjoint.moments.launch(count, device, inputs, [self._moments[component]])

    def push_gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The gradients with respect to rows of numbers, from these and the moments of `measure_push`."""
        table, (u, v) = self._tables(numbers, moments)
        sigma, px, py, turn = table[2:6]
        # the velocity gained is (px - turn r_y) g on x-faces and (py + turn r_x) g on y-faces
        out = np.zeros_like(table)
        out[0] = (px * u(1, 0) - turn * u(1, 1) + py * v(1, 0) + turn * (v(2, 0) - v(0, 0))) / sigma
        out[1] = (px * u(0, 1) - turn * (u(0, 2) - u(0, 0)) + py * v(0, 1) + turn * v(1, 1)) / sigma
        around = v(3, 0) + v(1, 2) - v(1, 0) - (u(2, 1) + u(0, 3) - u(0, 1))
        out[2] = (px * u.square + py * v.square + turn * around) / sigma
        out[3], out[4], out[5] = u(0, 0), v(0, 0), v(1, 0) - u(0, 1)
        return out

    def swell_gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The same for `swell`, from the moments of `measure_centres`."""
        table, (s, _) = self._tables(numbers, moments)
        sigma, rate = table[2], table[6]
        # the divergence is rate (1 - r^2 / 2) g
        out = np.zeros_like(table)
        out[0] = rate * (2 * s(1, 0) - (s(3, 0) + s(1, 2)) / 2) / sigma
        out[1] = rate * (2 * s(0, 1) - (s(2, 1) + s(0, 3)) / 2) / sigma
        out[2] = rate * (2 * s.square - (s(4, 0) + 2 * s(2, 2) + s(0, 4)) / 2) / sigma
        out[6] = s(0, 0) - s.square / 2
        return out

    def pour_gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The same for `pour`, from the moments of `measure_centres`."""
        table, (s, _) = self._tables(numbers, moments)
        sigma, amount = table[2], table[7]
        out = np.zeros_like(table)
        out[:3] = amount * s(1, 0) / sigma, amount * s(0, 1) / sigma, amount * s.square / sigma
        out[7] = s(0, 0)
        return out

    def _tables(self, numbers: np.ndarray, moments: np.ndarray) -> tuple[np.ndarray, list[_Moments]]:
        """Rows (steps, …) as numbers by kind (8, steps, count), and the moments of both fields."""
        table = numbers.reshape(len(numbers), _NUMBERS, self.count).swapaxes(0, 1).astype(np.float64)
        fields = moments.reshape(len(moments), _FIELDS, self.count, -1).astype(np.float64)
        return table, [_Moments(fields[:, n]) for n in range(_FIELDS)]

    def _profile(self, faces: bool = False) -> tuple[_Profile, _Profile]:
        """Compute the profiles along both axes, at faces or at centres. Returns those at centres."""
        for axis, center in ((self._x, self._center_x), (self._y, self._center_y)):
            start, out = (0.0, axis.on_faces) if faces else (0.5, axis.at_centres)
            inputs = [center, self._radius, start, axis.h, axis.period]
            forces.profile.launch(axis.layout, self.device, inputs, [out.r, out.g])
            if axis.period:
                inputs += [axis.points, axis.layout.pitch]
                forces.add_images.launch(self.count, self.device, inputs, out.arrays)
        return self._x.at_centres, self._y.at_centres


class _Profile:
    """For each Gaussian its distances r [radii], values g and excesses at the points of one axis."""

    def __init__(self, layout: Layout, device: wp.Device):
        self.arrays = vector(layout, device, 5)
        self.r, self.g, *self.excess = self.arrays


class _Profiles:
    """Profiles along one axis, at faces and at centres. `period` is 0 between walls."""

    def __init__(self, count: int, points: int, h: float, period: float, device: wp.Device):
        self.points, self.h, self.period = points, h, period
        self.layout = Layout(points, count)
        self.on_faces, self.at_centres = (_Profile(self.layout, device) for _ in range(2))


class _Moments:
    """M_ab of every Gaussian in every step (`kernels/adjoint/forces.py`), (steps, count)."""

    def __init__(self, values: np.ndarray):
        self._values, orders = values, range(forces_adjoint.ORDERS)
        self._places = [(a, b) for a in orders for b in orders if a + b < len(orders)]

    def __call__(self, a: int, b: int) -> np.ndarray:
        """The moment with r_x^a r_y^b g."""
        return self._values[..., self._places.index((a, b))]

    @property
    def square(self) -> np.ndarray:
        """The moment with |r|^2 g."""
        return self(2, 0) + self(0, 2)


class _Weighted:
    """Gaussian forces or growths with one weight; `members` are their numbers among all forces."""

    def __init__(
        self,
        weight: Painted | None,
        members: Sequence[int],
        grid: Grid,
        walls: Walls,
        device: wp.Device,
        gradients: bool,
    ):
        self.members, self.device, self.layout = members, device, Layout(grid.nx, grid.ny)
        self.gaussians = GaussianBatch(len(members), grid, walls, device, gradients)
        self._weights = None
        if weight is not None:
            self._weights = field(self.layout, device)
            from_numpy(weight.sample(grid), self._weights, self.layout)
            Ghosts(self.layout, walls.centre_rules(), device).fill(self._weights)


class GaussianForces(_Weighted):
    """Gaussian forces with one weight.

    A weighted force is first computed without its weight, in a scratch array that `adjoint` uses too.
    """

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._scratch = vector(self.layout, self.device, 2) if self._weights is not None else ()

    def add(self, velocity: Vector) -> None:
        """Add the forces to the velocity, in place: launches only."""
        if not self._scratch:
            self.gaussians.push(velocity)
            return
        unweighted = self._scratch
        alone(lambda: fill(0.0, *unweighted))
        self.gaussians.push(unweighted)
        for f, component, stride in zip(unweighted, velocity, (1, self.layout.pitch), strict=True):
            inputs = [f, self._weights, stride]
            forces.push_weighted.launch(self.layout, self.device, inputs, [component])

    def adjoint(self, velocity_bar: Vector) -> None:
        """The transpose of `add`, as far as the moments of the Gaussians: launches only."""
        if self._scratch:
            for f_bar, to, stride in zip(velocity_bar, self._scratch, (1, self.layout.pitch), strict=True):
                inputs = [f_bar, self._weights, stride]
                forces_adjoint.weighted.launch(self.layout, self.device, inputs, [to])
        self.gaussians.measure_push(self._scratch or velocity_bar)

    def gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The gradient with respect to rows of numbers, from the moments of `adjoint`."""
        return self.gaussians.push_gradient(numbers, moments)


class GrowthSources(_Weighted):
    """Growths with one weight. Their divergence is computed as a field, and its mean is subtracted."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._scratch = field(self.layout, self.device)
        self._inner = InnerProduct(self.layout, self.device)
        self.mean, self._bar_mean = zeros(1, self.device), zeros(1, self.device)

    mean: wp.array
    """The mean that the last `add` subtracted [1/s]."""

    def add(self, b: wp.array) -> None:
        """Add the prescribed divergence to b, in place: launches only."""
        s = self._scratch
        alone(lambda: fill(0.0, s))
        self.gaussians.swell(s)
        if self._weights is not None:
            algebra.multiply.launch(self.layout, self.device, [s, self._weights], [s])
        self._add_balanced(s, self.mean, b)

    def _add_balanced(self, s: wp.array, mean: wp.array, b: wp.array) -> None:
        """mean = the mean of s; b += s - mean."""
        self._inner.mean(s, mean)
        sources.add_balanced.launch(self.layout, self.device, [s, mean], [b])

    def adjoint(self, minus_b_bar: wp.array) -> None:
        """The transpose of `add`, as far as minus the moments of the Gaussians: launches only."""
        minus_s_bar = self._scratch
        alone(lambda: fill(0.0, minus_s_bar))
        self._add_balanced(minus_b_bar, self._bar_mean, minus_s_bar)
        if self._weights is not None:
            algebra.multiply.launch(self.layout, self.device, [minus_s_bar, self._weights], [minus_s_bar])
        self.gaussians.measure_centres(minus_s_bar)

    def gradient(self, numbers: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """The gradient with respect to rows of numbers, from the moments of `adjoint`."""
        return -self.gaussians.swell_gradient(numbers, moments)
