"""What changes from step to step, on the device: the step's length and the forces' numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.forces import FORCE_LIMIT, Blob, BlobForce, Buoyancy, FieldForce, Force, Growth
from wfluid.grid import Grid
from wfluid.kernels import forces as kernels
from wfluid.kernels import sources
from wfluid.kernels.cells import Layout, Real
from wfluid.kernels.strips import alone
from wfluid.painted import Painted
from wfluid.state import State, Vector, field, from_numpy, vector
from wfluid.walls import Ghosts, Walls

STEP_LIMIT = 10.0
"""Longest step the solver is tested with [s]."""

_STEP = 6
"""Numbers of the step itself: dt / h and kept / h along both axes, kept, mean divergence."""


class Controls:
    """The numbers of a step with forces of certain kinds, and how they move the fluid.

    Gaussian forces with the same weight are pushed together.
    """

    def __init__(
        self, forces: Sequence[Force], densities: Sequence[str], grid: Grid, walls: Walls, device: wp.Device
    ):
        self.grid, self.layout, self.device = grid, Layout(grid.nx, grid.ny), device
        self._forces = tuple(forces)  # kept, so that no other object takes an identity of the key
        self._pushes = [
            _Push(weight, numbers, grid, walls, device) for weight, numbers in _by_weight(self._forces)
        ]
        self._growths = [n for n, force in enumerate(forces) if isinstance(force, Growth)]
        self._swelling = Blobs(len(self._growths), grid, walls, device) if self._growths else None
        self._fields: list[tuple[int, Vector]] = []
        self._lifts: list[tuple[int, int]] = []
        for n, force in enumerate(forces):
            if isinstance(force, FieldForce):
                self._fields += [(n, _uploaded(f, self.layout, device)) for f in force.fields(grid, walls)]
            elif isinstance(force, Buoyancy):
                self._lifts.append((n, _index_of(force.density, densities)))
        count = _STEP + len(self._fields) + 2 * len(self._lifts)
        self._numbers = wp.zeros(count, dtype=Real, device=device)
        numbers = [self._numbers[n : n + 1] for n in range(count)]
        self.dt_hx, self.dt_hy, self.kept_hx, self.kept_hy, self.kept, self._mean = numbers[:_STEP]
        self._field_impulses = numbers[_STEP : _STEP + len(self._fields)]
        self._lift_impulses = numbers[_STEP + len(self._fields) :]
        self.prescribed = self.removed = 0.0

    prescribed: float
    """Sum of the largest divergences that the last step's sources prescribe [1/s]."""
    removed: float
    """The part of it that has no place between the walls: its mean, taken off everywhere [1/s]."""

    @staticmethod
    def key(forces: Sequence[Force]) -> tuple:
        """What controls are made for: forces of one key differ in numbers only."""
        return tuple(
            (isinstance(f, Growth), id(f.weight)) if isinstance(f, BlobForce) else (id(f),) for f in forces
        )

    @property
    def pushes(self) -> bool:
        """Whether anything adds to the velocity."""
        return bool(self._pushes or self._fields or self._lifts)

    @property
    def swells(self) -> bool:
        """Whether any force prescribes divergence."""
        return self._swelling is not None

    def set(self, forces: Sequence[Force], t: float, dt: float, until: float, kept: float = 0.0) -> None:
        """Put a step of dt, in which forces act from t to `until`, on the device.

        `kept` is the part of the last step's pressure that is taken for a first guess.

        Raises:
            ValueError: a force that would add more than the limit, with the force and the limit.
        """
        blobs = {n: force.over(t, until) for n, force in enumerate(forces) if isinstance(force, BlobForce)}
        for blob in blobs.values():
            gained = max(blob.gained, abs(blob.swell) * blob.radius)
            _check(f"the force at {blob.center}", gained, t, until)
        for push in self._pushes:
            push.blobs.set([blobs[n] for n in push.members])
        hx, hy = self.grid.hx, self.grid.hy
        numbers = [
            dt / hx,
            dt / hy,
            kept / hx,
            kept / hy,
            kept,
            self._swell([blobs[n] for n in self._growths]),
        ]
        integrals: dict[int, list[float]] = {}
        for n, _ in self._fields:
            if n not in integrals:
                integrals[n] = forces[n].integrals(t, until)
                gained = forces[n].reach * max(map(abs, integrals[n]))
                _check("a force over the picture", gained, t, until)
                numbers += integrals[n]
        for n, _ in self._lifts:
            impulse = forces[n].envelope.integral(t, until)
            _check("the buoyancy", np.hypot(*forces[n].vector) * abs(impulse), t, until)
            numbers += [impulse * component for component in forces[n].vector]
        self._numbers.assign(np.array(numbers))

    def _swell(self, blobs: Sequence[Blob]) -> float:
        """Put the growths on the device; the mean of the divergence they prescribe [1/s]."""
        if not self._swelling:
            return 0.0
        self._swelling.set(blobs)
        self.prescribed, self.removed = (
            sum(abs(blob.swell) for blob in blobs),
            self._swelling.swell_mean(blobs),
        )
        return self.removed

    def push(self, state: State, out: Vector) -> None:
        """Out = the state's velocity and the forces' impulses, without ghosts: launches only."""
        for f, to in zip((state.u, state.v), out, strict=True):
            kernels.copied.launch(self.layout, self.device, [f], [to])
        for (_, fields), impulse in zip(self._fields, self._field_impulses, strict=True):
            for f, component in zip(fields, out, strict=True):
                kernels.push_field.launch(self.layout, self.device, [f, impulse], [component])
        for position, (_, density) in enumerate(self._lifts):
            impulses = self._lift_impulses[2 * position : 2 * position + 2]
            for impulse, component, before in zip(impulses, out, (1, self.layout.pitch), strict=True):
                inputs = [state.rho[density], impulse, before]
                kernels.lift.launch(self.layout, self.device, inputs, [component])
        for push in self._pushes:
            push.add(out)

    def prescribe(self, b: wp.array) -> None:
        """Add the divergence that is to stay to b = -div v, in place: launches only."""
        self._swelling.swell(b)
        sources.lower.launch(self.layout, self.device, [self._mean], [b])


