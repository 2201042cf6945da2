"""NumPy operators on a grid: Gaussian blur, and means of neighbours from centres to faces."""

from __future__ import annotations

import numpy as np

from wfluid.domain.grid import Grid


def blurred(values: np.ndarray, grid: Grid, radius: float, periodic: tuple[bool, bool]) -> np.ndarray:
    """Values at centres (ny, nx), blurred by a Gaussian of sigma `radius` [longer side].

    At a closed wall the weights are normalised, so that a constant stays constant; a periodic axis wraps.
    """
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
    """The mean of each value and its predecessor along an axis: from centres to faces, in the same shape."""
    return (values + before(values, axis, wraps)) / 2


def before(values: np.ndarray, axis: int, wraps: bool) -> np.ndarray:
    """The predecessor of each value along an axis; that of the first is itself, or the last if it wraps."""
    if wraps:
        return np.roll(values, 1, axis)
    first = values.take([0], axis)
    return np.concatenate([first, np.delete(values, -1, axis)], axis)
