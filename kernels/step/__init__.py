"""The stages of a step."""

from wfluid.kernels.step import (
    advection,
    differences,
    forces,
    ghosts,
    interpolation,
    projection,
    sources,
    transport,
)

__all__ = [
    "advection",
    "differences",
    "forces",
    "ghosts",
    "interpolation",
    "projection",
    "sources",
    "transport",
]
