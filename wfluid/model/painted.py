"""Quantities that vary over the picture and in time, such as viscosity and drag.

A painted quantity is the intensity of a picture times a scale (Bonilla & Velho, section III). The intensity,
0 … 1, is relative to the range of the file's number type, not to the darkest and brightest values. Paintings
of any size cover the picture and are averaged onto the cells of the grid.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.limits import DRAG, DRAG_LIMIT, VISCOSITY_LIMIT
from wfluid.domain.piecewise import interval
from wfluid.domain.showing import short_repr
from wfluid.pictures.picture import Picture, PictureLike, intensity, picture_of, resample


@dataclass(frozen=True, eq=False)
class Painted:
    """A quantity painted over the picture: floor + (scale - floor) times the intensity of a picture or array.

    Raises:
        ValueError: a value that is negative or not finite, an array that is not two-dimensional,
            `invert` with values above 1, or a floor above the scale.
    """

    picture: PictureLike
    """A picture, of which the intensity 0 … 1 is used, as anything that `Picture.of` takes; or an array
    (height, width) of values from 0 on. Arrays of uint8 or uint16, or with channels, are pictures."""
    scale: float = 1.0
    """Value of intensity 1."""
    invert: bool = False
    """Whether the intensity is replaced by 1 - intensity, so that dark places have large values."""
    floor: float = 0.0
    """Value of intensity 0."""
    values: np.ndarray = field(init=False, repr=False)
    """The painted values, (height, width) of the painting."""

    def __post_init__(self) -> None:
        values = values_of("Painted.picture", self.picture)
        if values.ndim != 2 or not values.size:
            raise ValueError(f"painted values of shape {values.shape}: expected (height, width)")
        _finite_from_zero("painted values", values)
        for name in ("scale", "floor"):
            _finite_from_zero(name, np.asarray(getattr(self, name)))
        if self.invert and values.max() > 1:
            raise ValueError(f"painted values up to {values.max():g} cannot be inverted: expected 0 … 1")
        shown = 1.0 - values if self.invert else values
        object.__setattr__(self, "values", self.floor + (self.scale - self.floor) * shown)
        if self.floor > self.scale:
            raise ValueError(f"floor {self.floor:g} is above scale {self.scale:g}")

    def __repr__(self) -> str:
        height, width = self.values.shape
        return f"Painted({width} x {height}, {self.values.min():.3g} … {self.values.max():.3g})"

    def sample(self, grid: Grid) -> np.ndarray:
        """Means over the cells of a grid, (ny, nx)."""
        return _on_grid(self, grid)

    def resampled(self, width: int, height: int) -> np.ndarray:
        """Means over the pixels of another size, (height, width)."""
        if self.values.shape == (height, width):
            return self.values.astype(np.float64)
        values = resample(self.values.astype(np.float32), width, height)
        return np.clip(values.astype(np.float64), self.values.min(), self.values.max())


@dataclass(frozen=True, eq=False)
class Keyed:
    """A quantity given at some times, interpolated linearly and constant before and after.

    Raises:
        ValueError: no keys, a time that is not finite, or a value out of range.
        TypeError: a value that is no quantity.
    """

    keys: Mapping[float, float | np.ndarray | Painted]
    """Values by time [s]."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not self.keys or not all(math.isfinite(t) for t in self.keys):
            raise ValueError("Keyed: expected values at one finite time or more")
        keys = {t: as_quantity("keyed value", value) for t, value in sorted(self.keys.items())}
        object.__setattr__(self, "keys", keys)

    def at(self, t: float, grid: Grid) -> np.ndarray | float:
        """The value at time t [s]: a number, or (ny, nx) for the cells of a grid."""
        times = list(self.keys)
        n, m, s = interval(times, t)
        start, end = (sample_at(self.keys[times[key]], grid, t) for key in (n, m))
        return start + (end - start) * s if m > n else start


Quantity = float | Painted | Keyed | Callable[[float], object]
"""A viscosity: a number, a painting, keys over time, or a function of the time."""


