"""Copies of the visible part of a state, on the host, for loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wfluid.fields.arrays import assign, read
from wfluid.fields.state import State


@dataclass(frozen=True)
class Snapshot:
    """A copy of a state's map, points and densities, ghosts included."""

    moved: tuple[np.ndarray, ...]
    """Both components of the map and of the points."""
    poured: tuple[np.ndarray, ...]
    """The densities."""

    @classmethod
    def of(cls, state: State) -> Snapshot:
        """A copy of the visible part of a state."""
        return cls(*(tuple(read(array).copy() for array in arrays) for arrays in _seen(state)))

    @classmethod
    def sum_of(cls, *terms: tuple[float, Snapshot]) -> Snapshot:
        """A weighted sum of snapshots."""

        def summed(*arrays: np.ndarray) -> np.ndarray:
            weights = (array.dtype.type(weight) for (weight, _), array in zip(terms, arrays, strict=True))
            return sum(weight * array for weight, array in zip(weights, arrays, strict=True))

        moved = zip(*(snapshot.moved for _, snapshot in terms), strict=True)
        poured = zip(*(snapshot.poured for _, snapshot in terms), strict=True)
        return cls(tuple(summed(*arrays) for arrays in moved), tuple(summed(*arrays) for arrays in poured))

    def onto(self, state: State) -> State:
        """Write the snapshot into a state; returns the state."""
        for values, arrays in zip((self.moved, self.poured), _seen(state), strict=True):
            for value, array in zip(values, arrays, strict=True):
                assign(value, array)
        return state


def _seen(state: State) -> tuple[tuple, tuple]:
    return (state.d_x, state.d_y, state.p_x, state.p_y), state.rho
