"""Conjugate gradients, preconditioned by whatever approximate inverse the caller has."""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from wfluid.fields.arrays import Vector, vector
from wfluid.kernels.cell.real import Real
from wfluid.kernels.cell.strips import alone, repeat_while, together
from wfluid.kernels.solve import krylov, sums
from wfluid.solve.multigrid import Level


class ConjugateGradients:
    """Conjugate gradients on the equation of a level, with everything they keep.

    `precondition(r, z)` writes to z what a symmetric approximate inverse makes of r, both with ghosts;
    `zero` is a field of zeros a component.
    """

    def __init__(
        self, level: Level, zero: Vector, precondition: Callable[[Vector, Vector], None], device: wp.Device
    ):
        self.level, self.zero, self.precondition, self.device = level, zero, precondition, device
        self.layout = level.layout
        components = len(level.points)
        self.r, self.z, self.p, self.q = (vector(self.layout, self.device, components) for _ in range(4))
        self._rows = self.layout.ny * components
        self._products, self._wholes = (
            wp.zeros(self._rows, dtype=Real, device=self.device) for _ in range(2)
        )
        numbers = wp.zeros(4, dtype=Real, device=self.device)
        self._rz, self._limit, self._length, self._ratio = (numbers[n : n + 1] for n in range(4))
        counts = wp.zeros(2, dtype=wp.int32, device=self.device)
        self._going, self._iterations = counts[0:1], counts[1:2]

    def ran(self) -> int:
        """Iterations of the last solve."""
        return int(self._iterations.numpy()[0])

    def _multiply(self, x: Vector, y: Vector, out: wp.array) -> None:
        """Row sums of x y."""
        layout = self.layout
        with together():
            for n, (f, g) in enumerate(zip(x, y, strict=True)):
                inputs = [f, g, layout.nx, layout.pitch, n * layout.ny]
                sums.row_products.launch(layout.ny, self.device, inputs, [out])

    def solve(self, b: Vector, x: Vector, tolerance: float, most: int, whole: Vector | None) -> None:
        """x = A^-1 b to the tolerance in `most` iterations at most; b with ghosts, x comes with ghosts."""
        alone(lambda: [start.zero_() for start in x])
        alone(lambda: [wp.copy(r, f) for f, r in zip(b, self.r, strict=True)])
        self.precondition(self.r, self.z)
        alone(lambda: [wp.copy(p, z) for z, p in zip(self.z, self.p, strict=True)])
        self._multiply(self.r, self.z, self._products)
        self._multiply(*((whole, whole) if whole else (self.r, self.z)), self._wholes)
        inputs = [self._products, self._wholes, self._rows, Real(tolerance), most]
        krylov.begin.launch(1, self.device, inputs, [self._rz, self._limit, self._going, self._iterations])
        repeat_while(self._going, lambda: self._iterate(x, most))
        self.level.fill(x)

    def _iterate(self, x: Vector, most: int) -> None:
        top, layout, device = self.level, self.layout, self.device
        top.residual(self.zero, self.p, self.q)  # q = -A p
        top.fill(self.q)
        self._multiply(self.p, self.q, self._products)
        krylov.measure_length.launch(1, device, [self._products, self._rows, self._rz], [self._length])
        with together():
            for p, q, f, r in zip(self.p, self.q, x, self.r, strict=True):
                krylov.advance.launch(layout, device, [p, q, self._length], [f, r])
        top.fill(self.r)
        self.precondition(self.r, self.z)
        self._multiply(self.r, self.z, self._products)
        inputs = [self._products, self._rows, self._limit, most]
        outputs = [self._rz, self._ratio, self._going, self._iterations]
        krylov.measure_ratio.launch(1, device, inputs, outputs)
        with together():
            for z, p in zip(self.z, self.p, strict=True):
                krylov.turn.launch(layout, device, [z, self._ratio], [p])
        top.fill(self.p)
