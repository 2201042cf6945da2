"""Steps a solver from frame to frame, and checks the residuals of its solves."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from wfluid.domain.timeline import Timeline
from wfluid.fields.arrays import copy
from wfluid.fields.state import State
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force
from wfluid.step.diffusion import ERROR_TIME, MARGIN
from wfluid.step.march import march, steps_of
from wfluid.step.solver import Solver, SolveReport

POOR_RESIDUAL = 0.02
"""Relative residual of the projection, and of the diffusion by Jacobi sweeps, above which a frame warns."""


class PoorSolveWarning(UserWarning):
    """A solve's residual is too large; the message has the number and the remedy."""

    def __init__(self, index: int, seen: str, number: str, remedy: str):
        super().__init__(f"frame {index}: {seen}: {number}; {remedy} (said once)")
        self.plain = f"frame {index}: {seen}; {remedy} (said once)"
        """The message without the number."""


@dataclass(frozen=True)
class SimulatedFrame:
    """The fluid at one frame."""

    state: State
    """Its state; overwritten when the next frame is asked for."""
    solve: SolveReport | None
    """Residuals of the last step's solves; None if there was no step."""


class Simulation:
    """Steps a fluid from frame to frame, from rest on."""

    def __init__(self, solver: Solver, timeline: Timeline, points: np.ndarray | Sequence = ()):
        self.solver, self.timeline, self.points = solver, timeline, points
        self.now, self.spare = solver.rest(points), solver.rest(points)
        self._warned = False

    now: State
    """The current state of the fluid."""
    spare: State
    """A state that the next step writes over."""

    def moments(
        self, forces: Sequence[Force], frames: int, first: Sequence[Force] = ()
    ) -> Iterator[SimulatedFrame]:
        """The current fluid, and then the fluid after each of so many frames; the forces' time begins at 0.

        The forces `first` act in the first step too.
        """
        yield SimulatedFrame(self.now, None)
        per_frame = self.timeline.steps_per_frame
        take_first, take = (
            steps_of(self.solver, self.timeline, acting) for acting in ([*forces, *first], forces)
        )

        def advance(state_in: State, state_out: State, step: int) -> None:
            (take if step else take_first)(state_in, state_out, step)

        errors = 0.0  # of the velocity, summed over the steps [longer side/s]
        steps = march(self.now, self.spare, range(frames * per_frame), advance)
        for index in range(1, frames + 1):
            for self.now, self.spare in islice(steps, per_frame):
                pass  # to the next frame
            solve, t = self.solver.report(), self.timeline.time_of(index * per_frame)
            errors += per_frame * solve.diffusion.error
            solve = replace(solve, map_loss=min(ERROR_TIME, t / 2) * errors)
            self._warned = _judge(solve, self.solver.fluid, index, t, self._warned)
            yield SimulatedFrame(self.now, solve)

    def untouch(self) -> None:
        """Reset map, densities and points to those at rest; the velocity stays."""
        rest = self.solver.rest(self.points)
        for untouched, array in zip(rest.seen, self.now.seen, strict=True):
            copy(untouched, array)


def _judge(solve: SolveReport, fluid: Fluid, index: int, t: float, warned: bool) -> bool:
    """Stop where the fluid is not finite; warn once of a solve with a large residual."""
    pressure = solve.pressure
    if not math.isfinite(pressure.norm + pressure.norm_b + solve.divergence):
        raise FloatingPointError(
            f"frame {index}: the velocity is no longer finite; use smaller forces or steps"
        )
    if warned:
        return warned
    poor = _poor(solve, fluid, t)
    if poor:
        warnings.warn(PoorSolveWarning(index, *poor), stacklevel=2)
    return bool(poor)


AREAS = "some areas grow or shrink that should not"
"""What is seen of divergence that is left."""


def _poor(solve: SolveReport, fluid: Fluid, t: float) -> tuple[str, str, str] | None:
    """Of a large residual what is seen of it, the number and the remedy; None if there is none."""
    pressure, diffusion = solve.pressure, solve.diffusion
    if pressure.method == "jacobi":
        return _unconverged(pressure.relative, diffusion.relative, fluid)
    if pressure.relative > POOR_RESIDUAL:
        left = f"the projection left {pressure.relative:.1e} of the divergence after {pressure.iterations}"
        if pressure.method == "multigrid":
            more = f"set pressure_cycles (--pressure-cycles) to {fluid.pressure_cycles + 2}"
            return AREAS, f"{left} cycles", more
        return f"{AREAS}, beside what is frozen", f"{left} iterations", "soften the edges of the freeze mask"
    if diffusion.unfinished:
        return (
            "stiff parts may move by a little less or more than they should",
            f"the diffusion left {diffusion.relative:.1e} of its change after {diffusion.iterations} "
            "iterations",
            "lower the contrast of the viscosity, soften its edges, or use more substeps",
        )
    excess = solve.map_loss / (fluid.diffusion_loss * max(1.0, t))
    if excess > MARGIN:
        less = fluid.diffusion_tolerance / excess
        return (
            f"places may be off by {100 * solve.map_loss:.2g} % of the longer side",
            f"the diffusion's solves may have moved places by {solve.map_loss:.1e} of the longer side",
            f"set diffusion_tolerance (--diffusion-tolerance) to {less:.1e}",
        )
    return None


def _unconverged(divergence: float, change: float, fluid: Fluid) -> tuple[str, str, str] | None:
    """As `_poor`, of the parts of divergence and viscous change that Jacobi sweeps left, if one is large."""
    if max(divergence, change) <= POOR_RESIDUAL:
        return None
    remedy = "set solver (--solver) to multigrid"
    if fluid.scheme == "paper":
        remedy += " or scheme (--scheme) to standard"
    seen = [AREAS] if divergence > POOR_RESIDUAL else []
    seen += ["viscosity acts less than it should"] if change > POOR_RESIDUAL else []
    return (
        ", and ".join(seen),
        f"{fluid.sweeps} Jacobi sweeps left {divergence:.1e} of the divergence and {change:.1e} of the "
        "viscous change, so they have not converged",
        remedy,
    )
