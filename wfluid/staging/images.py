"""Controls that are picture files: viscosity, freezing, masks, forces, densities, layers.

"self" is the picture that is animated. Any other file is read as numbers, without colour conversion,
and stretched over the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wfluid.model.painted import DEFAULT_STRENGTH, Freeze, Keyed, Painted, Quantity
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture
from wfluid.scene.format import SELF

DEFAULT_VISCOSITY = 0.001
DEFAULT_PAINTED_VISCOSITY = 0.1
"""Viscosity of a white place where nothing says it: over 6 % of the longer side it stops a motion in
1/30 s."""

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
        painting = read_picture(self.folder / name, exact=True)
        aspect = painting.width / painting.height * self.picture.height / self.picture.width
        if abs(aspect - 1) > SAME_ASPECT:
            self.note(
                f"{name}: {painting.width} x {painting.height} pixels stretched over the picture's "
                f"{self.picture.width} x {self.picture.height}"
            )
        return painting

    def paint(self, name: str) -> Picture:
        """The painting; of the picture itself what is below zero, out of a camera's gamut, is no paint."""
        painting = self.read(name)
        return painting.with_pixels(np.maximum(painting.pixels, 0.0)) if name == SELF else painting

    def viscosity(self, table: Mapping[str, Any]) -> Quantity:
        """The viscosity that a scene's table says.

        Raises:
            ValueError: as `read`; a scale outside its range, keys that contradict.
        """
        if "key" in table:
            keys = table["key"]
            if table.keys() & {"value", "image", "floor", "invert"}:
                raise ValueError("viscosity: keys over time go without value, image, floor and invert")
            if len({key["time"] for key in keys}) < len(keys):
                raise ValueError("viscosity: two keys have one time")
            return Keyed({key["time"]: self.viscosity(key) for key in keys})
        if "image" not in table:
            for key in ("floor", "invert", "moves"):
                if table.get(key):
                    raise ValueError(f"viscosity: {key} needs an image")
            return table.get("value", DEFAULT_VISCOSITY)
        name, invert = table["image"], table.get("invert", False)
        scale, floor = table.get("value", DEFAULT_PAINTED_VISCOSITY), table.get("floor", 0.0)
        painted = named(name, lambda: Painted(self.paint(name), scale, invert, floor))
        if painted.values.max() == 0:
            shade = "white" if invert else "black"
            self.note(f"{name}: {shade} all over, so the viscosity is 0 everywhere: an inviscid fluid")
        return painted

    def mask(self, name: str | None) -> Painted | None:
        """An effect mask, white where forces act.

        Raises:
            ValueError: as `read`; a mask that is black all over.
        """
        if name is None:
            return None
        painted = named(name, lambda: Painted(self.paint(name)))
        if painted.values.max() == 0:
            raise ValueError(f"{name}: black all over, so no force would act; paint white what should move")
        return painted

    def freeze(self, table: Mapping[str, Any] | None) -> Freeze | None:
        """The freezing that a scene's table says.

        Raises:
            ValueError: as `read`; a strength outside its range, a mask that leaves nothing to move.
        """
        if not table:
            return None
        name, strength = table["mask"], table.get("strength", DEFAULT_STRENGTH)
        frozen = named(name, lambda: Freeze(self.paint(name), strength))
        if frozen.paint.values.max() == 0:
            self.note(f"{name}: black all over, so nothing is frozen")
        return frozen

    def amount(self, name: str, scale: float) -> Painted:
        """A density that a picture paints; `scale` is that of its white.

        Raises:
            ValueError: as `read`.
        """
        return named(name, lambda: Painted(self.paint(name), scale))

    def layer(self, name: str, data: bool | None) -> Picture:
        """A further picture; one of a single channel is data where nothing says otherwise.

        Raises:
            PictureError: it cannot be read.
        """
        picture = read_picture(self.folder / name)
        channels = picture.pixels.shape[2] - (picture.alpha is not None)
        data = channels == 1 if data is None else data
        return read_picture(self.folder / name, "data") if data else picture


def named(name: str, make: Callable):
    """What `make` makes; where it refuses, the file is named.

    Raises:
        ValueError: as `make`, with the file's name.
    """
    try:
        return make()
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(name) or name in text else f"{name}: {text}") from error
