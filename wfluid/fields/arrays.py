"""Arrays on a device: made, written, read. No other file asks Warp for memory or writes to it.

All that does holds `LAUNCHES`, so that no capture takes it in that another thread has begun.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.kernels.cell.layout import HALO, Layout
from wfluid.kernels.cell.lock import exclusive
from wfluid.kernels.cell.real import Real

Vector = tuple[wp.array, ...]
"""One field a component: (q,) of a scalar, (u, v) of a velocity."""


@exclusive
def zeros(size: int, device: wp.Device, dtype: Any = Real, gradient: bool = False) -> wp.array:
    """A new array of zeros, with a gradient if one is wanted."""
    return wp.zeros(size, dtype=dtype, device=device, requires_grad=gradient)


@exclusive
def upload(values: np.ndarray, device: wp.Device, dtype: Any = Real) -> wp.array:
    """A new array with values from the host."""
    return wp.array(values, dtype=dtype, device=device)


@exclusive
def clone(f: wp.array) -> wp.array:
    """A new array with the values of another, without its gradient."""
    return wp.clone(f, requires_grad=False)


def view(f: wp.array) -> wp.array:
    """Another array of the same memory, which may have another gradient."""
    return f[:] if f.size else zeros(0, f.device, f.dtype)


@exclusive
def copy(f: wp.array, out: wp.array) -> None:
    """out = f, both of one size."""
    if f.size:
        wp.copy(out, f)


@exclusive
def assign(values: np.ndarray, out: wp.array) -> None:
    """Write values from the host into an array of their size."""
    out.assign(values)


@exclusive
def fill(value: float, *arrays: wp.array) -> None:
    """Write one value into all entries of arrays."""
    for f in arrays:
        f.zero_() if value == 0 else f.fill_(value)  # a loop in a graph fills far slower than it zeroes


def entries(array: wp.array, part: slice = slice(None)) -> list[wp.array]:
    """Each entry of a part of an array as an array of one, which shares its memory."""
    return [array[n : n + 1] for n in range(*part.indices(array.size))]


class Scalars:
    """Numbers in device memory by name, so that a captured graph follows them when they change.

    Each name is an attribute: an array of one.
    """

    def __init__(self, device: wp.Device, *names: str, **values: float):
        """`names` are 0 at first; `values` are numbers with their first value."""
        self._names = (*names, *values)
        self._array = upload(np.array([*(0.0 for _ in names), *values.values()]), device)
        self.__dict__.update(zip(self._names, entries(self._array), strict=True))

    def __getattr__(self, name: str) -> wp.array:
        raise AttributeError(f"no number {name!r}: there are {', '.join(self._names)}")

    def set(self, **values: float) -> None:
        """Give every number its value."""
        assign(np.array([values[name] for name in self._names]), self._array)


def field(layout: Layout, device: wp.Device) -> wp.array:
    """A new field of zeros."""
    return zeros(layout.size, device)


def vector(layout: Layout, device: wp.Device, components: int) -> Vector:
    """New fields of zeros, one a component."""
    return tuple(field(layout, device) for _ in range(components))


def lookup_args(grid: Grid, walls: Walls, layout: Layout) -> list[int]:
    """Arguments of the kernels that interpolate: nx, ny, whether each axis is periodic, and the pitch."""
    periodic_x, periodic_y = walls.periodic
    return [grid.nx, grid.ny, int(periodic_x), int(periodic_y), layout.pitch]


def interior(values: np.ndarray, layout: Layout, beyond: tuple[int, int] = (0, 0)) -> np.ndarray:
    """The cells of a field's values (size, …) without its ghosts: a view (ny, nx, …).

    With `beyond` it has so many rows and columns of ghosts after the last cell.
    """
    rows = layout.size // layout.pitch
    padded = values[: rows * layout.pitch].reshape(rows, layout.pitch, *values.shape[1:])
    return padded[HALO : HALO + layout.ny + beyond[0], HALO : HALO + layout.nx + beyond[1]]


def to_numpy(f: wp.array, layout: Layout, beyond: tuple[int, int] = (0, 0)) -> np.ndarray:
    """The values of a field as a (ny + beyond[0], nx + beyond[1]) array: a copy without the halo."""
    return interior(read(f), layout, beyond).copy()


@exclusive
def read(f: wp.array) -> np.ndarray:
    """The values of an array; on a CPU a view."""
    return f.numpy()


def from_numpy(values: np.ndarray, f: wp.array, layout: Layout) -> None:
    """Write an array of at most (ny + 2, nx + 2) values into a field, from row 0, column 0 on."""
    padded = read(f).copy()
    rows, columns = values.shape
    interior(padded, layout, (rows - layout.ny, columns - layout.nx))[:] = values
    assign(padded, f)


def finite(arrays: Iterable[wp.array]) -> bool:
    """Whether every entry of some arrays is finite."""
    return all(np.all(np.isfinite(read(f))) for f in arrays)
