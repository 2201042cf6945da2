"""Forces from a picture: along the gradient or the contours of its intensity, or vectors in its channels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.envelopes import Constant, Envelope
from wfluid.domain.grid import Grid
from wfluid.domain.limits import IMAGE_BLUR, IMAGE_FORCES
from wfluid.domain.operators import before, blurred, mean_with_before
from wfluid.domain.showing import short_repr
from wfluid.domain.walls import Walls
from wfluid.model.force import FORCE_LIMIT, FieldForce, on_faces
from wfluid.model.painted import Painted, values_of
from wfluid.pictures.picture import PictureLike, as_stored, picture_of, resample

_FLAT = 1e-5
"""Range of intensities below which the gradient is rounding."""


@dataclass(frozen=True, eq=False)
class ImageForce(FieldForce):
    """A force field from a picture, times an envelope (Bonilla & Velho, section III).

    - "gradient" pushes towards brighter places.
    - "contour" pushes along lines of equal intensity, with the brighter side to the right.
    - "vectors" reads the first two channels as the force along x (right) and y (down).

    The first two are normalised: their maximum, where the blurred picture is steepest, is `strength`. The
    pressure of an incompressible fluid balances any gradient field completely, so that "gradient" moves
    nothing without a non-uniform `weight`. "contour" is free of divergence and acts in full.

    Raises:
        ValueError: an unknown kind, a value that is not finite, a strength beyond 1e4 longer sides/s^2, a
            constant picture, or "vectors" of a picture with one channel.
    """

    picture: PictureLike
    """A picture, as anything that `Picture.of` takes; or an array (height, width) of intensities, of floats
    (height, width, 2) of vectors."""
    kind: str = "gradient"
    """"gradient", "contour" or "vectors"."""
    strength: float = 1.0
    """Acceleration [longer side/s^2] where the picture is steepest, or of vectors of length 1; with
    `Instantaneous`, the velocity gained."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""
    radius: float = IMAGE_BLUR
    """Sigma of the blur before the gradient is taken [longer side]; 0 for no blur."""
    _values: np.ndarray = field(init=False, repr=False)
    """Intensities (height, width), or vectors (height, width, 2)."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        self._settle()
        check_word("ImageForce: kind", self.kind, IMAGE_FORCES)
        if not abs(self.strength) <= FORCE_LIMIT:
            raise ValueError(f"ImageForce: strength {self.strength}: expected at most {FORCE_LIMIT:g}")
        if not (math.isfinite(self.radius) and self.radius >= 0):
            raise ValueError(f"ImageForce: radius {self.radius}: expected 0 or more")
        if self.kind != "vectors":
            values = values_of("ImageForce.picture", self.picture)
            values = Painted(values).values
            if np.ptp(values) == 0:
                raise ValueError("ImageForce: the picture is the same everywhere, so it has no slopes")
        else:
            values = vectors_of(self.picture)
        object.__setattr__(self, "_values", values)

    @property
    def reach(self) -> float:
        """Upper bound of the acceleration [longer side/s^2]."""
        longest = np.linalg.norm(self._values, axis=2).max() if self.kind == "vectors" else 1.0
        return abs(self.strength) * float(longest)

    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """One field: the acceleration on the faces.

        Raises:
            ValueError: the picture is constant after averaging and blurring.
        """
        if self.kind == "vectors":
            centres = resample(self._values.astype(np.float32), grid.nx, grid.ny).astype(np.float64)
            force = [mean_with_before(centres[..., n], 1 - n, walls.periodic[n]) for n in (0, 1)]
        else:
            values = resample(self._values.astype(np.float32), grid.nx, grid.ny).astype(np.float64)
            values = blurred(values, grid, self.radius, walls.periodic)
            if np.ptp(values) < _FLAT:
                raise ValueError(
                    "ImageForce: the picture has no slopes left after the blur; use a smaller radius"
                )
            force = _slopes(values, grid, self.kind, walls.periodic)
            steepest = float(np.hypot(*force).max())
            force = [f / steepest for f in force]
        return [on_faces([self.strength * f for f in force], self.weight, grid, walls)]


def vectors_of(picture: PictureLike) -> np.ndarray:
    """Vectors (height, width, 2) from a picture or an array.

    Arrays and float files are used unchanged. In integer files code 128 of 8 bits, or 32768 of 16 bits, is 0,
    and the smallest and largest codes are about -1 and 1.

    Raises:
        ValueError: fewer than two channels, or values that are not finite.
    """
    if not isinstance(picture, np.ndarray) or picture.dtype.kind == "u":
        picture = picture_of("ImageForce.picture", picture)
        values, alpha = as_stored(picture), picture.alpha
        channels = picture.color_channels[:2]
        if len(channels) < 2:
            raise ValueError(
                f"a picture of vectors has {len(channels)} colour channels: it needs two channels"
            )
        opacity = 1.0 if alpha is None else values[..., [alpha]]
        values = values[..., channels]
        codes = {"uint8": 255, "uint16": 65535}.get(picture.dtype)
        if codes:
            values = (values * codes - (codes + 1) / 2) / ((codes - 1) / 2)
        values = values * opacity
    else:
        values = np.asarray(picture, dtype=np.float64)
        if values.ndim != 3 or values.shape[2] < 2:
            raise ValueError(f"vectors of shape {values.shape}: expected (height, width, 2)")
    if not np.isfinite(values[..., :2]).all():
        raise ValueError("vectors that are not finite: expected finite numbers")
    return values[..., :2]


def _slopes(values: np.ndarray, grid: Grid, kind: str, periodic: tuple[bool, bool]) -> list[np.ndarray]:
    """The gradient on faces, or the gradient turned by 90 degrees: (d/dy, -d/dx) of means at nodes."""
    if kind == "gradient":
        before_x, before_y = (before(values, axis, periodic[1 - axis]) for axis in (1, 0))
        return [(values - before_x) / grid.hx, (values - before_y) / grid.hy]
    padded = values
    for axis, wraps in ((0, periodic[1]), (1, periodic[0])):
        width = [(1, 1) if axis == n else (0, 0) for n in (0, 1)]
        padded = np.pad(padded, width, mode="wrap" if wraps else "edge")
    nodes = (padded[1:, 1:] + padded[1:, :-1] + padded[:-1, 1:] + padded[:-1, :-1]) / 4
    return [np.diff(nodes, axis=0)[:, :-1] / grid.hy, -np.diff(nodes, axis=1)[:-1] / grid.hx]
