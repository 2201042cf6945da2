"""ICC profiles of grey and RGB pictures: a curve a channel, then a matrix (ICC.1:2010, sections 8 and 10).

>>> from wfluid.pictures.profiles import Curve
>>> round(Curve(gamma=2.0).decode(0.5).item(), 3)
0.25
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from wfluid.pictures import color

SRGB_COLORANTS = np.array(
    [
        [0.4360747, 0.3850649, 0.1430804],
        [0.2225045, 0.7168786, 0.0606169],
        [0.0139322, 0.0971045, 0.7141733],
    ]
)
"""XYZ of the red, green and blue of sRGB (IEC 61966-2-1), one a column, adapted to D50 (Bradford)."""

ALIKE = 2e-3
"""Largest difference of matrices and curves from those of sRGB at which a profile counts as sRGB."""

_CURVE_LENGTHS = (1, 3, 4, 5, 7)
"""How many parameters each type of a parametric curve has (table 65)."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Light of stored values, 0 … 1: (a x + b)^gamma + e from d on, c x + f below it, or a table.

    Values beyond 0 are continued as an odd function, so that negative values are kept.
    """

    gamma: float = 1.0
    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 0.0
    f: float = 0.0
    table: np.ndarray | None = None
    """Light at evenly spaced stored values, increasing; it replaces the formula."""

    def decode(self, stored: np.ndarray) -> np.ndarray:
        """Light of stored values."""
        x = np.abs(np.asarray(stored, dtype=np.float64))
        if self.table is not None:
            light = np.interp(x, _places(self.table), self.table)
        else:
            power = np.maximum(self.a * x + self.b, 0.0) ** self.gamma + self.e
            light = np.where(x >= self.d, power, self.c * x + self.f)
        return np.copysign(light, stored)

    def encode(self, light: np.ndarray) -> np.ndarray:
        """The inverse of `decode`."""
        y = np.abs(np.asarray(light, dtype=np.float64))
        if self.table is not None:
            stored = np.interp(y, self.table, _places(self.table))
        else:
            stored = (np.maximum(y - self.e, 0.0) ** (1 / self.gamma) - self.b) / self.a
            if self.d > 0:
                below = (y - self.f) / self.c if self.c else np.zeros_like(y)
                stored = np.where(y >= self.decode(np.array(self.d)), stored, below)
        return np.copysign(np.maximum(stored, 0.0), light)


def _places(table: np.ndarray) -> np.ndarray:
    """The stored values of a table's entries."""
    return np.linspace(0.0, 1.0, len(table))


@dataclass(frozen=True, eq=False)
class Profile:
    """A colour space of stored numbers, as a way to linear light with the primaries of Rec. 709."""

    curves: tuple[Curve, ...]
    """A curve for each colour: one or three."""
    matrix: np.ndarray
    """(1, 1) or (3, 3): Rec. 709 colours of the profile's in linear light."""

    @property
    def is_srgb(self) -> bool:
        """Whether the profile is sRGB's, to rounding."""
        codes = np.arange(256) / 255
        curve = max(np.abs(one.decode(codes) - color.to_linear(codes)).max() for one in self.curves)
        return curve < ALIKE and np.abs(self.matrix - np.eye(len(self.matrix))).max() < ALIKE

    def decode(self, stored: np.ndarray) -> np.ndarray:
        """Linear light (…, colours) of stored numbers, in which 1 is the largest integer."""
        light = [curve.decode(stored[..., n]) for n, curve in enumerate(self.curves)]
        return (np.stack(light, axis=-1) @ self.matrix.T).astype(np.float32)

    def encode(self, linear: np.ndarray) -> np.ndarray:
        """The inverse of `decode`; colours beyond the profile's gamut are clipped to it."""
        light = np.clip(linear @ np.linalg.inv(self.matrix).T, 0.0, 1.0)
        stored = [curve.encode(light[..., n]) for n, curve in enumerate(self.curves)]
        return np.stack(stored, axis=-1).astype(np.float32)


