"""Conjugate gradients on the device, preconditioned by an approximate inverse that the caller provides."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import warp as wp

from wfluid.fields.arrays import Scalars, Vector, copy, entries, fill, read, vector, zeros
from wfluid.fields.sums import InnerProduct
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.real import Real
from wfluid.kernels.cell.strips import alone, repeat_while, together
from wfluid.kernels.solve import krylov


class Equation(Protocol):
    """A symmetric equation A x = b on a grid: what conjugate gradients need of it."""

    layout: Layout
    points: Sequence[Any]
    """The components of x."""

    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x. Reads the ghosts of x."""

    def fill(self, x: Vector) -> None:
        """Fill the ghosts of x."""


ANY = 1e30
"""A limit of <e, A e> that any error meets."""


class ConjugateGradients:
    """Conjugate gradients on an equation, with their vectors and numbers in device memory.

    `precondition(r, z)` writes z = M r with M a symmetric approximate inverse, r and z with ghosts. `zero`
    holds a field of zeros per component.
    """

    def __init__(
        self, level: Equation, zero: Vector, precondition: Callable[[Vector, Vector], None], device: wp.Device
    ):
        self.level, self.zero, self.precondition, self.device = level, zero, precondition, device
        self.layout = level.layout
        components = len(level.points)
        self.r, self.z, self.p, self.q = (vector(self.layout, self.device, components) for _ in range(4))
        self._rows = self.layout.ny * components
        self._inner, self._start = (InnerProduct(self.layout, device, components) for _ in range(2))
        self._numbers = Scalars(device, "rz", "limit", "error_limit", "length", "longest", "ratio", any=ANY)
        self._going, self._iterations = entries(zeros(2, device, wp.int32))

    def iterations_run(self) -> int:
        """Number of iterations of the last solve."""
        return int(read(self._iterations)[0])

    def error_left(self, tolerance: float) -> float:
        """The error of the last solve to `tolerance`, in the same measure."""
        rz, limit = (float(read(number)[0]) for number in (self._numbers.rz, self._numbers.limit))
        return tolerance * math.sqrt(rz / limit) if limit > 0 else 0.0

    def error(self) -> float:
        """The estimated error of the last solve in the norm of A, sqrt(<e, A e>)."""
        return math.sqrt(max(0.0, float(read(self._numbers.rz)[0]) * float(read(self._numbers.longest)[0])))

    def solve(
        self,
        b: Vector,
        x: Vector,
        tolerance: float,
        most: int,
        scale: Vector | None,
        error: wp.array | None = None,
    ) -> None:
        """x = A^-1 b, to the tolerance or after `most` iterations. Reads the ghosts of b, fills those of x.

        The tolerance is relative to the lesser of x and `scale`, or to x alone where `scale` is None. With
        `error`, an array of one number, the estimate of <e, A e> falls to that number as well.
        """
        alone(lambda: fill(0.0, *x))
        alone(lambda: _copy(b, self.r))
        self.precondition(self.r, self.z)
        alone(lambda: _copy(self.z, self.p))
        products = self._inner.along_rows(self.r, self.z)
        scales = self._start.along_rows(*((scale, scale) if scale else (self.r, self.z)))
        inputs, c = [products, scales, self._rows, Real(tolerance)], self._numbers
        inputs += [c.any if error is None else error, most]
        outputs = [c.rz, c.limit, c.error_limit, c.longest, self._going, self._iterations]
        krylov.begin.launch(1, self.device, inputs, outputs)
        repeat_while(self._going, lambda: self._iterate(x, most))
        self.level.fill(x)

    def _iterate(self, x: Vector, most: int) -> None:
        top, layout, device, c = self.level, self.layout, self.device, self._numbers
        top.residual(self.zero, self.p, self.q)  # q = -A p
        top.fill(self.q)
        products = self._inner.along_rows(self.p, self.q)
        krylov.measure_length.launch(1, device, [products, self._rows, c.rz], [c.length])
        with together():
            for p, q, f, r in zip(self.p, self.q, x, self.r, strict=True):
                krylov.advance.launch(layout, device, [p, q, c.length], [f, r])
        top.fill(self.r)
        self.precondition(self.r, self.z)
        products = self._inner.along_rows(self.r, self.z)
        inputs = [products, self._rows, c.limit, c.error_limit, c.length, most]
        outputs = [c.rz, c.ratio, c.longest, self._going, self._iterations]
        krylov.measure_ratio.launch(1, device, inputs, outputs)
        with together():
            for z, p in zip(self.z, self.p, strict=True):
                krylov.update_direction.launch(layout, device, [z, c.ratio], [p])
        top.fill(self.p)


def _copy(x: Vector, out: Vector) -> None:
    for f, to in zip(x, out, strict=True):
        copy(f, to)
