"""An objective as a function of the numbers that are free, with its exact gradient: all an optimiser sees.

>>> from wfluid import Constant, Effort, Fluid, Free, GaussianForce, Grid, ParticleMisfit, Timeline
>>> forces = [GaussianForce((0.4, 0.5), (1.0, 0.0), 0.1, Constant(0, 0.25))]
>>> objective = ParticleMisfit([(0.4, 0.5)], [(0.6, 0.5)], time=0.5) + 1e-4 * Effort()
>>> free = [Free("forces[0].vector"), Free("forces[0].center", scale=0.1)]
>>> functional = Functional(Grid(32, 32), Fluid(), forces, Timeline(0.5), objective, free)
>>> value, gradient = functional.value_and_gradient(functional.start)
>>> gradient.shape
(4,)
>>> bool(gradient[0] < 0)  # a stronger push to the right brings the point nearer
True

The gradient is that of the very numbers the simulation computes, discretisation, walls and all, by the
adjoint method (Bonilla & Velho, section III): whatever the number of free numbers, it costs about two
more runs. It is right to rounding where solves are cycles or sweeps, which are their own transposes. Where
viscosity or drag jump they are conjugate gradients, which are so up to a tolerance (`JUMP_TOLERANCE`, for
which a fluid's own is lowered here); and with respect to viscosity it is right up to the diffusion's.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.fields.device import open_device
from wfluid.fields.state import State
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.objectives import Effort, Objective, ParticleObjective, points_of, terms_of, times_of
from wfluid.gradient.recording import Recording, RunGradients, StepRange
from wfluid.gradient.state_objectives import DeviceObjective, StateObjective
from wfluid.gradient.variables import VELOCITY, VISCOSITY, Free, Setup, Variables
from wfluid.kernels.cell.real import Real
from wfluid.model.densities import Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, LocalForce, flatten
from wfluid.step.diffusion import SURE_TOLERANCE
from wfluid.step.gaussians import gaussian_impulse_of
from wfluid.step.step import Step

JUMP_TOLERANCE = {"float32": 1e-4, "float64": 1e-9}[Real.__name__]
"""Largest relative residual that conjugate gradients may leave."""


ROUNDING = 1e-6
"""How far outside the picture rounding may leave a point on its edge [longer side]."""


@dataclass
class EvaluationTimes:
    """Time spent on evaluations [s]."""

    forward: float = 0.0
    """Simulations."""
    backward: float = 0.0
    """Their adjoints."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An objective at one vector of free numbers."""

    value: float
    """The objective."""
    gradient: np.ndarray
    """Its gradient, of the vector's length."""
    places: Mapping[float, np.ndarray]
    """Positions of all the objective's particles [longer side], (n, 2), by the times it looks at them [s]."""


