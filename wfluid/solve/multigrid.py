"""The multigrid hierarchy: its grids, and the interface of a level.

Jacobi sweeps smooth on every level: the same sweeps before and after the correction from the coarser level,
in opposite order. Restriction is the transpose of prolongation. So a V-cycle is a symmetric operator. Any
grid size can be coarsened, n -> ceil(n/2) per axis; where cells are not square, only along the axis with the
shorter sides. W. Briggs, V. Henson, S. McCormick, A Multigrid Tutorial, 2nd ed., chapters 3 and 5.
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
"""Most cells of the coarsest level, which is solved exactly by a stored inverse."""


@dataclass(frozen=True)
class Location:
    """Points of a grid at which one component of the unknowns is given."""

    rules: tuple[Rule, Rule]
    """Boundary rule along x and y, which gives the ghosts."""
    on_faces: tuple[bool, bool] = (False, False)
    """Along x and y: True on faces, at i h; False at centres, at (i + 1/2) h."""


class Level(ABC):
    """One grid of the hierarchy with an operator A on it: work vectors, ghosts, sweeps.

    A subclass implements an equation. Its sweeps are x + rate M^-1 (b - A x), M its diagonal matrix.
    """

    rates: Sequence[wp.array]
    """Damping of the sweeps before the coarse correction, in device memory; after it in opposite order."""
    plain: wp.array
    """Damping of the plain Jacobi sweeps of the scheme "paper"."""

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
        """out = b - A x. Reads the ghosts of x, leaves those of out undefined."""

    @abstractmethod
    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate M^-1 b, the sweep from zero. Leaves the ghosts of out undefined."""

    @abstractmethod
    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate M^-1 (b - A x). Reads the ghosts of x, leaves those of out undefined."""

    def fill(self, x: Vector) -> None:
        """Fill the ghosts of x, and set its faces on walls to 0."""
        with together():
            for f, ghosts in zip(x, self.ghosts, strict=True):
                ghosts.fill(f)

    def smooth_from_zero(self, b: Vector, rates: Sequence[wp.array], spare: Vector, out: Vector) -> None:
        """Sweep once with each of `rates`, from zero. Reads the ghosts of b, fills those of out."""
        x, other = (out, spare) if len(rates) % 2 else (spare, out)
        self.first_sweep(b, rates[0], x)
        self.fill(x)
        self.smooth(b, x, rates[1:], other, out)

    def smooth(self, b: Vector, x: Vector, rates: Sequence[wp.array], spare: Vector, out: Vector) -> None:
        """Sweep once with each of `rates`, from x to out. Overwrites x and `spare`."""
        for n, rate in enumerate(rates, start=1):
            to = out if n == len(rates) else spare
            self.sweep(b, x, rate, to)
            self.fill(to)
            x, spare = to, x


def hierarchy(nx: int, ny: int, size: tuple[float, float]) -> list[tuple[int, int]]:
    """Sizes (nx, ny) of all grids, from nx by ny down to at most `COARSEST` cells."""
    grids = [(nx, ny)]
    while grids[-1][0] * grids[-1][1] > COARSEST:
        grids.append(coarser(*grids[-1], size))
    return grids


def coarser(nx: int, ny: int, size: tuple[float, float]) -> tuple[int, int]:
    """Size (nx, ny) of the next coarser grid: both axes halved, or only the one with far shorter cells.

    Where cells are far from square, a point smoother damps only errors that vary along their shorter side.
    """
    hx, hy = size[0] / nx, size[1] / ny
    halve_x = nx > 1 and (hx < 1.5 * hy or ny == 1)
    halve_y = ny > 1 and (hy < 1.5 * hx or nx == 1)
    return -(-nx // 2) if halve_x else nx, -(-ny // 2) if halve_y else ny
