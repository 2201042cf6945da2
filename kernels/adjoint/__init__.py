"""Transposes of the stages of a step and of the look-up."""

from wfluid.kernels.adjoint import (
    advection,
    forces,
    ghosts,
    lookup,
    misfit,
    scatter,
    step_table,
    transport,
    viscosity,
)

__all__ = [
    "advection",
    "forces",
    "ghosts",
    "lookup",
    "misfit",
    "scatter",
    "step_table",
    "transport",
    "viscosity",
]
