"""Reasons why a drawn force moves little or nothing: walls, masks, frozen parts."""

from __future__ import annotations

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.paths import Path, Place
from wfluid.domain.walls import Wall, Walls
from wfluid.model.force import Force, LocalForce
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Freeze
from wfluid.model.stroke import Stroke
from wfluid.model.uniform_forces import Wind

STILLNESS_CELLS = 96
"""Cells along the longer side on which masks are looked at."""

LITTLE = 0.02
"""Part of a force that counts as nothing."""

AT_THE_WALL = 0.5
"""Distance from a wall within which a force acts on the wall, in radii."""

FROZEN = 0.5
"""Value of a freeze mask from which a place hardly moves."""


def why_still(force: Force, walls: Walls, frozen: Freeze | None, grid: Grid) -> str:
    """The reason and the remedy, in words that follow the name of a force; "" for a force that moves.

    Remedies name flags of `wfluid animate`; `grid` covers the picture.
    """
    shape = _footprint(force, grid)
    weight = np.ones_like(shape) if force.weight is None else force.weight.sample(grid)
    acting = shape * weight
    if acting.sum() <= LITTLE * shape.sum() and (isinstance(force, LocalForce) or weight.max() <= LITTLE):
        return "its mask is black where it acts, so that it hardly moves anything; paint it white there"
    if frozen is not None and acting[frozen.paint.sample(grid) < FROZEN].sum() <= LITTLE * acting.sum():
        return (
            "the picture is frozen where it acts, so it hardly moves anything; leave the mask of --freeze "
            "black there"
        )
    if isinstance(force, Wind):
        return _why_no_wind(force, walls, grid)
    if isinstance(force, GaussianForce | Stroke):
        return _why_against_walls(force, walls, (grid.width, grid.height))
    return ""


def _footprint(force: Force, grid: Grid) -> np.ndarray:
    """Where a force acts, over the cells of a grid (ny, nx); everywhere if it is not local."""
    shape = np.zeros((grid.ny, grid.nx))
    if not isinstance(force, LocalForce):
        return shape + 1
    x, y = (np.arange(grid.nx) + 0.5) * grid.hx, (np.arange(grid.ny)[:, None] + 0.5) * grid.hy
    sigma = max(force.radius, grid.hx, grid.hy)
    for at in _places(force):
        shape += np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2 * sigma**2))
    return shape


def _places(force: Force) -> list[Place]:
    """The centre of a force, or places along its path; none for a centre that is a function."""
    center = getattr(force, "path", None) or getattr(force, "center", None)
    if isinstance(center, Path):
        return [center.at(t) for t in np.linspace(center.times[0], center.times[-1], 33)]
    return [center] if isinstance(center, tuple) else []


def _why_no_wind(wind: Wind, walls: Walls, grid: Grid) -> str:
    """Between closed walls the pressure balances a wind that has no edge across its direction."""
    fields = np.array(wind.fields(grid, walls))
    f_x, f_y = np.tensordot(wind.vector, fields, 1)
    left = np.hypot(*_without_gradient(f_x, f_y, walls, grid)).max()
    if left > LITTLE * np.hypot(*np.tensordot(wind.vector, np.abs(fields), 1)).max():
        return ""
    return (
        "the walls hold it back: between closed walls the pressure balances a wind that fills the picture "
        "from side to side, so nothing moves; use --walls=periodic, a smaller mask, or a push instead"
    )


def _without_gradient(f_x: np.ndarray, f_y: np.ndarray, walls: Walls, grid: Grid) -> tuple:
    """A field on faces, (ny, nx) each, less the gradient that makes it free of divergence."""
    across = _differences(grid.nx, grid.hx, walls.periodic[0])
    down = _differences(grid.ny, grid.hy, walls.periodic[1])
    (along_x, x), (along_y, y) = (np.linalg.eigh(g.T @ g) for g in (across, down))
    waves = along_y[:, None] + along_x
    waves[waves < 1e-9 * waves.max()] = np.inf
    outward = f_x @ across + down.T @ f_y
    potential = y @ ((y.T @ outward @ x) / waves) @ x.T
    return f_x - potential @ across.T, f_y - down @ potential


def _differences(n: int, h: float, periodic: bool) -> np.ndarray:
    """The differences of neighbouring cells on the faces before them, a matrix (n, n); 0 on a closed wall."""
    matrix = (np.eye(n) - np.eye(n, k=-1)) / h
    matrix[0] = 0.0
    if periodic:
        matrix[0, 0], matrix[0, -1] = 1 / h, -1 / h
    return matrix


def _why_against_walls(force: GaussianForce | Stroke, walls: Walls, extent: tuple[float, float]) -> str:
    """A force on a wall that points into it or, where the fluid sticks to it, along it."""
    places = _places(force)
    if not places:
        return ""
    if isinstance(force, Stroke):
        way = np.ptp(np.array(places), axis=0)
    else:
        way = np.abs(force.vector)
    for axis, wall in enumerate((walls.x, walls.y)):
        near = all(min(at[axis], extent[axis] - at[axis]) <= AT_THE_WALL * force.radius for at in places)
        if wall is Wall.PERIODIC or not near:
            continue
        if wall is Wall.NO_SLIP:
            return "it acts on a no-slip wall, where the picture stays; use --walls=free-slip"
        if way[1 - axis] <= 0.25 * way[axis]:
            return "it pushes against a wall, which the picture cannot leave or pass; draw it farther inside"
    return ""
