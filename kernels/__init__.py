"""Device code only: one file a stage, each a program per cell. See README.md for the cell.

Importing the package registers every program, so that each device's module is built once and whole.
"""

from wfluid.kernels import (
    advection,
    forces,
    ghosts,
    lookup,
    measure,
    projection,
    relaxation,
    transfer,
    transport,
)

__all__ = [
    "advection",
    "forces",
    "ghosts",
    "lookup",
    "measure",
    "projection",
    "relaxation",
    "transfer",
    "transport",
]