@dataclass(frozen=True, eq=False)
class Freeze:
    """A mask that holds parts of the picture in place by drag.

    The drag is (1 + strength)^m - 1 for mask values m of 0 … 1: it is 0 for m = 0 and grows exponentially, so
    that a soft edge of the mask is a soft transition of the motion.

    Raises:
        ValueError: a strength outside 0 … 1e6, mask values outside 0 … 1, or a mask that freezes the entire
            picture.
    """

    mask: PictureLike
    """Picture or array (height, width), as `Painted` takes: white (1) is held in place, black (0) is free."""
    strength: float = DRAG
    """Drag of white [1/s]."""
    paint: Painted = field(init=False, repr=False)
    """The mask values, 0 … 1."""

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= DRAG_LIMIT:
            raise ValueError(f"freeze strength {self.strength}: expected 0 … {DRAG_LIMIT:g}")
        object.__setattr__(self, "paint", as_painted("Freeze.mask", self.mask))
        least, most = self.paint.values.min(), self.paint.values.max()
        if most > 1:
            raise ValueError(f"freeze mask with values up to {most:g}: expected 0 … 1")
        if least > 0.99 and self.strength > 0:
            raise ValueError(
                "the freeze mask is painted all over, so nothing could move: leave what should move black"
            )

    def __repr__(self) -> str:
        height, width = self.paint.values.shape
        return f"Freeze({width} x {height}, strength={self.strength:g})"

    def sample(self, grid: Grid) -> np.ndarray:
        """Drag of the cells of a grid [1/s], (ny, nx)."""
        return np.expm1(self.paint.sample(grid) * math.log1p(self.strength))


def values_of(name: str, picture: PictureLike) -> np.ndarray:
    """The intensity of a picture, or the values of an array that is none, (height, width) in float64.

    Raises:
        TypeError: neither; `name` is what the message calls it.
        PictureError: a picture without an intensity.
    """
    if is_picture(picture):
        return intensity(picture_of(name, picture))
    return np.asarray(picture, dtype=np.float64)


def is_picture(what: object) -> bool:
    """Whether something is taken as a picture; the other arrays, of floats or integers, are plain values."""
    if not isinstance(what, np.ndarray | list | tuple):
        return True
    return isinstance(what, np.ndarray) and (what.dtype in (np.uint8, np.uint16) or what.ndim > 2)


def as_painted(name: str, what: Painted | PictureLike) -> Painted:
    """A quantity over the picture: pictures and arrays become `Painted`.

    Raises:
        TypeError: something else; `name` is what the message calls it.
        ValueError: as `Painted`.
    """
    if isinstance(what, Painted):
        return what
    return Painted(picture_of(name, what) if is_picture(what) else what)


def as_weight(name: str, weight: Painted | PictureLike | None) -> Painted | None:
    """As `as_painted`; None, which is 1 everywhere, is kept."""
    return None if weight is None else as_painted(name, weight)


def as_quantity(name: str, what: object) -> Quantity:
    """A quantity from a user's value: arrays become `Painted`, numbers are checked.

    Raises:
        ValueError: a number outside 0 … 1000, or painted values that are negative or not finite.
        TypeError: a value that is no quantity; the message lists the possible types.
    """
    if isinstance(what, Painted | Keyed) or callable(what):
        return what
    if isinstance(what, np.ndarray) and what.ndim and what.dtype not in (np.uint8, np.uint16):
        if what.ndim != 2 or not what.size:
            raise ValueError(f"{name} of shape {what.shape}: expected (height, width)")
        return Painted(what)
    if isinstance(what, Picture | os.PathLike) or (isinstance(what, np.ndarray) and what.ndim):
        raise TypeError(f"{name}: a picture needs a scale: Painted(picture, scale=…)")
    if not isinstance(what, int | float | np.number | np.ndarray):
        raise TypeError(f"{name}: expected a number, an array, Painted, Keyed or a function of the time")
    if not 0 <= what <= VISCOSITY_LIMIT:
        raise ValueError(f"{name} {what}: expected 0 … {VISCOSITY_LIMIT:g}")
    return float(what)


def sample_at(what: Quantity | np.ndarray, grid: Grid, t: float) -> np.ndarray | float:
    """A quantity at time t [s]: a number, or (ny, nx) for the cells of a grid.

    Raises:
        ValueError: a function of the time returned a value out of range.
        TypeError: a function of the time returned a value that is no quantity.
    """
    if isinstance(what, float):
        return what
    if isinstance(what, Painted):
        return what.sample(grid)
    if isinstance(what, Keyed):
        return what.at(t, grid)
    given = what(t) if callable(what) else what
    return sample_at(as_quantity(f"viscosity at {t:g} s", given), grid, t)


def check_painted(viscosity: np.ndarray | float) -> None:
    """Check viscosities against `VISCOSITY_LIMIT` [longer side^2/s].

    Raises:
        ValueError: a larger one, or NaN; the message states the limit.
    """
    if not np.max(viscosity) <= VISCOSITY_LIMIT:
        raise ValueError(f"viscosity up to {np.max(viscosity):g}: expected 0 … {VISCOSITY_LIMIT:g}")


@lru_cache(maxsize=16)
def _on_grid(painted: Painted, grid: Grid) -> np.ndarray:
    return painted.resampled(grid.nx, grid.ny)


def _finite_from_zero(name: str, values: np.ndarray) -> None:
    wrong = ~np.isfinite(values) | (values < 0)
    if wrong.any():
        raise ValueError(f"{name} with {values[wrong].flat[0]}: expected finite numbers from 0 on")