class Functional:
    """An objective of a run, as a function of the run's free numbers.

    Making one loads the kernels; the first evaluation captures graphs, which later ones replay. It is for one
    thread at a time.

    Raises:
        ValueError: nothing free, or a name that cannot be; an objective's time outside the run or between two
            steps; a cap on memory too small; a velocity that does not fit the grid; a free viscosity, or
            one that moves, whose diffusion is not solved well enough.
    """

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        forces: Sequence[Force | Group],
        timeline: Timeline,
        objective: Objective,
        free: Sequence[Free],
        *,
        velocity: np.ndarray | None = None,
        begin: tuple[float, State] | None = None,
        end: float | None = None,
        memory_mb: float | None = None,
        device: str | None = None,
        graphs: GraphCache | None = None,
        room: float = 0.0,
    ):
        """`velocity` (2, ny, nx) is that at the beginning, as in `Setup`; rest by default.

        With `begin`, a time [s] and the fluid at that time (`state_after`), the run goes on from there; the
        objective's points are then places at that time. It ends with the timeline, or at the time `end`.

        `memory_mb` caps the memory for stored states, by far the largest part. If the states exceed it, most
        steps are computed twice.

        `graphs` reuses captured graphs of an earlier functional that was given the same cache, if grid,
        timeline, fluid, kinds of forces and number of particles are the same and both or neither count
        effort; the earlier one cannot be evaluated afterwards. `room` [s] reserves tables for runs up to that
        length, so that later functionals of longer runs can reuse the graphs too.
        """
        shape = (2, grid.ny, grid.nx)
        velocity = np.zeros(shape) if velocity is None else np.array(velocity, dtype=np.float64)
        if velocity.shape != shape or not np.all(np.isfinite(velocity)):
            raise ValueError(f"velocity of shape {velocity.shape}: expected finite numbers of shape {shape}")
        setup = Setup(fluid, flatten(forces), velocity)
        self.grid, self.timeline, self.objective = grid, timeline, objective
        self.variables = Variables(setup, free, grid)
        self.start = self.variables.pack()
        self.start.setflags(write=False)
        of_viscosity = self.variables.has(VISCOSITY)
        _check_solves(fluid, of_viscosity)
        if memory_mb is not None and not (np.isfinite(memory_mb) and memory_mb > 0):
            raise ValueError(f"memory_mb {memory_mb}: expected a positive number of megabytes")
        if begin is not None and velocity.any():
            raise ValueError("a run begins with a velocity or with a state, not with both")
        self._first, self._last, begun = 0, timeline.steps, None
        if end is not None:
            self._last = self._step_of(end, "an end")
        if begin is not None:
            start, begun = begin
            if begun.grid != grid or len(begun.rho) != len(fluid.densities):
                raise ValueError("a run begins with a state of its own grid and densities")
            self._first = self._step_of(start, "a beginning")
            if self._first == self._last:
                raise ValueError(f"a beginning at {start:g} s: expected a time before the end")
        before = graphs.find(grid, timeline, fluid) if graphs else None
        step = before.step if before else Step(grid, fluid, open_device(device), JUMP_TOLERANCE)
        self._particles: list[tuple[float, ParticleObjective, slice]] = []
        terms: dict[int, list[DeviceObjective]] = {}
        # graphs count effort with weight 1, and so suit all weights: the others are relative to it
        self._scale = sum(weight for weight, term in terms_of(objective) if isinstance(term, Effort))
        effort, self._scale, count = bool(self._scale), self._scale or 1.0, 0
        for weight, term in terms_of(objective):
            own = slice(count, count + len(points_of(term)))
            count, weight = own.stop, weight / self._scale
            steps = [self._step_of(t) for t in times_of(term)]
            if isinstance(term, ParticleObjective):
                self._particles.append((weight, term, own))
            elif isinstance(term, StateObjective):
                terms.setdefault(steps[0], []).append(term.term(step, weight, own))
            elif not isinstance(term, Effort):
                raise TypeError(f"{type(term).__name__} is no objective that a run has")
        points = np.concatenate([np.empty((0, 2)), *(points_of(term) for _, term in terms_of(objective))])
        inside = np.clip(points, 0.0, (grid.width, grid.height))
        if not np.all(np.abs(points - inside) <= ROUNDING):
            raise ValueError("an objective's particles must begin within the picture")
        self._looked_at = sorted({self._step_of(t) for _, term, _ in self._particles for t in term.times})
        stretch = StepRange(self._first, self._last, begun, inside)
        if before and not (terms or of_viscosity or memory_mb) and before.suits(setup, stretch, effort):
            before.moved(setup, stretch)
            self._recording = before
        else:
            steps = round(room / timeline.dt)
            self._recording = Recording(
                step, setup, timeline, stretch, terms, memory_mb, of_viscosity, effort, steps
            )
        self._graphs = graphs
        if graphs:
            graphs.keep(self._recording, self)
        self.evaluations, self.seconds = 0, EvaluationTimes()

    start: np.ndarray
    """The free numbers of the fluid and forces given, as a vector."""
    evaluations: int
    """Number of evaluations so far."""
    seconds: EvaluationTimes
    """Time spent on evaluations."""

    @property
    def memory(self) -> int:
        """Memory of the stored states [bytes]."""
        return self._recording.memory

    def setup(self, m: np.ndarray) -> Setup:
        """Fluid, forces and velocity with the free numbers of a vector.

        Raises:
            ValueError: a vector of another length, with numbers that are not finite, or out of range.
        """
        return self.variables.unpack(m)

    def value(self, m: np.ndarray) -> float:
        """The objective at m.

        Raises:
            ValueError: as `setup`, or a force that would add more than the limit.
            FloatingPointError: the run does not stay finite; the message names the first bad step.
        """
        return self._forward(m)[0]

    def state_after(self, m: np.ndarray) -> State:
        """The fluid at the end of the run with the vector m.

        Raises:
            ValueError: as `value`.
            FloatingPointError: as `value`.
        """
        self._forward(m)
        return self._recording.end()

    def value_and_gradient(self, m: np.ndarray) -> tuple[float, np.ndarray]:
        """The objective at m and its gradient, of the length of m.

        Raises:
            ValueError: as `value`.
            FloatingPointError: as `evaluate`.
        """
        found = self.evaluate(m)
        return found.value, found.gradient

    def evaluate(self, m: np.ndarray) -> Evaluation:
        """The objective at m, its gradient and the positions of its particles.

        Raises:
            ValueError: as `value`.
            FloatingPointError: the run or the gradient is not finite; with the step where that begins.
        """
        value, pulls, places = self._forward(m)
        began = time.perf_counter()
        found = self._recording.backward(pulls)
        m = np.asarray(m, dtype=np.float64)
        gradient = self._scale * self.variables.pull_back(self._gradients(found), m)
        if not np.all(np.isfinite(gradient)):
            self._recording.forward()  # with little memory the backward pass has overwritten the end
            self._recording.backward(pulls, watch=self._refuse)
            slices = self.variables.slices
            wrong = [one.name for one in slices if not np.all(np.isfinite(gradient[one.entries]))]
            raise FloatingPointError(f"the gradient with respect to {', '.join(wrong)} is not finite")
        self.seconds.backward += time.perf_counter() - began
        return Evaluation(value, gradient, places)

    def _forward(self, m: np.ndarray) -> tuple[float, dict[int, np.ndarray], dict[float, np.ndarray]]:
        """The value, the gradients with respect to particles' positions by step, those positions by time.

        Raises:
            RuntimeError: a later functional has taken over the graphs of this one.
        """
        if self._graphs and not self._graphs.serves(self._recording, self):
            raise RuntimeError("a later functional has taken over the graphs of this one")
        self.evaluations += 1
        began, recording = time.perf_counter(), self._recording
        self._setup = self.variables.unpack(m)
        recording.set(self._setup)
        places = recording.forward(self._looked_at)
        value, pulls, at_times = recording.value, {}, {}
        for weight, term, own in self._particles:
            for t in term.times:
                step = self._step_of(t)
                at_times[t] = places[step]
                part, slope = term.at(t, places[step][own])
                value += weight * part
                pulls.setdefault(step, np.zeros_like(places[step]))[own] += weight * slope
        if not (np.isfinite(value) and recording.finite):
            step = recording.first_step_not_finite()
            raise FloatingPointError(
                "the objective is not finite"
                if step is None
                else f"the fluid is not finite from step {step} ({recording.time_of(step):.4g} s) on: "
                "smaller forces or steps help"
            )
        self.seconds.forward += time.perf_counter() - began
        return value * self._scale, pulls, at_times

    def _refuse(self, step: int, bar: State) -> None:
        if not bar.finite:
            t = self._recording.time_of(step)
            raise FloatingPointError(f"the gradient is not finite from step {step} ({t:.4g} s) backward")

    def _gradients(self, found: RunGradients) -> dict[str, np.ndarray]:
        """Gradients by name."""
        gradients = {VELOCITY: found.velocity, VISCOSITY: found.viscosity}
        if isinstance(self._setup.fluid.viscosity, float):
            gradients[VISCOSITY] = np.asarray(found.viscosity.sum())
        self._add_slopes(gradients, "forces", self._setup.forces, found.forces)
        for d, density in enumerate(self._setup.fluid.densities):
            self._add_slopes(gradients, f"fluid.densities[{d}].sources", density.sources, found.sources[d])
        return gradients

    def _add_slopes(
        self, gradients: dict, where: str, forces: Sequence, found: Mapping[int, np.ndarray]
    ) -> None:
        """Sum the gradients of each force's numbers over the steps."""
        for n, force in enumerate(forces):
            name = f"{where}[{n}]"
            if not self.variables.has(name):
                continue
            for step, row in enumerate(found[n]):
                start, end = self._recording.time_of(step), self._recording.time_of(step + 1)
                if not np.any(row):
                    continue
                bar = gaussian_impulse_of(row) if isinstance(force, LocalForce | Source) else row
                for key, slope in force.pull_back(start, end, bar).items():
                    gradients[f"{name}.{key}"] = gradients.get(f"{name}.{key}", 0.0) + slope

    def _step_of(self, t: float, what: str = "an objective") -> int:
        """The number of steps from the run's beginning to a time.

        Raises:
            ValueError: outside the run, or between two steps.
        """
        timeline = self.timeline
        start, end = (timeline.time_of(step) for step in (self._first, self._last))
        if not start < t <= end * (1 + 1e-9):
            raise ValueError(f"{what} at {t:g} s: expected a time after {start:g} and up to {end:g} s")
        step = round(t / timeline.dt)
        if abs(timeline.time_of(step) - t) > 1e-6 * timeline.dt or step == self._first:
            before, after = (timeline.time_of(int(t / timeline.dt) + n) for n in (0, 1))
            raise ValueError(
                f"{what} at {t:g} s falls between steps, at {before:.6g} s and {after:.6g} s: choose "
                "fps and substeps so that it falls on one"
            )
        return step - self._first


def _check_solves(fluid: Fluid, free: bool) -> None:
    """Refuse gradients with respect to a viscosity whose diffusion is not solved well enough."""
    what = "a free viscosity" if free else "a viscosity that moves"
    if not (free or fluid.viscosity_moves):
        return
    if fluid.solver == "jacobi":
        raise ValueError(f"{what} needs a diffusion solved to a tolerance: set solver to 'multigrid'")
    if fluid.diffusion_tolerance > SURE_TOLERANCE:
        raise ValueError(
            f"{what} has a gradient only as good as the diffusion's solve: set diffusion_tolerance to "
            f"{SURE_TOLERANCE:g} or less, not {fluid.diffusion_tolerance:g}"
        )
