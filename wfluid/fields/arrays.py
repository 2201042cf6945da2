"""Arrays on a device: functions that make, write and read them. No other file allocates or writes arrays.

These functions hold the lock `LAUNCHES`, so that the capture of another thread does not record their work.
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
"""One field per component: (q,) for a scalar, (u, v) for a velocity."""


@exclusive
def zeros(size: int, device: wp.Device, dtype: Any = Real, gradient: bool = False) -> wp.array:
    """A new array of zeros, of `size` entries; with `gradient` it has an array of gradients too."""
    return wp.zeros(size, dtype=dtype, device=device, requires_grad=gradient)


@exclusive
def upload(values: np.ndarray, device: wp.Device, dtype: Any = Real) -> wp.array:
    """A new array with the values of a host array."""
    return wp.array(values, dtype=dtype, device=device)


def upload_rows(values: np.ndarray, device: wp.Device, dtype: Any = Real) -> list[wp.array]:
    """The rows of a host array (rows, n) as arrays of n elements: parts of one, for speed."""
    count, n = values.shape
    together = upload(values.ravel(), device, dtype)
    return [together[row * n : (row + 1) * n] for row in range(count)]


@exclusive
def clone(f: wp.array) -> wp.array:
    """A new array with the values of f, without its gradient."""
    return wp.clone(f, requires_grad=False)


def view(f: wp.array) -> wp.array:
    """Another array over the memory of f, which may have another gradient."""
    return f[:] if f.size else zeros(0, f.device, f.dtype)


@exclusive
def copy(f: wp.array, out: wp.array) -> None:
    """out = f; both have the same size."""
    if f.size:
        wp.copy(out, f)


@exclusive
def assign(values: np.ndarray, out: wp.array) -> None:
    """Write the values of a host array into an array of the same size."""
    out.assign(values)


@exclusive
def fill(value: float, *arrays: wp.array) -> None:
    """Set all entries of some arrays to one value."""
    for f in arrays:
        f.zero_() if value == 0 else f.fill_(value)  # a loop in a graph fills far slower than it zeroes


def entries(array: wp.array, part: slice = slice(None)) -> list[wp.array]:
    """The entries of a part of an array, each as an array of one element over the same memory."""
    return [array[n : n + 1] for n in range(*part.indices(array.size))]


class Scalars:
    """Named numbers in device memory, which a captured graph reads at each replay.

    Each name is an attribute: an array of one element.
    """

    def __init__(self, device: wp.Device, *names: str, **values: float):
        """Numbers called `names`, which begin as 0, and numbers with their initial `values`."""
        self._names = (*names, *values)
        self._array = upload(np.array([*(0.0 for _ in names), *values.values()]), device)
        self.__dict__.update(zip(self._names, entries(self._array), strict=True))

    def __getattr__(self, name: str) -> wp.array:
        raise AttributeError(f"no number {name!r}: there are {', '.join(self._names)}")

    def set(self, **values: float) -> None:
        """Set all numbers; `values` has every name."""
        assign(np.array([values[name] for name in self._names]), self._array)


def field(layout: Layout, device: wp.Device) -> wp.array:
    """A new field of zeros: `layout.size` elements."""
    return zeros(layout.size, device)


def vector(layout: Layout, device: wp.Device, components: int) -> Vector:
    """New fields of zeros, one per component."""
    return tuple(field(layout, device) for _ in range(components))


def lookup_args(grid: Grid, walls: Walls, layout: Layout) -> list[int]:
    """Arguments of the kernels that interpolate: nx, ny, whether each axis is periodic, and the pitch."""
    periodic_x, periodic_y = walls.periodic
    return [grid.nx, grid.ny, int(periodic_x), int(periodic_y), layout.pitch]


def interior(values: np.ndarray, layout: Layout, beyond: tuple[int, int] = (0, 0)) -> np.ndarray:
    """The cells of a field, a host array (size, …), without ghosts: a view (ny, nx, …).

    `beyond` is the number of rows and of columns of ghosts after the last cell that it includes.
    """
    rows = layout.size // layout.pitch
    padded = values[: rows * layout.pitch].reshape(rows, layout.pitch, *values.shape[1:])
    return padded[HALO : HALO + layout.ny + beyond[0], HALO : HALO + layout.nx + beyond[1]]


def to_numpy(f: wp.array, layout: Layout, beyond: tuple[int, int] = (0, 0)) -> np.ndarray:
    """The cells of a field, as in `interior`: a copy (ny + beyond[0], nx + beyond[1])."""
    return interior(read(f), layout, beyond).copy()


@exclusive
def read(f: wp.array) -> np.ndarray:
    """The values of an array on the host; of a CPU array a view."""
    return f.numpy()


def from_numpy(values: np.ndarray, f: wp.array, layout: Layout) -> None:
    """Write a host array of at most (ny + 2, nx + 2) values into a field, from row 0 and column 0 on."""
    padded = read(f).copy()
    rows, columns = values.shape
    interior(padded, layout, (rows - layout.ny, columns - layout.nx))[:] = values
    assign(padded, f)


def finite(arrays: Iterable[wp.array]) -> bool:
    """Whether every entry of some arrays is finite."""
    return all(np.all(np.isfinite(read(f))) for f in arrays)
