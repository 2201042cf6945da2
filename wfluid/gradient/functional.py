"""An objective as a function of the free numbers, with its gradient: the interface to an optimiser.

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

An evaluation has two passes. The forward pass sets the free numbers, runs the simulation in a captured loop
of steps, stores the state after each step, and measures the objective. The backward pass runs the transposes
of the steps from the last to the first (the adjoint method; Bonilla & Velho, section III); it computes again
what they read besides the stored states, but no solve unless viscosity is free or moves. If `memory_mb`
leaves no room for all states, only some are stored as checkpoints, from which steps are taken again.

So the gradient is that of the discretised simulation, walls included, and costs about two more runs for any
number of free numbers. It is exact to rounding where the solves are cycles or sweeps, which are their own
transposes. Where viscosity or drag jump, the solves are conjugate gradients, which are their own transposes
up to their tolerance; it is lowered here to `JUMP_TOLERANCE`. With respect to viscosity the gradient is as
accurate as the diffusion's solve; where it is free or moves, the tolerance of sweeps and cycles is lowered
here to `FIXED_TOLERANCE`.
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
from wfluid.gradient.variables import VELOCITY, VISCOSITY, Address, Free, Setup, Variables, address_of
from wfluid.kernels.cell.real import Real
from wfluid.model.densities import Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, LocalForce, flatten
from wfluid.step.diffusion import SURE_TOLERANCE
from wfluid.step.gaussians import gaussian_impulse_of
from wfluid.step.kinds import step_for

JUMP_TOLERANCE = {"float32": 1e-4, "float64": 1e-9}[Real.__name__]
"""Largest tolerance of conjugate gradients, a relative residual."""

FIXED_TOLERANCE = {"float32": 1e-5, "float64": 1e-9}[Real.__name__]
"""Largest tolerance of sweeps and cycles, whose rates change with viscosity, where that is free or moves."""

ROUNDING = 1e-6
"""Distance outside the picture that counts as rounding, for a point on its edge [longer side]."""


@dataclass
class EvaluationTimes:
    """Time spent on evaluations [s]."""

    forward: float = 0.0
    """Of forward passes."""
    backward: float = 0.0
    """Of backward passes."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An objective at one vector of free numbers."""

    value: float
    """The objective."""
    gradient: np.ndarray
    """Its gradient, of the vector's length."""
    places: Mapping[float, np.ndarray]
    """Positions of all particles [longer side], (n, 2), by the objective's times [s]."""


