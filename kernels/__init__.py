"""Device code only: one file a stage, each a program per cell. See README.md for the cell.

Importing the package registers every program, so that each device's module is built once and whole.
"""

from wfluid.kernels import (
    advection,
    advection_adjoint,
    dense,
    forces,
    forces_adjoint,
    ghosts,
    krylov,
    lookup,
    lookup_adjoint,
    measure,
    misfit,
    projection,
    projection_adjoint,
    relaxation,
    rows,
    scatter,
    sources,
    transfer,
    transport,
    transport_adjoint,
    viscosity,
    viscosity_adjoint,
)

__all__ = [
    "advection",
    "advection_adjoint",
    "dense",
    "forces",
    "forces_adjoint",
    "ghosts",
    "krylov",
    "lookup",
    "lookup_adjoint",
    "measure",
    "misfit",
    "projection",
    "projection_adjoint",
    "relaxation",
    "rows",
    "scatter",
    "sources",
    "transfer",
    "transport",
    "transport_adjoint",
    "viscosity",
    "viscosity_adjoint",
]
