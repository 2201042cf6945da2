"""The look-up of a picture through a map, and figures of the map."""

from wfluid.kernels.view import lookup, quality

__all__ = ["lookup", "quality"]