class _Push:
    """Gaussian forces with one weight."""

    def __init__(
        self, weight: Painted | None, members: list[int], grid: Grid, walls: Walls, device: wp.Device
    ):
        self.members, self.weight, self.device = members, weight, device
        self.layout = Layout(grid.nx, grid.ny)
        self.blobs = Blobs(len(members), grid, walls, device)
        if weight is not None:
            self._weights = field(self.layout, device)
            from_numpy(weight.on(grid), self._weights, self.layout)
            Ghosts(self.layout, walls.centre_rules(), device).fill(self._weights)
            self._gained = vector(self.layout, device, 2)

    def add(self, velocity: Vector) -> None:
        """Add what they gain to the velocity, in place: launches only."""
        if self.weight is None:
            self.blobs.push(velocity)
            return
        gained = self._gained
        alone(lambda: [f.zero_() for f in gained])
        self.blobs.push(gained)
        for f, component, before in zip(gained, velocity, (1, self.layout.pitch), strict=True):
            kernels.push_weighted.launch(self.layout, self.device, [f, self._weights, before], [component])


def _by_weight(forces: Sequence[Force]) -> list[tuple[Painted | None, list[int]]]:
    """The weights of Gaussian pushes, each with the numbers of its forces."""
    found: dict[int, tuple[Painted | None, list[int]]] = {}
    for n, force in enumerate(forces):
        if isinstance(force, BlobForce) and not isinstance(force, Growth):
            found.setdefault(id(force.weight), (force.weight, []))[1].append(n)
    return list(found.values())


def _index_of(name: str, densities: Sequence[str]) -> int:
    if name not in densities:
        there = ", ".join(densities) or "none"
        raise ValueError(f"buoyancy reads the density {name!r}: expected one of the fluid's ({there})")
    return list(densities).index(name)


def _check(what: str, gained: float, t: float, until: float) -> None:
    if not gained <= FORCE_LIMIT * STEP_LIMIT:
        raise ValueError(
            f"{what} would add a velocity of {gained:g} between {t:g} s and {until:g} s; "
            f"the limit is {FORCE_LIMIT * STEP_LIMIT:g}"
        )


def _uploaded(values: tuple[np.ndarray, np.ndarray], layout: Layout, device: wp.Device) -> Vector:
    fields = vector(layout, device, 2)
    for value, f in zip(values, fields, strict=True):
        from_numpy(value, f, layout)
    return fields
