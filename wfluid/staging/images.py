"""Controls that are picture files: viscosity, freezing, masks, forces, densities, layers.

"self" is the picture that is animated. Any other file is read as numbers, without colour conversion,
and stretched over the picture.
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
from wfluid.scene.format import SELF, FreezeTable, ViscosityKeyTable, ViscosityTable
from wfluid.scene.schema import blame

SAME_ASPECT = 0.01
"""How much aspects may differ that count as one."""


@dataclass
class SceneImages:
    """Reads paintings for one picture, and notes what a user should know of them."""

    picture: Picture
    """What is animated."""
    folder: Path = Path()
    """Where the names of files begin."""
    note: Callable[[str], None] = field(default=lambda text: None)
    """Called with a line of text."""

    def read(self, name: str) -> Picture:
        """The painting in a file, or the picture itself.

        Raises:
            PictureError: it cannot be read, or has values that are not finite.
        """
        if name == SELF:
            return self.picture
        painting = self._noted(name, read_picture(self.folder / name, exact=True))
        aspect = painting.width / painting.height * self.picture.height / self.picture.width
        if abs(aspect - 1) > SAME_ASPECT:
            self.note(
                f"{name}: {painting.width} x {painting.height} pixels stretched over the picture's "
                f"{self.picture.width} x {self.picture.height}"
            )
        return painting

    def _noted(self, name: str, picture: Picture) -> Picture:
        for text in picture.notes:
            self.note(f"{name}: {text}")
        return picture

    def paint(self, name: str) -> Picture:
        """The painting; of the picture itself what is below zero, out of a camera's gamut, is no paint."""
        painting = self.read(name)
        return painting.with_pixels(np.maximum(painting.pixels, 0.0)) if name == SELF else painting

    def viscosity(self, viscosity: ViscosityTable, otherwise: float = VISCOSITY) -> Quantity:
        """The viscosity that a scene's table says; `otherwise` is that of a table which says nothing.

        Raises:
            ValueError: as `read`; a scale outside its range, keys that contradict.
        """
        keys = viscosity.keys
        if keys:
            if viscosity.gives("value", "image", "floor", "invert"):
                raise ValueError("viscosity: keys over time go without value, image, floor and invert")
            if len({key.time for key in keys}) < len(keys):
                raise ValueError("viscosity: two keys have one time")
            return Keyed({key.time: self._viscosity_at(key) for key in keys})
        if viscosity.image is None:
            for name in ("floor", "invert", "moves"):
                if getattr(viscosity, name):
                    raise ValueError(f"viscosity: {name} needs an image")
            return otherwise if viscosity.value is None else viscosity.value
        scale = PAINTED_VISCOSITY if viscosity.value is None else viscosity.value
        return self._painted_viscosity(viscosity.image, scale, viscosity.invert, viscosity.floor)

    def _viscosity_at(self, key: ViscosityKeyTable) -> Quantity:
        return key.value if key.image is None else self._painted_viscosity(key.image, key.value, False, 0.0)

    def _painted_viscosity(self, name: str, scale: float, invert: bool, floor: float) -> Painted:
        with blame(file=name):
            painted = Painted(self.paint(name), scale, invert, floor)
        if painted.values.max() == 0:
            shade = "white" if invert else "black"
            self.note(f"{name}: {shade} all over, so the viscosity is 0 everywhere: an inviscid fluid")
        return painted

    def mask(self, name: str) -> Painted:
        """An effect mask, white where forces act.

        Raises:
            ValueError: as `read`; a mask that is black all over.
        """
        painted = self.painted(name)
        if painted.values.max() == 0:
            raise ValueError(f"{name}: black all over, so no force would act; paint white what should move")
        return painted

    def freeze(self, freeze: FreezeTable) -> Freeze:
        """The freezing that a scene's table says.

        Raises:
            ValueError: as `read`; a strength outside its range, a mask that leaves nothing to move.
        """
        with blame(file=freeze.mask):
            frozen = Freeze(self.paint(freeze.mask), freeze.strength)
        if frozen.paint.values.max() == 0:
            self.note(f"{freeze.mask}: black all over, so nothing is frozen")
        return frozen

    def painted(self, name: str, scale: float = 1.0) -> Painted:
        """What a picture paints; `scale` is what its white stands for.

        Raises:
            ValueError: as `read`.
        """
        with blame(file=name):
            return Painted(self.paint(name), scale)

    def layer(self, name: str, data: bool | None) -> Picture:
        """A further picture; one of a single channel is data where nothing says otherwise.

        Raises:
            PictureError: it cannot be read.
        """
        picture = self._noted(name, read_picture(self.folder / name))
        channels = picture.pixels.shape[2] - (picture.alpha is not None)
        data = channels == 1 if data is None else data
        return read_picture(self.folder / name, "data") if data else picture
