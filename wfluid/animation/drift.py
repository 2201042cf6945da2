"""Drift taken off by composing flows: to subtract displacements would fold the picture.

A backward map D over some time is the flow exp(w) of a stationary velocity w over the time 1. Its fraction
exp(-s w) undoes the part s of the drift, and neither it nor its composition with a map that does not fold
folds. Velocities and maps are displacements (ny, nx, 2) [longer side]; (a b)(x) = a(b(x)).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap

SHORT = 0.25
"""Length of a displacement that is its own flow [cells]; a longer flow is the square of its half."""

CLOSED = 2e-6
"""Largest distance that a logarithm may leave [longer side]."""

ITERATIONS = 40
"""Most iterations of a logarithm."""

LEAST_STEP = 0.01
"""Least part of a correction that an iteration of a logarithm tries."""

NEWTON_STEPS = 12
"""Iterations of the search for a point that a map takes to its source."""


class Maps:
    """Composition, flows and logarithms of backward maps on a solver's grid."""

    def __init__(self, solver: Solver):
        self._solver, self.walls = solver, solver.fluid.walls
        self._outer, self._inner, self._out = (solver.rest() for _ in range(3))

    def composed(self, outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
        """The map `outer` after the map `inner`."""
        self._solver.set_map(self._outer, outer)
        self._solver.set_map(self._inner, inner)
        self._solver.compose(self._outer, self._inner, self._out)
        return np.stack(self._out.displacement, axis=2)

    def flow(self, velocity: np.ndarray) -> np.ndarray:
        """The flow of a stationary velocity over the time 1, by repeated squaring."""
        grid = self._solver.grid
        longest = np.abs(velocity / (grid.hx, grid.hy)).max()
        squarings = max(0, math.ceil(math.log2(longest / SHORT))) if longest > 0 else 0
        found = velocity / 2**squarings
        for _ in range(squarings):
            found = self.composed(found, found)
        return found

    def logarithm(self, drift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The velocity w whose flow is `drift`, and what is left: flow(-w) drift."""
        velocity = self._corrected(np.zeros_like(drift), drift, self._left_between)
        velocity = self._corrected(velocity, drift, self._left_after)
        return velocity, self._left_after(velocity, drift)

    def without_drift(
        self, lap: Sequence[np.ndarray], frames: int, velocity: np.ndarray, left: np.ndarray
    ) -> list[np.ndarray]:
        """The maps of a lap of `frames` frames without its drift, the logarithm of which is given."""
        parts = [n / frames for n in range(len(lap))]
        return [
            self.composed(self.flow(-s * velocity), displacement) - s * left
            for s, displacement in zip(parts, lap, strict=True)
        ]

    def _left_between(self, velocity: np.ndarray, drift: np.ndarray) -> np.ndarray:
        """flow(-w / 2) drift flow(-w / 2): as a correction of w it has no error of first order in w (BCH)."""
        half = self.flow(-velocity / 2)
        return self.composed(half, self.composed(drift, half))

    def _left_after(self, velocity: np.ndarray, drift: np.ndarray) -> np.ndarray:
        """flow(-w) drift."""
        return self.composed(self.flow(-velocity), drift)

    def _corrected(
        self, velocity: np.ndarray, drift: np.ndarray, left: Callable[[np.ndarray, np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """A velocity with less left of the drift: what is left corrects it, in steps that shorten it."""
        gap, step = left(velocity, drift), 1.0
        for _ in range(ITERATIONS):
            longest = np.abs(gap).max()
            if longest < CLOSED or step < LEAST_STEP:
                break
            tried = velocity + step * gap
            found = left(tried, drift)
            if np.abs(found).max() < longest:
                velocity, gap, step = tried, found, min(1.0, 2 * step)
            else:
                step /= 2
        return velocity

    def places(self, displacement: np.ndarray, sources: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """The places (n, 2) whose sources a map has at `sources`, found by Newton's method from `guess`."""
        grid, found = self._solver.grid, guess.copy()
        warp, extent = CoordinateMap(grid, self.walls, displacement), (grid.width, grid.height)
        for _ in range(NEWTON_STEPS):
            inside = np.where(self.walls.periodic, found % extent, np.clip(found, 0.0, extent))
            gap = warp.source_at(inside) - inside + found - sources
            if not gap.size or np.abs(gap).max() < CLOSED:
                break
            slopes = np.array([warp.slope_at(place) for place in inside])
            found = found - np.linalg.solve(slopes, gap[..., None])[..., 0]
        return found
