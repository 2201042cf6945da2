"""The multigrid hierarchy: its grids, what a level must be able to do, and the way between two levels.

Jacobi sweeps smooth on every level, the same before and after the coarser level's correction and in
opposite order; restriction is the prolongation's transpose. So a V-cycle is a symmetric operator. Any
grid size coarsens, n -> ceil(n/2) per axis (the finer one alone where cells are not square). W. Briggs,
V. Henson, S. McCormick, A Multigrid Tutorial, 2nd ed., chapters 3 and 5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import warp as wp

from wfluid.domain.walls import Rule
from wfluid.fields.arrays import Vector, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together

COARSEST = 16
"""Cells that the coarsest level may have; there a stored inverse solves exactly."""


@dataclass(frozen=True)
class Location:
    """Which points of a grid one component of the unknowns lies on."""

    rules: tuple[Rule, Rule]
    """Continuation beyond the edges along x and y."""
    on_faces: tuple[bool, bool] = (False, False)
    """Whether they lie on faces (at i h) instead of centres (at (i + 1/2) h) along x and y."""


class Level(ABC):
    """One grid of the hierarchy with an operator A on it: scratch vectors, ghosts, sweeps.

    A subclass is an equation. Its sweeps are x + rate M^-1 (b - A x) with a diagonal M of its own.
    """

    rates: Sequence[wp.array]
    """Damping of the sweeps on the way down, in device memory; on the way up in opposite order."""
    plain: wp.array
    """Damping of the paper's plain Jacobi sweeps."""

    def __init__(
        self, nx: int, ny: int, size: tuple[float, float], points: Sequence[Location], device: wp.Device
    ):
        self.layout = Layout(nx, ny)
        self.device = device
        self.h = (size[0] / nx, size[1] / ny)
        self.points = points
        self.ghosts = [Ghosts(self.layout, component.rules, device) for component in points]
        self.b, self.x, self.y, self.r = (vector(self.layout, device, len(points)) for _ in range(4))

    @abstractmethod
    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x; x with ghosts, out without."""

    @abstractmethod
    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate M^-1 b, without ghosts: the sweep from zero."""

    @abstractmethod
    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate M^-1 (b - A x); x with ghosts, out without."""

    def fill(self, x: Vector) -> None:
        """Fill the ghosts of x, and zero its faces on walls."""
        with together():
            for f, ghosts in zip(x, self.ghosts, strict=True):
                ghosts.fill(f)

    def smooth_from_zero(self, b: Vector, rates: Sequence[wp.array], spare: Vector, out: Vector) -> None:
        """One sweep for each of `rates`, from zero; b and out with ghosts."""
        at, other = (out, spare) if len(rates) % 2 else (spare, out)
        self.first_sweep(b, rates[0], at)
        self.fill(at)
        self.smooth(b, at, rates[1:], other, out)

    def smooth(self, b: Vector, x: Vector, rates: Sequence[wp.array], spare: Vector, out: Vector) -> None:
        """One sweep for each of `rates`, from x to out; x and `spare` are written over."""
        for n, rate in enumerate(rates, start=1):
            to = out if n == len(rates) else spare
            self.sweep(b, x, rate, to)
            self.fill(to)
            x, spare = to, x


def hierarchy(nx: int, ny: int, size: tuple[float, float]) -> list[tuple[int, int]]:
    """Cells of every grid, from nx by ny down to `COARSEST` cells."""
    grids = [(nx, ny)]
    while grids[-1][0] * grids[-1][1] > COARSEST:
        grids.append(coarser(*grids[-1], size))
    return grids


def coarser(nx: int, ny: int, size: tuple[float, float]) -> tuple[int, int]:
    """Cells of the next coarser grid: each axis halved, but first the one with much finer cells alone.

    Point smoothers damp only what varies along the finer axis when cells are far from square.
    """
    hx, hy = size[0] / nx, size[1] / ny
    halve_x = nx > 1 and (hx < 1.5 * hy or ny == 1)
    halve_y = ny > 1 and (hy < 1.5 * hx or nx == 1)
    return -(-nx // 2) if halve_x else nx, -(-ny // 2) if halve_y else ny
