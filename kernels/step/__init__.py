"""The stages of a step."""

from wfluid.kernels.step import advection, forces, ghosts, interpolation, projection, sources, transport

__all__ = ["advection", "forces", "ghosts", "interpolation", "projection", "sources", "transport"]
