"""The step of a fluid: what all kinds have in common. `inertial` and `creeping` find the velocity."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector, fill, lookup_args, vector
from wfluid.fields.device import load_kernels
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.program import ADJOINT
from wfluid.kernels.cell.strips import alone
from wfluid.model.fluid import Fluid
from wfluid.solve.system import Residual
from wfluid.step.advection import Advection
from wfluid.step.coefficients import Coefficients
from wfluid.step.densities import DensityTransport
from wfluid.step.feet import Feet
from wfluid.step.forcing import Forcing
from wfluid.step.tape import attach_gradients, bars
from wfluid.system.threads import ThreadTeam, free_cores, helpers

STEP_THREADS = 2
"""Threads that share a step on a CPU. More threads would only wait for memory."""

SHARED_CELLS = 300 * 300
"""Least number of cells for which sharing a step is faster while the process does other work as well."""

SHARED_ALONE = 160 * 160
"""The same while the process does no other work, as in the evaluations of an optimisation."""

COUPLED_WORK = 4
"""Cost of a step with coupled diffusion, relative to a step without."""


class Step(ABC):
    """The stages of a step, with the arrays they work in. They only launch, so a graph can capture them.

    While a tape is recording, each stage puts its transpose on it (`tape`). The backward pass of a step may
    run later, after other steps: first `recompute` restores what the transposes read, then
    `tape.backward()` computes the gradients with respect to the state before the step, the forces and the
    viscosity, from those with respect to the state after it. A symmetric linear solver is its own
    transpose, so no sweep or iterate of a solve is recorded.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device, fixed_tolerance: float):
        self.grid, self.fluid, self.device, self.fixed_tolerance = grid, fluid, device, fixed_tolerance
        self.layout = Layout(grid.nx, grid.ny)
        walls = fluid.boundary
        self.velocity_ghosts = [
            Ghosts(self.layout, rules, device) for rules in (walls.u_rules(), walls.v_rules())
        ]
        self.moved_ghosts = [
            Ghosts(self.layout, rules, device)
            for rules in (walls.displacement_x_rules(), walls.displacement_y_rules())
        ]
        self.lookup_args = lookup_args(grid, walls, self.layout)
        ghosts = self.velocity_ghosts, self.moved_ghosts
        self.feet = Feet(grid, fluid, device, *ghosts)
        self.paper = fluid.scheme == "paper"
        self.map_feet = Feet(grid, fluid, device, *ghosts) if self.paper else self.feet
        self.advection = Advection(grid, fluid, device, *ghosts)
        self.coefficients = None if fluid.separable else Coefficients(grid, fluid, device)
        self.densities = [DensityTransport(density, grid, fluid, device) for density in fluid.densities]
        self.pushed = vector(self.layout, device, 2)

    keeps_pressure: bool
    """Whether a step reads the pressure of the one before."""
    transports_with_new_velocity: bool
    """Whether map, densities and points move along the velocity after the step; else the one before it."""
    pushed: Vector
    """The velocity after the forces of the last step that had any, with ghosts."""

    @abstractmethod
    def advance(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Write the state after the step to `state_out`: launches only; a tape that records takes them.

        The last record is the first to play: it sets gradients to 0 to which several stages add.
        """

    @abstractmethod
    def recompute(self, state_in: State, state_out: State, forcing: Forcing) -> None:
        """Compute again what the transposes of a step read besides the state before it: launches only.

        Of the state after it the velocity is read, where that transports.
        """

    @abstractmethod
    def plan(self, t: float, dt: float, prepare: Callable[[], None]) -> tuple:
        """Set the step up for a length dt and an end at t. Returns the methods of its solves.

        Calls `prepare`, which must launch `update_coefficients`, if the coefficients have changed.
        """

    @abstractmethod
    def expect(self, times: Sequence[float], dt: float) -> tuple:
        """Set up steps of dt that end at these times, in a viscosity that depends on time.

        Returns the methods of their solves, which suit all of them. Before each step the caller must write
        its viscosity to `coefficients.painted_mu` and call `update_coefficients`.
        """

    @abstractmethod
    def update_coefficients(self, state: State | None = None) -> None:
        """Update the coefficients on all grids, then the solvers: launches only.

        With `state` the viscosity is first carried along with its map.
        """

    @abstractmethod
    def pressure_part(self, dt: float, last_dt: float, divergence_prescribed: bool) -> float:
        """The fraction of the last step's pressure that a step of dt subtracts before its diffusion."""

    @abstractmethod
    def take_fluid(self, fluid: Fluid) -> None:
        """Replace the fluid by one that differs in the values of its viscosity only, not in its type."""

    @abstractmethod
    def measure(self) -> tuple[Residual, Residual, float]:
        """Of the last step: the residuals of projection and diffusion, and the largest |div v - s| [1/s]."""

    @property
    @abstractmethod
    def mu_bar(self) -> wp.array:
        """The gradient with respect to the painted viscosity, at centres; every backward step adds to it."""

    def allow_gradients(self, of_viscosity: bool = False) -> None:
        """Allocate the arrays of the transposes, once, and load their kernels.

        With `of_viscosity` the backward pass also computes the gradient with respect to viscosity. It is as
        accurate as the solve of the diffusion. A viscosity that moves needs it in any case.
        """
        load_kernels(self.device, ADJOINT)
        if self.pushed[0].grad is not None:
            return  # captured graphs know the arrays by their addresses
        attach_gradients(self.pushed, self.layout, self.device)
        if self.coefficients:
            self.coefficients.allow_gradients()
        self.feet.allow_gradients()
        self.map_feet.allow_gradients()
        self.advection.allow_gradients()
        for density in self.densities:
            density.allow_gradients()

    def _clear_gradients(self, state: State) -> None:
        """Set to 0 the gradients to which several stages add; the backward pass of a step begins with it."""
        added = [*state.arrays, *self.pushed, *self.feet.foot]
        if self.paper:
            added += self.map_feet.foot
        if self.coefficients and self.fluid.viscosity_moves:
            added.append(self.coefficients.levels[0].mu)
        alone(lambda: fill(0.0, *bars(added)))

    def transport(self, state_in: State, state_out: State, velocity: Vector, forcing: Forcing) -> None:
        """Move the state's points, densities and map along a velocity."""
        points, out = (state_in.p_x, state_in.p_y), (state_out.p_x, state_out.p_y)
        self.feet.carry_points(points, velocity, forcing, out)
        foot = self.map_feet.trace(velocity, forcing)
        self.carry_densities(state_in, foot, forcing, state_out)
        self.carry_map(state_in, foot, state_out)

    def trace(self, state: State, forcing: Forcing) -> Vector:
        """The feet (departure points) of all centres along the state's velocity [cells], with ghosts."""
        return self.feet.trace((state.u, state.v), forcing)

    def carry_map(self, state_in: State, foot: Vector, state_out: State) -> None:
        """Carry the state's map along the flow."""
        d, out = (state_in.d_x, state_in.d_y), (state_out.d_x, state_out.d_y)
        self.advection.carry_map(d, foot, out)

    def carry_densities(self, state_in: State, foot: Vector, forcing: Forcing, state_out: State) -> None:
        """Carry, add to (by their sources) and diffuse the state's densities."""
        stages = zip(self.densities, state_in.rho, forcing.sources, state_out.rho, strict=True)
        for density, rho, sources, out in stages:
            density.advance(rho, foot, self.lookup_args, sources, out)

    def helpers(self, alone: bool = False) -> ThreadTeam | None:
        """The threads that share the launches of a step with the calling one; None where that is no faster.

        Smaller grids gain from it if the process is `alone`, that is, does no other work meanwhile.
        """
        work = self.grid.nx * self.grid.ny * (COUPLED_WORK if self.coefficients else 1)
        least = SHARED_ALONE if alone else SHARED_CELLS
        shared = not self.device.is_cuda and free_cores() >= STEP_THREADS and work >= least
        return helpers(STEP_THREADS if shared else 1)
