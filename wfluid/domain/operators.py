"""NumPy operators on grids: Gaussian blur, means with the neighbour before."""

from __future__ import annotations

import numpy as np

from wfluid.domain.grid import Grid


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


def mean_with_before(values: np.ndarray, axis: int, wraps: bool) -> np.ndarray:
    """The mean of each value and the one before it along an axis: from centres to faces."""
    return (values + before(values, axis, wraps)) / 2


def before(values: np.ndarray, axis: int, wraps: bool) -> np.ndarray:
    """The value before each along an axis; before the first its own, or the last where the axis wraps."""
    if wraps:
        return np.roll(values, 1, axis)
    first = values.take([0], axis)
    return np.concatenate([first, np.delete(values, -1, axis)], axis)
