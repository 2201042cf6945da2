"""The step that a fluid takes."""

from __future__ import annotations

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.model.fluid import Fluid
from wfluid.step.creeping import CreepingStep
from wfluid.step.inertial import InertialStep
from wfluid.step.step import Step


def step_for(
    grid: Grid, fluid: Fluid, device: wp.Device, jump_tolerance: float = 1.0, fixed_tolerance: float = 1.0
) -> Step:
    """The step of a fluid with inertia, or of a creeping one; the tolerances are those of `InertialStep`."""
    kind = InertialStep if fluid.inertia else CreepingStep
    return kind(grid, fluid, device, jump_tolerance, fixed_tolerance)
