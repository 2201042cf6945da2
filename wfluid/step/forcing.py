"""The forcing of one step on the device: the step's length, the impulses of forces, sources and growths."""

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
"""Numbers of the step itself: dt / h and pressure_part / h along both axes, and pressure_part."""


@dataclass(frozen=True, eq=False)
class ForcingRow:
    """The forcing of one step."""

    numbers: np.ndarray
    """The numbers of the step, the forces and the sources, in the order of `Forcing.numbers`."""
    boxes: np.ndarray
    """The boxes of cells that Gaussians reach, in the order of `Forcing.boxes`."""
    prescribed: float
    """Sum of the largest divergences that growths prescribe [1/s]."""


class Forcing:
    """Applies forces and sources to the fluid, with numbers in device memory that change from step to step.

    Gaussian forces with the same weight are one batch. With `gradients` it has transposes too. With `effort`
    these add the gradient of effort/2 times the sum of the squared velocity changes due to forces.
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
        self._forces = tuple(forces)  # stored, so that no other object gets an id that is in the key
        walls = fluid.boundary
        sizes = zip((grid.width, grid.height), walls.periodic, strict=True)
        self._periods = [size for size, periodic in sizes if periodic]
        gaussian_forces, growths = _by_weight(self._forces)
        self._gaussian_forces = [
            GaussianForces(*group, grid, walls, device, gradients) for group in gaussian_forces
        ]
        self._growths = [GrowthSources(*group, grid, walls, device, gradients) for group in growths]
        self._fields: list[tuple[int, Vector]] = []
        self._buoyancies: list[tuple[int, int]] = []
        for n, force in enumerate(forces):
            if isinstance(force, FieldForce):
                self._fields += [(n, _uploaded(f, self.layout, device)) for f in force.fields(grid, walls)]
            elif isinstance(force, Buoyancy):
                self._buoyancies.append((n, _index_of(force.density, fluid.density_names)))
        self.sources = [
            DensitySources(density, grid, walls, device, gradients) for density in fluid.densities
        ]
        self._velocity_ghosts = [Ghosts(self.layout, r, device) for r in (walls.u_rules(), walls.v_rules())]
        self._effort, self._gained_bar = effort, vector(self.layout, device, 2) if effort else ()
        if self._buoyancies and gradients:
            self._rho_on_faces, self._face_bar = (field(self.layout, device) for _ in range(2))
        self._inner = InnerProduct(self.layout, device, 2)
        self._lay_out()

    sources: list[DensitySources]
    """The sources of each density."""
    numbers: wp.array
    """All numbers of a step: of the step itself, fields and buoyancies, painted sources, Gaussians."""
    boxes: wp.array
    """The boxes of all Gaussians in a step."""
    bars: wp.array
    """The transposes' results: gradients of the numbers before the Gaussians', and the Gaussians' moments."""

    def _lay_out(self) -> None:
        """Allocate `numbers`, `boxes` and `bars`, and give every force and source its parts of them."""
        self._groups: list[GaussianForces | GrowthSources] = [*self._gaussian_forces, *self._growths]
        batches = [group.gaussians for group in self._groups]
        batches += [sources.gaussians for sources in self.sources if sources.gaussians]
        impulses = len(self._fields) + 2 * len(self._buoyancies)
        painted = sum(sources.painted for sources in self.sources)
        begin = _STEP + impulses + painted
        self.numbers, self.bars = (
            zeros(size, self.device)
            for size in (begin + sum(b.numbers for b in batches), begin + sum(b.moments for b in batches))
        )
        self.boxes = zeros(sum(b.boxes for b in batches), self.device, wp.int32)
        step = entries(self.numbers, slice(_STEP))
        self.dt_hx, self.dt_hy, self.pressure_part_hx, self.pressure_part_hy, self.pressure_part = step
        self._impulse_slice = slice(_STEP, _STEP + impulses)
        self._impulses = entries(self.numbers, self._impulse_slice)
        self._impulses_bar = entries(self.bars, self._impulse_slice)
        at = self._impulse_slice.stop
        self._painted: list[slice] = []
        for sources in self.sources:
            self._painted.append(slice(at, at + sources.painted))
            if sources.painted:
                sources.bind(self.numbers[self._painted[-1]], self.bars[self._painted[-1]])
            at += sources.painted
        number, moment, box = at, at, 0
        self._parts: dict[int, tuple[slice, slice]] = {}
        for batch in batches:
            numbers, moments = slice(number, number + batch.numbers), slice(moment, moment + batch.moments)
            boxes = slice(box, box + batch.boxes)
            number, moment, box = numbers.stop, moments.stop, boxes.stop
            moment_array = self.bars[moments] if batch.moments else None
            batch.bind(self.numbers[numbers], self.boxes[boxes], moment_array)
            self._parts[id(batch)] = numbers, moments

    @staticmethod
    def key(forces: Sequence[Force]) -> tuple:
        """A key by which forcings are found again: forces with the same key differ in numbers only."""
        return tuple(
            (isinstance(f, Growth), id(f.weight)) if isinstance(f, LocalForce) else (id(f),) for f in forces
        )

    @property
    def adds_velocity(self) -> bool:
        """Whether any force adds to the velocity."""
        return bool(self._gaussian_forces or self._fields or self._buoyancies)

    @property
    def prescribes_divergence(self) -> bool:
        """Whether any force prescribes divergence."""
        return bool(self._growths)

    @property
    def removed(self) -> float:
        """The mean of the prescribed divergence, which is subtracted everywhere [1/s]."""
        return float(sum(read(growths.mean)[0] for growths in self._growths))

    def set(
        self,
        forces: Sequence[Force],
        fluid: Fluid,
        t: float,
        dt: float,
        until: float,
        pressure_part: float = 0.0,
        act_at_zero: bool = False,
    ) -> float:
        """Upload the `row` of a step to the device. Returns the divergence it prescribes [1/s]."""
        row = self.row(forces, fluid, t, dt, until, pressure_part, act_at_zero)
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
        pressure_part: float = 0.0,
        act_at_zero: bool = False,
    ) -> ForcingRow:
        """The forcing of a step of dt, in which forces and the fluid's sources act from t to `until`.

        `pressure_part` is the fraction of the last step's pressure that is subtracted before the diffusion;
        it becomes 0 where divergence is prescribed. With `act_at_zero` Gaussians of strength 0 have boxes
        too while their envelopes act, so that gradients with respect to their strengths are computed.

        Raises:
            ValueError: a force that would add more than the limit, with the force and the limit.
        """
        impulses = {
            n: force.impulse(t, until) for n, force in enumerate(forces) if isinstance(force, LocalForce)
        }
        for impulse in impulses.values():
            if abs(impulse.swell) * dt > STEP_GROWTH:
                raise ValueError(
                    f"the growth at {impulse.center} would change areas by exp({impulse.swell * dt:.3g}) "
                    f"in a step of {dt:.3g} s; the limit is exp({STEP_GROWTH}): more substeps or a longer "
                    "window help"
                )
            gained = max(impulse.gained, abs(impulse.swell) * impulse.radius)
            for period in self._periods:
                gained *= max(1.0, 3 * impulse.radius / period)  # a bound of the sum of the images
            _check(f"the force at {impulse.center}", gained, t, until)
        prescribed = sum(abs(impulse.swell) for impulse in impulses.values())
        pressure_part = 0.0 if prescribed else pressure_part
        hx, hy = self.grid.hx, self.grid.hy
        numbers = [dt / hx, dt / hy, pressure_part / hx, pressure_part / hy, pressure_part]
        for force in forces:
            if isinstance(force, FieldForce):
                integrals = force.integrals(t, until)
                _check("a force over the picture", force.reach * math.hypot(*integrals), t, until)
                numbers += integrals
        for force in forces:
            if isinstance(force, Buoyancy):
                integral = force.envelope.integral(t, until)
                _check("the buoyancy", np.hypot(*force.vector) * abs(integral), t, until)
                numbers += [integral * component for component in force.vector]
        densities = list(zip(self.sources, fluid.densities, strict=True))
        for sources, density in densities:
            numbers += sources.impulses(density, t, until)
        rows = []
        for group in self._groups:
            forced = [act_at_zero and forces[n].envelope.acts(t, until) for n in group.members]
            rows.append(group.gaussians.row([impulses[n] for n in group.members], forced))
        rows += [sources.row(density, t, until, act_at_zero) for sources, density in densities]
        boxes = [np.empty(0, dtype=np.int32), *(boxes for _, boxes in rows)]
        table = np.concatenate([numbers, *(row for row, _ in rows)])
        return ForcingRow(table, np.concatenate(boxes), prescribed)

    def push(self, velocity: Vector, rho: Vector, out: Vector) -> None:
        """out = a velocity plus the impulses of forces, with ghosts; `rho` are densities: launches only."""
        for f, to in zip(velocity, out, strict=True):
            algebra.copy.launch(self.layout, self.device, [f], [to])
        impulses = iter(self._impulses)
        for (_, fields), impulse in zip(self._fields, impulses, strict=False):
            for f, component in zip(fields, out, strict=True):
                forces.push_field.launch(self.layout, self.device, [f, impulse], [component])
        for density, component, stride, impulse in self._buoyancy_terms(out):
            inputs = [rho[density], impulse, stride]
            forces.lift.launch(self.layout, self.device, inputs, [component])
        for group in self._gaussian_forces:
            group.add(out)
        with together():
            for f, ghosts in zip(out, self._velocity_ghosts, strict=True):
                ghosts.fill(f)
        read = [rho[density] for _, density in self._buoyancies]
        record(partial(self._push_back, velocity, rho, out), [*velocity, *read], out)

    def _push_back(self, velocity: Vector, rho: Vector, out: Vector) -> None:
        """Add to the gradients of velocity and densities; compute those of the impulses."""
        out_bar = bars(out)
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
        for density, f_bar, stride, impulse in self._buoyancy_terms(gained_bar):
            lifted, rho_on_faces, face_bar = rho[density], self._rho_on_faces, self._face_bar
            forces_adjoint.mean_with_before.launch(self.layout, self.device, [lifted, stride], [rho_on_faces])
            self._inner.dot([f_bar], [rho_on_faces], next(impulses_bar))
            algebra.copy.launch(self.layout, self.device, [f_bar], [face_bar])
            self._velocity_ghosts[stride > 1].fill(face_bar)
            inputs = [face_bar, impulse, stride, self.layout.nx]
            forces_adjoint.lift_adjoint.launch(self.layout, self.device, inputs, [lifted.grad])
        for group in self._gaussian_forces:
            group.adjoint(gained_bar)

    def _buoyancy_terms(self, velocity: Vector) -> list[tuple[int, wp.array, int, wp.array]]:
        """For each buoyancy and component: the density's index, the component, its stride and its impulse."""
        terms = []
        for n, (_, density) in enumerate(self._buoyancies):
            impulses = self._impulses[len(self._fields) + 2 * n :][:2]
            for component, stride, impulse in zip(velocity, (1, self.layout.pitch), impulses, strict=True):
                terms.append((density, component, stride, impulse))
        return terms

    def prescribe(self, b: wp.array) -> None:
        """Add the prescribed divergence to b = -div v, in place: launches only."""
        for growths in self._growths:
            growths.add(b)

    def prescribe_adjoint(self, minus_b_bar: wp.array) -> None:
        """The transpose of `prescribe`, from -b_bar: launches only."""
        for growths in self._growths:
            growths.adjoint(minus_b_bar)

    def gradients(self, numbers: np.ndarray, bars: np.ndarray) -> dict[int, np.ndarray]:
        """The gradients with respect to each force's impulses, from rows of `numbers` and `bars`, one a step.

        By the force's number, (steps, n): for a Gaussian n are the numbers of `gaussian_impulse_of`, for a
        field its integrals, for a buoyancy its two impulses.
        """
        found: dict[int, np.ndarray] = {}
        for group in self._groups:
            columns, moments = self._parts[id(group.gaussians)]
            table = group.gradient(numbers[:, columns], bars[:, moments])
            found.update((n, table[:, :, place].T) for place, n in enumerate(group.members))
        members = [n for n, _ in self._fields] + [n for n, _ in self._buoyancies for _ in range(2)]
        for n in dict.fromkeys(members):
            places = [place for place, member in enumerate(members) if member == n]
            found[n] = bars[:, self._impulse_slice][:, places].astype(np.float64)
        return found

    def source_gradients(self, numbers: np.ndarray, bars: np.ndarray) -> list[dict[int, np.ndarray]]:
        """The same for the sources of each density."""
        found = []
        for sources, painted in zip(self.sources, self._painted, strict=True):
            batch = sources.gaussians
            columns, moments = self._parts[id(batch)] if batch else (slice(0), slice(0))
            found.append(sources.gradients(numbers[:, columns], bars[:, moments], bars[:, painted]))
        return found


