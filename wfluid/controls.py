"""What changes from step to step, on the device: the step's length and the forces' numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import warp as wp

from wfluid.blobs import Blobs
from wfluid.forces import FORCE_LIMIT, STEP_GROWTH, BlobForce, Buoyancy, FieldForce, Force, Growth
from wfluid.grid import Grid
from wfluid.kernels import forces as kernels
from wfluid.kernels import krylov, sources
from wfluid.kernels.cells import Layout, Real
from wfluid.kernels.strips import alone
from wfluid.painted import Painted
from wfluid.state import State, Vector, field, from_numpy, vector
from wfluid.walls import Ghosts, Walls

STEP_LIMIT = 10.0
"""Longest step the solver is tested with [s]."""

_STEP = 5
"""Numbers of the step itself: dt / h and kept / h along both axes, and kept."""


class Controls:
    """The numbers of a step with forces of certain kinds, and how they move the fluid.

    Gaussian forces with the same weight are pushed together.
    """

    def __init__(
        self, forces: Sequence[Force], densities: Sequence[str], grid: Grid, walls: Walls, device: wp.Device
    ):
        self.grid, self.layout, self.device = grid, Layout(grid.nx, grid.ny), device
        self._forces = tuple(forces)  # kept, so that no other object takes an identity of the key
        pushes, growths = _by_weight(self._forces)
        self._pushes = [_Push(*group, grid, walls, device) for group in pushes]
        self._growths = [_Growing(*group, grid, walls, device) for group in growths]
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
        self.dt_hx, self.dt_hy, self.kept_hx, self.kept_hy, self.kept = numbers[:_STEP]
        self._field_impulses = numbers[_STEP : _STEP + len(self._fields)]
        self._lift_impulses = numbers[_STEP + len(self._fields) :]
        self.prescribed = 0.0

    prescribed: float
    """Sum of the largest divergences that the last step's growths prescribe [1/s]."""

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
        return bool(self._growths)

    @property
    def removed(self) -> float:
        """Of the divergence prescribed, what had no place: its mean, taken off everywhere [1/s]."""
        return float(sum(growing.mean.numpy()[0] for growing in self._growths))

    def set(self, forces: Sequence[Force], t: float, dt: float, until: float, kept: float = 0.0) -> None:
        """Put a step of dt, in which forces act from t to `until`, on the device.

        `kept` is the part of the last step's pressure that is taken for a first guess; none where
        divergence is prescribed.

        Raises:
            ValueError: a force that would add more than the limit, with the force and the limit.
        """
        blobs = {n: force.over(t, until) for n, force in enumerate(forces) if isinstance(force, BlobForce)}
        for blob in blobs.values():
            if abs(blob.swell) * dt > STEP_GROWTH:
                raise ValueError(
                    f"the growth at {blob.center} would change areas by exp({blob.swell * dt:.3g}) in a step "
                    f"of {dt:.3g} s; the limit is exp({STEP_GROWTH}): more substeps or a longer window help"
                )
            gained = max(blob.gained, abs(blob.swell) * blob.radius)
            _check(f"the force at {blob.center}", gained, t, until)
        for group in (*self._pushes, *self._growths):
            group.blobs.set([blobs[n] for n in group.members])
        self.prescribed = sum(abs(blob.swell) for blob in blobs.values())
        kept = 0.0 if self.prescribed else kept
        hx, hy = self.grid.hx, self.grid.hy
        numbers = [dt / hx, dt / hy, kept / hx, kept / hy, kept]
        integrals: dict[int, list[float]] = {}
        for n, _ in self._fields:
            if n not in integrals:
                integrals[n] = forces[n].integrals(t, until)
                gained = forces[n].reach * math.hypot(*integrals[n])
                _check("a force over the picture", gained, t, until)
                numbers += integrals[n]
        for n, _ in self._lifts:
            impulse = forces[n].envelope.integral(t, until)
            _check("the buoyancy", np.hypot(*forces[n].vector) * abs(impulse), t, until)
            numbers += [impulse * component for component in forces[n].vector]
        self._numbers.assign(np.array(numbers))

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
        for growing in self._growths:
            growing.add(b)


class _Push:
    """Gaussian forces with one weight."""

    def __init__(
        self, weight: Painted | None, members: list[int], grid: Grid, walls: Walls, device: wp.Device
    ):
        self.members, self.device, self.layout = members, device, Layout(grid.nx, grid.ny)
        self.blobs = Blobs(len(members), grid, walls, device)
        self._weights = _weights(weight, grid, walls, device)
        self._gained = vector(self.layout, device, 2) if weight is not None else ()

    def add(self, velocity: Vector) -> None:
        """Add what they gain to the velocity, in place: launches only."""
        if not self._gained:
            self.blobs.push(velocity)
            return
        gained = self._gained
        alone(lambda: [f.zero_() for f in gained])
        self.blobs.push(gained)
        for f, component, before in zip(gained, velocity, (1, self.layout.pitch), strict=True):
            kernels.push_weighted.launch(self.layout, self.device, [f, self._weights, before], [component])


class _Growing:
    """Growths with one weight: their divergence is a field first, of which the mean is taken off."""

    def __init__(
        self, weight: Painted | None, members: list[int], grid: Grid, walls: Walls, device: wp.Device
    ):
        self.members, self.device, self.layout = members, device, Layout(grid.nx, grid.ny)
        self.blobs = Blobs(len(members), grid, walls, device)
        self._weights = _weights(weight, grid, walls, device)
        self._swell = field(self.layout, device)
        self._ones = wp.full(self.layout.size, 1.0, dtype=Real, device=device)
        self._rows = wp.zeros(grid.ny, dtype=Real, device=device)
        self.mean = wp.zeros(1, dtype=Real, device=device)

    mean: wp.array
    """What was taken off [1/s]."""

    def add(self, b: wp.array) -> None:
        """Add what they prescribe to b, in place: launches only."""
        swell, (nx, ny), pitch = self._swell, (self.layout.nx, self.layout.ny), self.layout.pitch
        alone(swell.zero_)
        self.blobs.swell(swell)
        if self._weights is not None:
            sources.weigh.launch(self.layout, self.device, [self._weights], [swell])
        krylov.row_products.launch(ny, self.device, [swell, self._ones, nx, pitch, 0], [self._rows])
        krylov.mean_of.launch(1, self.device, [self._rows, ny, nx * ny], [self.mean])
        sources.add_balanced.launch(self.layout, self.device, [swell, self.mean], [b])


def _weights(weight: Painted | None, grid: Grid, walls: Walls, device: wp.Device) -> wp.array | None:
    """A weight at centres, with ghosts."""
    if weight is None:
        return None
    layout = Layout(grid.nx, grid.ny)
    weights = field(layout, device)
    from_numpy(weight.on(grid), weights, layout)
    Ghosts(layout, walls.centre_rules(), device).fill(weights)
    return weights


_Groups = list[tuple[Painted | None, list[int]]]


def _by_weight(forces: Sequence[Force]) -> tuple[_Groups, _Groups]:
    """The weights of Gaussian pushes, and of growths, each with the numbers of its forces."""
    found: tuple[dict, dict] = {}, {}
    for n, force in enumerate(forces):
        if isinstance(force, BlobForce):
            groups = found[isinstance(force, Growth)]
            groups.setdefault(id(force.weight), (force.weight, []))[1].append(n)
    return list(found[0].values()), list(found[1].values())


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
