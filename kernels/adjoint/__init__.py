"""The transposes of the stages."""

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