_Groups = list[tuple[Painted | None, list[int]]]


def _by_weight(forces: Sequence[Force]) -> tuple[_Groups, _Groups]:
    """Gaussian forces, and growths, grouped by weight: each weight with the numbers of its forces."""
    found: tuple[dict, dict] = {}, {}
    for n, force in enumerate(forces):
        if isinstance(force, LocalForce):
            groups = found[isinstance(force, Growth)]
            groups.setdefault(id(force.weight), (force.weight, []))[1].append(n)
    return list(found[0].values()), list(found[1].values())


def _index_of(name: str, densities: Sequence[str]) -> int:
    """The index of the density that a buoyancy reads."""
    if name not in densities:
        there = ", ".join(densities) or "none"
        raise ValueError(f"buoyancy reads the density {name!r}: expected one of the fluid's ({there})")
    return list(densities).index(name)


def _check(what: str, gained: float, t: float, until: float) -> None:
    """Refuse a force that adds more velocity in a step than the limit."""
    if not gained <= FORCE_LIMIT * STEP_LIMIT:
        raise ValueError(
            f"{what} would add a velocity of {gained:g} between {t:g} s and {until:g} s; "
            f"the limit is {FORCE_LIMIT * STEP_LIMIT:g}"
        )


def _uploaded(values: tuple[np.ndarray, np.ndarray], layout: Layout, device: wp.Device) -> Vector:
    """The two components of a field, on the device, without ghosts."""
    fields = vector(layout, device, 2)
    for value, f in zip(values, fields, strict=True):
        from_numpy(value, f, layout)
    return fields
