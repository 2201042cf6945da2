"""What acts on the fluid in one step, on the device: its length, the forces' impulses, what sources pour."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import STEP_LIMIT
from wfluid.fields.arrays import Vector, assign, entries, field, from_numpy, read, vector, zeros
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.adjoint import forces as forces_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import algebra
from wfluid.kernels.step import forces
from wfluid.model.fluid import Fluid
from wfluid.model.force import FORCE_LIMIT, FieldForce, Force, LocalForce
from wfluid.model.gaussian_forces import STEP_GROWTH, Growth
from wfluid.model.painted import Painted
from wfluid.model.uniform_forces import Buoyancy
from wfluid.step.densities import DensitySources
from wfluid.step.gaussians import GaussianForces, GrowthSources
from wfluid.step.tape import bars, record

_STEP = 5
"""Numbers of the step itself: dt / h and kept / h along both axes, and kept."""


@dataclass(frozen=True, eq=False)
class ForcingRow:
    """What acts in one step."""

    numbers: np.ndarray
    """Of the step, the forces and the sources, as `Forcing` lays them out on the device."""
    boxes: np.ndarray
    """Of cells that Gaussians reach."""
    prescribed: float
    """Sum of the largest divergences that growths prescribe [1/s]."""


class Forcing:
    """The numbers of a step with forces of certain kinds, and how they move the fluid.

    Gaussian forces with the same weight are pushed together. With `gradients` the transposes work too. With
    `effort` they count that part of half the squares of what forces add to the velocity.
    """

    def __init__(
        self,
        forces: Sequence[Force],
        fluid: Fluid,
        grid: Grid,
        device: wp.Device,
        gradients: bool = False,
        effort: float = 0.0,
    ):
        self.grid, self.layout, self.device = grid, Layout(grid.nx, grid.ny), device
        self._forces = tuple(forces)  # kept, so that no other object takes an identity of the key
        walls, make = fluid.walls, (grid, fluid.walls, device, gradients)
        pushes, growths = _by_weight(self._forces)
        self._pushes = [GaussianForces(*group, *make) for group in pushes]
        self._growths = [GrowthSources(*group, *make) for group in growths]
        self._fields: list[tuple[int, Vector]] = []
        self._lifts: list[tuple[int, int]] = []
        for n, force in enumerate(forces):
            if isinstance(force, FieldForce):
                self._fields += [(n, _uploaded(f, self.layout, device)) for f in force.fields(grid, walls)]
            elif isinstance(force, Buoyancy):
                self._lifts.append((n, _index_of(force.density, fluid.density_names)))
        self.sources = [DensitySources(density, *make) for density in fluid.densities]
        self._velocity_ghosts = [Ghosts(self.layout, r, device) for r in (walls.u_rules(), walls.v_rules())]
        self._effort, self._gained_bar = effort, vector(self.layout, device, 2) if effort else ()
        self._lifted = field(self.layout, device) if self._lifts and gradients else None
        self._inner = InnerProduct(self.layout, device, 2)
        self._lay_out()

    sources: list[DensitySources]
    """What pours, density by density."""
    numbers: wp.array
    """All numbers of a step, on the device."""
    boxes: wp.array
    """All boxes of a step, on the device."""
    bars: wp.array
    """What gradients are made of: impulses' and moments."""

    def _lay_out(self) -> None:
        """Allocate the arrays, and tell everything what parts of them are its own."""
        self._groups = [*self._pushes, *self._growths]
        blobs = [group.blobs for group in self._groups] + [p.blobs for p in self.sources if p.blobs]
        impulses = len(self._fields) + 2 * len(self._lifts)
        painted = sum(pouring.painted for pouring in self.sources)
        begin = _STEP + impulses + painted
        self.numbers, self.bars = (
            zeros(size, self.device)
            for size in (begin + sum(b.numbers for b in blobs), begin + sum(b.moments for b in blobs))
        )
        self.boxes = zeros(sum(b.boxes for b in blobs), self.device, wp.int32)
        step = entries(self.numbers, slice(_STEP))
        self.dt_hx, self.dt_hy, self.kept_hx, self.kept_hy, self.kept = step
        self._lone = slice(_STEP, _STEP + impulses)
        self._impulses, self._impulses_bar = (entries(a, self._lone) for a in (self.numbers, self.bars))
        at = self._lone.stop
        self._painted: list[slice] = []
        for pouring in self.sources:
            self._painted.append(slice(at, at + pouring.painted))
            if pouring.painted:
                pouring.bind(self.numbers[self._painted[-1]], self.bars[self._painted[-1]])
            at += pouring.painted
        number, moment, box = at, at, 0
        self._parts: dict[int, tuple[slice, slice]] = {}
        for part in blobs:
            numbers, moments = slice(number, number + part.numbers), slice(moment, moment + part.moments)
            boxes = slice(box, box + part.boxes)
            number, moment, box = numbers.stop, moments.stop, boxes.stop
            taken = self.bars[moments] if part.moments else None
            part.bind(self.numbers[numbers], self.boxes[boxes], taken)
            self._parts[id(part)] = numbers, moments

    @staticmethod
    def key(forces: Sequence[Force]) -> tuple:
        """What impulses are made for: forces of one key differ in numbers only."""
        return tuple(
            (isinstance(f, Growth), id(f.weight)) if isinstance(f, LocalForce) else (id(f),) for f in forces
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
        return float(sum(read(growths.mean)[0] for growths in self._growths))

    def set(
        self,
        forces: Sequence[Force],
        fluid: Fluid,
        t: float,
        dt: float,
        until: float,
        kept: float = 0.0,
        live: bool = False,
    ) -> float:
        """Put a step on the device: what `row` finds. Returns the divergence that is prescribed [1/s]."""
        row = self.row(forces, fluid, t, dt, until, kept, live)
        assign(row.numbers, self.numbers)
        assign(row.boxes, self.boxes)
        return row.prescribed

    def row(
        self,
        forces: Sequence[Force],
        fluid: Fluid,
        t: float,
        dt: float,
        until: float,
        kept: float = 0.0,
        live: bool = False,
    ) -> ForcingRow:
        """What is needed for a step of dt, in which forces and the fluid's sources act from t to `until`.

        `kept` is the part of the last step's pressure that is taken for a first guess; none where
        divergence is prescribed. With `live` forces count as acting even where their strengths are 0.

        Raises:
            ValueError: a force that would add more than the limit, with the force and the limit.
        """
        blobs = {
            n: force.impulse(t, until) for n, force in enumerate(forces) if isinstance(force, LocalForce)
        }
        for blob in blobs.values():
            if abs(blob.swell) * dt > STEP_GROWTH:
                raise ValueError(
                    f"the growth at {blob.center} would change areas by exp({blob.swell * dt:.3g}) in a step "
                    f"of {dt:.3g} s; the limit is exp({STEP_GROWTH}): more substeps or a longer window help"
                )
            gained = max(blob.gained, abs(blob.swell) * blob.radius)
            _check(f"the force at {blob.center}", gained, t, until)
        prescribed = sum(abs(blob.swell) for blob in blobs.values())
        kept = 0.0 if prescribed else kept
        hx, hy = self.grid.hx, self.grid.hy
        numbers = [dt / hx, dt / hy, kept / hx, kept / hy, kept]
        for n in dict.fromkeys(n for n, _ in self._fields):
            integrals = forces[n].integrals(t, until)
            _check("a force over the picture", forces[n].reach * math.hypot(*integrals), t, until)
            numbers += integrals
        for n, _ in self._lifts:
            impulse = forces[n].envelope.integral(t, until)
            _check("the buoyancy", np.hypot(*forces[n].vector) * abs(impulse), t, until)
            numbers += [impulse * component for component in forces[n].vector]
        pourings = list(zip(self.sources, fluid.densities, strict=True))
        for pouring, density in pourings:
            numbers += pouring.impulses(density, t, until)
        rows = []
        for group in self._groups:
            alive = [live and forces[n].envelope.acts(t, until) for n in group.members]
            rows.append(group.blobs.row([blobs[n] for n in group.members], alive))
        rows += [pouring.row(density, t, until, live) for pouring, density in pourings if pouring.blobs]
        boxes = [np.empty(0, dtype=np.int32), *(boxes for _, boxes in rows)]
        numbers = np.concatenate([numbers, *(row for row, _ in rows)])
        return ForcingRow(numbers, np.concatenate(boxes), prescribed)

    def push(self, state: State, out: Vector) -> None:
        """out = the state's velocity and the forces' impulses, with ghosts: launches only."""
        for f, to in zip((state.u, state.v), out, strict=True):
            algebra.copy.launch(self.layout, self.device, [f], [to])
        impulses = iter(self._impulses)
        for (_, fields), impulse in zip(self._fields, impulses, strict=False):
            for f, component in zip(fields, out, strict=True):
                forces.push_field.launch(self.layout, self.device, [f, impulse], [component])
        for density, component, before, impulse in self._lifting(out):
            inputs = [state.rho[density], impulse, before]
            forces.lift.launch(self.layout, self.device, inputs, [component])
        for pushes in self._pushes:
            pushes.add(out)
        with together():
            for f, ghosts in zip(out, self._velocity_ghosts, strict=True):
                ghosts.fill(f)
        lifting = [state.rho[density] for _, density in self._lifts]
        record(partial(self._push_back, state, out), [state.u, state.v, *lifting], out)

    def _push_back(self, state: State, out: Vector) -> None:
        """Add to the gradients of the state's velocity and densities; find those of the impulses."""
        out_bar, velocity = bars(out), (state.u, state.v)
        with together():
            for f, to in zip(out_bar, bars(velocity), strict=True):
                algebra.add.launch(self.layout, self.device, [f], [to])
        gained_bar = out_bar
        if self._effort:
            gained_bar = self._gained_bar
            for f_bar, after, before, to in zip(out_bar, out, velocity, gained_bar, strict=True):
                inputs = [f_bar, after, before, self._effort]
                forces_adjoint.effort_added.launch(self.layout, self.device, inputs, [to])
        impulses_bar = iter(self._impulses_bar)
        for _, fields in self._fields:
            self._inner.dot(gained_bar, fields, next(impulses_bar))
        for density, f_bar, before, impulse in self._lifting(gained_bar):
            rho = state.rho[density]
            forces_adjoint.mean_with_before.launch(self.layout, self.device, [rho, before], [self._lifted])
            self._inner.dot([f_bar], [self._lifted], next(impulses_bar))
            algebra.copy.launch(self.layout, self.device, [f_bar], [self._lifted])
            self._velocity_ghosts[before > 1].fill(self._lifted)
            inputs = [self._lifted, impulse, before, self.layout.nx]
            forces_adjoint.lift_adjoint.launch(self.layout, self.device, inputs, [rho.grad])
        for pushes in self._pushes:
            pushes.adjoint(gained_bar)

    def _lifting(self, velocity: Vector) -> list[tuple[int, wp.array, int, wp.array]]:
        """For each buoyancy and component: the density, the component, its stride and its impulse."""
        lifting = []
        for n, (_, density) in enumerate(self._lifts):
            impulses = self._impulses[len(self._fields) + 2 * n :][:2]
            for component, before, impulse in zip(velocity, (1, self.layout.pitch), impulses, strict=True):
                lifting.append((density, component, before, impulse))
        return lifting

    def prescribe(self, b: wp.array) -> None:
        """Add the divergence that is to stay to b = -div v, in place: launches only."""
        for growths in self._growths:
            growths.add(b)

    def prescribe_adjoint(self, minus_b_bar: wp.array) -> None:
        """The transpose of `prescribe`, from minus the gradient: launches only."""
        for growths in self._growths:
            growths.adjoint(minus_b_bar)

    def gradients(self, numbers: np.ndarray, bars: np.ndarray) -> dict[int, np.ndarray]:
        """The gradients with respect to what each force does, from rows of `numbers` and `bars`, one a step.

        By the force's number, (steps, n): of a Gaussian the numbers that `gaussian_impulse_of` knows, of a
        field its integrals, of a buoyancy its two impulses.
        """
        found: dict[int, np.ndarray] = {}
        for group in self._groups:
            own, moments = self._parts[id(group.blobs)]
            table = group.gradient(numbers[:, own], bars[:, moments])
            found.update((n, table[:, :, place].T) for place, n in enumerate(group.members))
        members = [n for n, _ in self._fields] + [n for n, _ in self._lifts for _ in range(2)]
        for n in dict.fromkeys(members):
            columns = [place for place, member in enumerate(members) if member == n]
            found[n] = bars[:, self._lone][:, columns].astype(np.float64)
        return found

    def source_gradients(self, numbers: np.ndarray, bars: np.ndarray) -> list[dict[int, np.ndarray]]:
        """The same for the sources of each density."""
        found = []
        for pouring, painted in zip(self.sources, self._painted, strict=True):
            own, moments = self._parts[id(pouring.blobs)] if pouring.blobs else (slice(0), slice(0))
            found.append(pouring.gradients(numbers[:, own], bars[:, moments], bars[:, painted]))
        return found


_Groups = list[tuple[Painted | None, list[int]]]


def _by_weight(forces: Sequence[Force]) -> tuple[_Groups, _Groups]:
    """The weights of Gaussian pushes, and of growths, each with the numbers of its forces."""
    found: tuple[dict, dict] = {}, {}
    for n, force in enumerate(forces):
        if isinstance(force, LocalForce):
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
