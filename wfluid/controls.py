"""What changes from step to step, on the device: the step's length and the forces' numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.forces import FORCE_LIMIT, GaussianForce
from wfluid.grid import Grid
from wfluid.image_force import ImageForce
from wfluid.kernels import forces as kernels
from wfluid.kernels.cells import Layout, Real
from wfluid.kernels.strips import alone
from wfluid.painted import Painted
from wfluid.state import Vector, field, from_numpy, vector
from wfluid.walls import Ghosts, Walls

STEP_LIMIT = 10.0
"""Longest step the solver is tested with [s]."""

_PER_FORCE = 5
"""Numbers of a Gaussian force on the device: center, radius and impulse."""

Force = GaussianForce | ImageForce
"""Anything that pushes the fluid."""


class Controls:
    """The numbers of a step with forces of certain kinds, in one device array, and how they push.

    Gaussian forces with the same weight are pushed together.
    """

    def __init__(self, forces: Sequence[Force], grid: Grid, walls: Walls, device: wp.Device):
        self.grid, self.layout, self.device = grid, Layout(grid.nx, grid.ny), device
        self._groups: dict[int, _Group] = {}
        self._images: list[tuple[int, Vector]] = []
        for index, force in enumerate(forces):
            if isinstance(force, GaussianForce):
                self._groups.setdefault(id(force.weight), _Group(force.weight)).members.append(index)
            else:
                self._images.append(
                    (index, _uploaded(force.on_faces(grid, walls.periodic), self.layout, device))
                )
        self._forces = tuple(forces)  # kept, so that no other object takes an identity of the key
        numbers = 5 + len(self._images) + _PER_FORCE * sum(len(g.members) for g in self._groups.values())
        self._numbers = wp.zeros(numbers, dtype=Real, device=device)
        self.dt_hx, self.dt_hy, self.kept_hx, self.kept_hy, self.kept, *self._image_impulses = (
            self._numbers[n : n + 1] for n in range(5 + len(self._images))
        )
        start = 5 + len(self._images)
        for group in self._groups.values():
            start = group.allocate(self._numbers, start, grid, walls, self.layout, device)

    @staticmethod
    def key(forces: Sequence[Force]) -> tuple:
        """What controls are made for: forces of one key differ in numbers only."""
        return tuple(id(f.weight) if isinstance(f, GaussianForce) else (id(f),) for f in forces)

    @property
    def pushes(self) -> bool:
        """Whether there is any force."""
        return bool(self._forces)

    def set(self, forces: Sequence[Force], t: float, dt: float, until: float, kept: float = 0.0) -> None:
        """Put a step of dt, in which forces act from t to `until`, on the device.

        `kept` is the part of the last step's pressure that is taken for a first guess.

        Raises:
            ValueError: a force that would add more than the limit, with the force and the limit.
        """
        impulses = [force.envelope.integral(t, until) for force in forces]
        for force, impulse in zip(forces, impulses, strict=True):
            gained = force.reach * abs(impulse)
            if not gained <= FORCE_LIMIT * STEP_LIMIT:
                at = f"the force at {force.center}" if isinstance(force, GaussianForce) else "a painted force"
                raise ValueError(
                    f"{at} would add a velocity of {gained:g} between {t:g} s and {until:g} s; "
                    f"the limit is {FORCE_LIMIT * STEP_LIMIT:g}"
                )
        hx, hy = self.grid.hx, self.grid.hy
        numbers = [dt / hx, dt / hy, kept / hx, kept / hy, kept]
        numbers += [impulses[index] for index, _ in self._images]
        for group in self._groups.values():
            numbers += group.numbers([forces[n] for n in group.members], [impulses[n] for n in group.members])
        self._numbers.assign(np.array(numbers))

    def push(self, velocity: Vector, out: Vector) -> None:
        """Out = the velocity and the forces' impulses, without ghosts: launches only."""
        for f, to in zip(velocity, out, strict=True):
            kernels.copied.launch(self.layout, self.device, [f], [to])
        self._add_impulses(out)

    def _add_impulses(self, velocity: Vector) -> None:
        for (_, fields), impulse in zip(self._images, self._image_impulses, strict=True):
            for f, component in zip(fields, velocity, strict=True):
                kernels.push_field.launch(self.layout, self.device, [f, impulse], [component])
        for group in self._groups.values():
            group.push(self.grid, self.layout, velocity, self.device)


class _Group:
    """Gaussian forces with one weight."""

    def __init__(self, weight: Painted | None):
        self.weight = weight
        self.members: list[int] = []

    def allocate(
        self, numbers: wp.array, start: int, grid: Grid, walls: Walls, layout: Layout, device: wp.Device
    ) -> int:
        """Take the part of `numbers` that begins at `start`; where the next one begins."""
        count = len(self.members)
        self.center_x, self.center_y, self.radius, self.impulse_x, self.impulse_y = (
            numbers[start + n * count : start + (n + 1) * count] for n in range(_PER_FORCE)
        )
        self.profiles = tuple(
            wp.zeros(count * n, dtype=Real, device=device) for n in (grid.nx, grid.nx, grid.ny, grid.ny)
        )
        periodic_x, periodic_y = walls.periodic
        self.periods = (grid.width * periodic_x, grid.height * periodic_y)
        if self.weight is not None:
            self.weights = field(layout, device)
            from_numpy(self.weight.on(grid), self.weights, layout)
            Ghosts(layout, walls.centre_rules(), device).fill(self.weights)
            self.gained = vector(layout, device, 2)
        return start + _PER_FORCE * count

    def numbers(self, forces: Sequence[GaussianForce], impulses: Sequence[float]) -> list[float]:
        """The forces' numbers in the order of the device's arrays."""
        pairs = list(zip(forces, impulses, strict=True))
        return [
            *(force.center[0] for force in forces),
            *(force.center[1] for force in forces),
            *(force.radius for force in forces),
            *(force.vector[0] * impulse for force, impulse in pairs),
            *(force.vector[1] * impulse for force, impulse in pairs),
        ]

    def push(self, grid: Grid, layout: Layout, velocity: Vector, device: wp.Device) -> None:
        """Add the group's impulses to the velocity, in place."""
        count = len(self.members)
        axes = (
            (self.center_x, grid.nx, 0.0, grid.hx, self.periods[0]),
            (self.center_x, grid.nx, 0.5, grid.hx, self.periods[0]),
            (self.center_y, grid.ny, 0.5, grid.hy, self.periods[1]),
            (self.center_y, grid.ny, 0.0, grid.hy, self.periods[1]),
        )
        for (center, points, start, h, period), profile in zip(axes, self.profiles, strict=True):
            inputs = [center, self.radius, points, start, h, period]
            kernels.profile.launch(count * points, device, inputs, [profile])
        to = velocity
        if self.weight is not None:
            to = self.gained
            alone(lambda: [f.zero_() for f in to])
        inputs = [self.impulse_x, self.impulse_y, *self.profiles, grid.nx, grid.ny]
        kernels.push.launch(layout, device, inputs, to, layers=count)
        if self.weight is not None:
            for gained, component, before in zip(to, velocity, (1, layout.pitch), strict=True):
                kernels.push_weighted.launch(layout, device, [gained, self.weights, before], [component])


def _uploaded(values: tuple[np.ndarray, np.ndarray], layout: Layout, device: wp.Device) -> Vector:
    fields = vector(layout, device, 2)
    for value, f in zip(values, fields, strict=True):
        from_numpy(value, f, layout)
    return fields
