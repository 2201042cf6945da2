"""Controls given as pictures: viscosity, freezing, masks, forces, densities, layers.

"self" is the animated picture. Any other file is read as numbers, without colour conversion, and stretched
over the picture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wfluid.domain.limits import PAINTED_VISCOSITY, VISCOSITY
from wfluid.model.painted import Freeze, Keyed, Painted, Quantity
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture
from wfluid.scene.forces import Point
from wfluid.scene.format import SELF, FreezeTable, ViscosityKeyTable, ViscosityTable
from wfluid.scene.schema import SchemaError, blame

SAME_ASPECT = 0.01
"""Largest relative difference of two aspects that count as equal."""


def frame_size(size: Point | None, table: str, picture: Picture) -> tuple[float, float]:
    """Width and height of the frame that a table's pixels refer to: its `size`, or the picture's.

    Raises:
        SchemaError: a size that is not positive, or has another aspect than the picture.
    """
    width, height = size or (picture.width, picture.height)
    if min(width, height) <= 0:
        raise SchemaError((table, "size"), f"{width:g} x {height:g}: expected positive numbers")
    if abs(width / height * picture.height / picture.width - 1) > SAME_ASPECT:
        raise SchemaError(
            (table, "size"),
            f"{width:g} x {height:g} has another aspect than the picture, "
            f"{picture.width} x {picture.height}: give the size of the frame that the pixels refer to",
        )
    return width, height


def read_noted(
    folder: Path, name: str, note: Callable[[str], None], colorspace: str = "auto", *, exact: bool = False
) -> Picture:
    """A picture, as by `read_picture`, with a note for each thing to know of how it was read."""
    picture = read_picture(folder / name, colorspace, exact=exact)
    for text in picture.notes:
        note(f"{name}: {text}")
    return picture


@dataclass
class SceneImages:
    """Reads the controls of one picture, and notes anything unusual about them."""

    picture: Picture
    """The animated picture."""
    folder: Path = Path()
    """The folder that file names are relative to."""
    note: Callable[[str], None] = field(default=lambda text: None)
    """Called with a warning for the user, one line."""

    def read(self, name: str) -> Picture:
        """The picture in a file; the animated one for "self".

        Raises:
            PictureError: the file cannot be read, or has values that are not finite.
        """
        if name == SELF:
            return self.picture
        painting = read_noted(self.folder, name, self.note, exact=True)
        aspect = painting.width / painting.height * self.picture.height / self.picture.width
        if abs(aspect - 1) > SAME_ASPECT:
            self.note(
                f"{name}: {painting.width} x {painting.height} pixels stretched over the picture's "
                f"{self.picture.width} x {self.picture.height}"
            )
        return painting

    def paint(self, name: str) -> Picture:
        """As `read`; negative values of the animated picture, outside a camera's gamut, become 0."""
        painting = self.read(name)
        return painting.with_pixels(np.maximum(painting.pixels, 0.0)) if name == SELF else painting

    def viscosity(self, viscosity: ViscosityTable, default: float = VISCOSITY) -> Quantity:
        """The viscosity of a scene's table; `default` where it has neither value, image nor keys.

        Raises:
            ValueError: as `read`; a scale outside its range, keys that exclude each other.
        """
        keys = viscosity.keys
        if keys:
            if viscosity.gives("value", "image", "floor", "invert"):
                raise ValueError("viscosity: keys over time exclude value, image, floor and invert")
            if len({key.time for key in keys}) < len(keys):
                raise ValueError("viscosity: two keys have one time")
            return Keyed({key.time: self._viscosity_at(key) for key in keys})
        if viscosity.image is None:
            for name in ("floor", "invert", "moves"):
                if getattr(viscosity, name):
                    raise ValueError(f"viscosity: {name} needs an image")
            return default if viscosity.value is None else viscosity.value
        scale = PAINTED_VISCOSITY if viscosity.value is None else viscosity.value
        return self._painted_viscosity(viscosity.image, scale, viscosity.invert, viscosity.floor)

    def _viscosity_at(self, key: ViscosityKeyTable) -> float | Painted:
        return key.value if key.image is None else self._painted_viscosity(key.image, key.value, False, 0.0)

    def _painted_viscosity(self, name: str, scale: float, invert: bool, floor: float) -> Painted:
        with blame(file=name):
            painted = Painted(self.paint(name), scale, invert, floor)
        if painted.values.max() == 0:
            shade = "white" if invert else "black"
            self.note(f"{name}: {shade} everywhere, so the viscosity is 0 everywhere")
        return painted

    def mask(self, name: str) -> Painted:
        """An effect mask, white where forces act.

        Raises:
            ValueError: as `read`; a mask that is black everywhere.
        """
        painted = self.painted(name)
        if painted.values.max() == 0:
            raise ValueError(f"{name}: black everywhere, so no force acts; paint the moving parts white")
        return painted

    def freeze(self, freeze: FreezeTable) -> Freeze:
        """The frozen parts of a scene.

        Raises:
            ValueError: as `read`; a strength outside its range, a mask that freezes everything.
        """
        with blame(file=freeze.mask):
            frozen = Freeze(self.paint(freeze.mask), freeze.strength)
        if frozen.paint.values.max() == 0:
            self.note(f"{freeze.mask}: black everywhere, so nothing is frozen")
        return frozen

    def painted(self, name: str, scale: float = 1.0) -> Painted:
        """A control painted by a picture; `scale` is the value of white.

        Raises:
            ValueError: as `read`.
        """
        with blame(file=name):
            return Painted(self.paint(name), scale)

    def layer(self, name: str, data: bool | None) -> Picture:
        """The picture of a layer; `data` is by default true for a single channel.

        Raises:
            PictureError: the file cannot be read.
        """
        picture = read_noted(self.folder, name, self.note)
        channels = picture.pixels.shape[2] - (picture.alpha is not None)
        data = channels == 1 if data is None else data
        return read_picture(self.folder / name, "data") if data else picture