class Functional:
    """An objective of a run, as a function of the run's free numbers.

    The constructor loads the kernels and captures graphs, which evaluations replay. One thread at a time may
    use it.

    Raises:
        ValueError: nothing free, or a name that cannot vary; an objective's time outside the run or between
            two steps; a memory cap too small; a velocity that does not fit the grid; a diffusion whose
            tolerance is too large for the gradient with respect to a viscosity that is free or moves.
    """

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        forces: Force | Group | Sequence[Force | Group],
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
        """`velocity` (2, ny, nx) is the velocity at the beginning, as in `Setup`; 0 by default.

        With `begin`, a time [s] and the fluid at that time (`state_after`), the run starts there; the
        objective's points are then positions at that time. It ends with the timeline, or at the time `end`.

        `memory_mb` caps the memory for stored states, by far the largest part. If the states exceed it, most
        steps are computed twice.

        `graphs` is a cache: this functional reuses the graphs of an earlier one with the same cache, grid,
        timeline, fluid, types of forces and number of particles, if both or neither have effort. The earlier
        one cannot be evaluated afterwards. `room` [s] reserves tables for runs up to that length, so that
        later functionals of longer runs can reuse the graphs too.
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
        of_viscosity = self.variables.has(address_of(VISCOSITY))
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
        cached = graphs.find(grid, timeline, fluid) if graphs else None
        fixed = FIXED_TOLERANCE if of_viscosity or fluid.viscosity_moves else 1.0
        if cached and cached.step.fixed_tolerance != fixed:
            cached = None
        step = cached.step if cached else step_for(grid, fluid, open_device(device), JUMP_TOLERANCE, fixed)
        self._particles: list[tuple[float, ParticleObjective, slice]] = []
        terms: dict[int, list[DeviceObjective]] = {}
        # in the graphs effort has weight 1, so that they can be reused: other weights are relative to it
        self._scale = sum(weight for weight, term in terms_of(objective) if isinstance(term, Effort))
        effort, self._scale, count = bool(self._scale), self._scale or 1.0, 0
        for weight, term in terms_of(objective):
            particles = slice(count, count + len(points_of(term)))
            count, weight = particles.stop, weight / self._scale
            steps = [self._step_of(t) for t in times_of(term)]
            if isinstance(term, ParticleObjective):
                self._particles.append((weight, term, particles))
            elif isinstance(term, StateObjective):
                terms.setdefault(steps[0], []).append(term.term(step, weight, particles))
            elif not isinstance(term, Effort):
                raise TypeError(f"{type(term).__name__} is no objective of a run")
        points = np.concatenate([np.empty((0, 2)), *(points_of(term) for _, term in terms_of(objective))])
        inside = np.clip(points, 0.0, (grid.width, grid.height))
        if not np.all(np.abs(points - inside) <= ROUNDING):
            raise ValueError("an objective's particles must begin within the picture")
        self._observed = sorted({self._step_of(t) for _, term, _ in self._particles for t in term.times})
        step_range = StepRange(self._first, self._last, begun, inside)
        reusable = cached and not (terms or of_viscosity or memory_mb)
        if cached and reusable and cached.suits(setup, step_range, effort):
            cached.moved(setup, step_range)
            self._recording = cached
        else:
            rows = round(room / timeline.dt)
            self._recording = Recording(
                step, setup, timeline, step_range, terms, memory_mb, of_viscosity, effort, rows
            )
        self._graphs = graphs
        if graphs:
            graphs.keep(self._recording, self)
        self.evaluations, self.seconds = 0, EvaluationTimes()

    start: np.ndarray
    """The vector for the fluid, forces and velocity given to the constructor."""
    evaluations: int
    """Number of evaluations so far."""
    seconds: EvaluationTimes
    """Time spent on evaluations."""

    @property
    def memory(self) -> int:
        """Memory of the stored states [bytes]."""
        return self._recording.memory

    def setup(self, m: np.ndarray) -> Setup:
        """Fluid, forces and velocity for a vector.

        Raises:
            ValueError: a vector of another length, with numbers that are not finite, or out of range.
        """
        return self.variables.unpack(m)

    def value(self, m: np.ndarray) -> float:
        """The objective at m.

        Raises:
            ValueError: as `setup`, or a force that would add more velocity than the limit.
            FloatingPointError: the run does not stay finite; the message names the first such step.
        """
        return self._forward(m)[0]

    def state_after(self, m: np.ndarray) -> State:
        """The fluid at the end of the run for the vector m.

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
            FloatingPointError: the run or the gradient is not finite; the message names the step where that
                begins.
        """
        value, particle_bars, places = self._forward(m)
        began = time.perf_counter()
        found = self._recording.backward(particle_bars)
        m = np.asarray(m, dtype=np.float64)
        gradient = self._scale * self.variables.pull_back(self._gradients(found), m)
        if not np.all(np.isfinite(gradient)):
            self._recording.forward()  # with checkpoints, the backward pass has overwritten the tables
            self._recording.backward(particle_bars, watch=self._refuse)
            slices = self.variables.slices
            wrong = [part.name for part in slices if not np.all(np.isfinite(gradient[part.entries]))]
            raise FloatingPointError(f"the gradient with respect to {', '.join(wrong)} is not finite")
        self.seconds.backward += time.perf_counter() - began
        return Evaluation(value, gradient, places)

    def _forward(self, m: np.ndarray) -> tuple[float, dict[int, np.ndarray], dict[float, np.ndarray]]:
        """The forward pass: the value, the gradients with respect to particles' positions by step, and those
        positions by time.

        Raises:
            RuntimeError: a later functional has taken over the graphs of this one.
        """
        if self._graphs and not self._graphs.serves(self._recording, self):
            raise RuntimeError("a later functional has taken over the graphs of this one")
        self.evaluations += 1
        began, recording = time.perf_counter(), self._recording
        self._setup = self.variables.unpack(m)
        recording.set(self._setup)
        value, positions = recording.forward(self._observed)
        particle_bars: dict[int, np.ndarray] = {}
        at_times = {}
        for weight, term, particles in self._particles:
            for t in term.times:
                step = self._step_of(t)
                at_times[t] = positions[step]
                part, slope = term.at(t, positions[step][particles])
                value += weight * part
                bar = particle_bars.setdefault(step, np.zeros_like(positions[step]))
                bar[particles] += weight * slope
        if not (np.isfinite(value) and recording.finite):
            bad = recording.first_step_not_finite()
            raise FloatingPointError(
                "the objective is not finite"
                if bad is None
                else f"the fluid is not finite from step {bad} ({recording.time_of(bad):.4g} s) on: "
                "smaller forces or steps help"
            )
        self.seconds.forward += time.perf_counter() - began
        return value * self._scale, particle_bars, at_times

    def _refuse(self, step: int, bar: State) -> None:
        """Raise if the gradient with respect to the state before a step is not finite."""
        if not bar.finite:
            t = self._recording.time_of(step)
            raise FloatingPointError(f"the gradient is not finite from step {step} ({t:.4g} s) backward")

    def _gradients(self, found: RunGradients) -> dict[Address, np.ndarray]:
        """The gradients with respect to the numbers of a setup, by address."""
        mu_bar = found.viscosity
        if isinstance(self._setup.fluid.viscosity, float):
            mu_bar = np.asarray(mu_bar.sum())
        gradients = {address_of(VELOCITY): found.velocity, address_of(VISCOSITY): mu_bar}
        self._add_slopes(gradients, ("forces",), self._setup.forces, found.forces)
        for d, density in enumerate(self._setup.fluid.densities):
            sources: Address = ("fluid", "densities", d, "sources")
            self._add_slopes(gradients, sources, density.sources, found.sources[d])
        return gradients

    def _add_slopes(
        self, gradients: dict, parent: Address, forces: Sequence, found: Mapping[int, np.ndarray]
    ) -> None:
        """Add the gradients of the numbers of forces at the address `parent`, summed over the steps."""
        for n, force in enumerate(forces):
            address = (*parent, n)
            if not self.variables.has(address):
                continue
            for step, row in enumerate(found[n]):
                start, end = self._recording.time_of(step), self._recording.time_of(step + 1)
                if not np.any(row):
                    continue
                bar = gaussian_impulse_of(row) if isinstance(force, LocalForce | Source) else row
                for name, slope in force.pull_back(start, end, bar).items():
                    number = (*address, *address_of(name))
                    gradients[number] = gradients.get(number, 0.0) + slope

    def _step_of(self, t: float, what: str = "an objective") -> int:
        """Number of steps from the run's beginning to a time.

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
    """Refuse gradients with respect to viscosity if the diffusion's tolerance is too large for them."""
    what = "a free viscosity" if free else "a viscosity that moves"
    if not (free or fluid.viscosity_moves):
        return
    if fluid.scheme == "paper" and not fluid.uniform:
        raise ValueError(f"{what} has no gradient in the scheme 'paper': set scheme to 'standard'")
    if fluid.solver == "jacobi":
        raise ValueError(f"{what} needs a diffusion solved to a tolerance: set solver to 'multigrid'")
    if fluid.diffusion_tolerance > SURE_TOLERANCE:
        raise ValueError(
            f"{what} has a gradient only as good as the diffusion's solve: set diffusion_tolerance to "
            f"{SURE_TOLERANCE:g} or less, not {fluid.diffusion_tolerance:g}"
        )
