"""The picture seen through a map, and what a map is judged by."""

from wfluid.kernels.view import lookup, quality

__all__ = ["lookup", "quality"]
