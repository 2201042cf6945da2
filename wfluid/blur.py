"""Values on a grid, blurred."""

from __future__ import annotations

import numpy as np

from wfluid.grid import Grid


def blurred(values: np.ndarray, grid: Grid, radius: float, periodic: tuple[bool, bool]) -> np.ndarray:
    """The values at centres under a Gaussian of sigma `radius`, whose weights sum to one at every wall."""
    for axis, (n, h, wraps) in enumerate(((grid.ny, grid.hy, periodic[1]), (grid.nx, grid.hx, periodic[0]))):
        if radius < 0.1 * h:
            continue
        distance = np.abs(np.arange(n)[:, None] - np.arange(n)) * h
        if wraps:
            distance = np.minimum(distance, n * h - distance)
        weights = np.exp(-0.5 * (distance / radius) ** 2)
        weights /= weights.sum(axis=1, keepdims=True)
        values = weights @ values if axis == 0 else values @ weights.T
    return values