def read_profile(data: bytes, colors: int) -> Profile:
    """The profile of a picture with that many colours, one or three.

    Raises:
        ValueError: a profile that is malformed, of other colours, or of tables alone.
    """
    try:
        return _parsed(data, colors)
    except (struct.error, IndexError, OverflowError, ZeroDivisionError, np.linalg.LinAlgError) as error:
        raise ValueError("is malformed") from error


def _parsed(data: bytes, colors: int) -> Profile:
    if len(data) < 132 or data[36:40] != b"acsp":
        raise ValueError("is malformed")
    kind = data[16:20].decode("latin-1").strip()
    if kind != {1: "GRAY", 3: "RGB"}.get(colors):
        raise ValueError(f"is for {kind or 'unknown'} colours, not for the picture's {colors}")
    (count,) = struct.unpack_from(">I", data, 128)
    if 132 + 12 * count > len(data):
        raise ValueError("is malformed")
    tags = {}
    for n in range(count):
        name, start, size = struct.unpack_from(">4sII", data, 132 + 12 * n)
        if start + size > len(data):
            raise ValueError("is malformed")
        tags[name] = data[start : start + size]
    names = [b"kTRC"] if colors == 1 else [b"rTRC", b"gTRC", b"bTRC"]
    colorants = [] if colors == 1 else [b"rXYZ", b"gXYZ", b"bXYZ"]
    if not tags.keys() >= {*names, *colorants}:
        raise ValueError("has no curves and matrix")
    curves = tuple(_curve(tags[name]) for name in names)
    if colors == 1:
        return Profile(curves, np.eye(1))
    matrix = np.linalg.solve(SRGB_COLORANTS, np.stack([_xyz(tags[name]) for name in colorants], axis=1))
    if not np.linalg.cond(matrix) < 1e4:
        raise ValueError("is malformed")
    return Profile(curves, matrix)


def _xyz(tag: bytes) -> np.ndarray:
    """A colour of the type XYZ (section 10.31)."""
    if tag[:4] != b"XYZ ":
        raise ValueError("is malformed")
    return np.array(struct.unpack_from(">3i", tag, 8)) / 65536


def _curve(tag: bytes) -> Curve:
    """A curve (section 10.6), or a parametric curve (section 10.18)."""
    if tag[:4] == b"curv":
        (count,) = struct.unpack_from(">I", tag, 8)
        if count == 0:
            return Curve()
        if 12 + 2 * count > len(tag):
            raise ValueError("is malformed")
        values = np.frombuffer(tag, ">u2", count=count, offset=12).astype(np.float64)
        if count == 1:
            return _checked(Curve(gamma=float(values[0]) / 256))
        table: np.ndarray = values / 65535
        if table[-1] <= table[0] or np.any(np.diff(table) < 0):
            raise ValueError("has a curve that does not increase")
        return Curve(table=table)
    if tag[:4] != b"para":
        raise ValueError("is malformed")
    (kind,) = struct.unpack_from(">H", tag, 8)
    gamma, *rest = (value / 65536 for value in struct.unpack_from(f">{_CURVE_LENGTHS[kind]}i", tag, 12))
    if kind == 0:
        return _checked(Curve(gamma))
    if kind in (1, 2):  # a, b[, c]: the constant c is added above and below
        a, b, constant = (*rest, 0.0)[:3]
        return _checked(Curve(gamma, a, b, d=max(0.0, -b / a), e=constant, f=constant))
    return _checked(Curve(gamma, *rest))


def _checked(curve: Curve) -> Curve:
    """The curve, if it increases from 0 to 1.

    Raises:
        ValueError: otherwise.
    """
    if not (curve.gamma > 0 and curve.a > 0 and curve.c >= 0):
        raise ValueError("is malformed")
    if not (np.all(np.diff(curve.decode(np.arange(65) / 64)) >= 0)):
        raise ValueError("has a curve that does not increase")
    return curve
