"""Controls that a command line names as picture files: viscosity, freezing, effect masks, forces.

"self" is the picture that is animated. Any other file is read as numbers, without colour conversion,
and stretched over the picture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from wfluid.image_force import DEFAULT_RADIUS, KINDS, ImageForce
from wfluid.painted import DEFAULT_STRENGTH, Freeze, Painted, Quantity
from wfluid.picture import Picture, read_picture
from wfluid.push import course, parse_options

SELF = "self"

DEFAULT_VISCOSITY = 0.001
DEFAULT_PAINTED_VISCOSITY = 0.1
"""Viscosity of a white place where --viscosity does not say it: over 6 % of the longer side it stops a
motion in 1/30 s."""

DEFAULT_LENGTH = 0.02
"""How far a painted force carries its strongest place where it does not say it [longer side]."""

FORCE_KEYS = ("kind", "strength", "radius", "period", "phase", "start", "end", "at")

_SAME_ASPECT = 0.01


@dataclass
class Paintings:
    """Reads paintings for one picture, and notes what a user should know of them."""

    picture: Picture
    """What is animated."""
    note: Callable[[str], None] = field(default=lambda text: None)
    """Called with a line of text."""

    def read(self, name: str) -> Picture:
        """The painting in a file, or the picture itself.

        Raises:
            PictureError: it cannot be read, or has values that are not finite.
        """
        if name == SELF:
            return self.picture
        painting = read_picture(name, exact=True)
        aspect = painting.width / painting.height * self.picture.height / self.picture.width
        if abs(aspect - 1) > _SAME_ASPECT:
            self.note(
                f"{name}: {painting.width} x {painting.height} pixels stretched over the picture's "
                f"{self.picture.width} x {self.picture.height}"
            )
        return painting

    def _paint(self, name: str) -> Picture:
        """The painting; of the picture itself what is below zero, out of a camera's gamut, is no paint."""
        painting = self.read(name)
        return painting.with_pixels(np.maximum(painting.pixels, 0.0)) if name == SELF else painting

    def viscosity(self, name: str | None, scale: float | None, floor: float, invert: bool) -> Quantity:
        """The viscosity of --viscosity-image, --viscosity, --viscosity-floor and --invert-viscosity.

        Raises:
            ValueError: as `read`; a scale outside its range.
        """
        if name is None:
            return DEFAULT_VISCOSITY if scale is None else scale
        scale = DEFAULT_PAINTED_VISCOSITY if scale is None else scale
        painted = _named(name, lambda: Painted(self._paint(name), scale, invert, floor))
        if painted.values.max() == 0:
            shade = "white" if invert else "black"
            self.note(f"{name}: {shade} all over, so the viscosity is 0 everywhere: an inviscid fluid")
        return painted

    def weight(self, name: str | None) -> Painted | None:
        """The effect mask, white where forces act.

        Raises:
            ValueError: as `read`; a mask that is black all over.
        """
        if name is None:
            return None
        painted = _named(name, lambda: Painted(self._paint(name)))
        if painted.values.max() == 0:
            raise ValueError(f"{name}: black all over, so no force would act; paint white what should move")
        return painted

    def freeze(self, text: str | None) -> Freeze | None:
        """The freezing of --freeze MASK[:strength].

        Raises:
            ValueError: as `read`; a strength outside its range, a mask that leaves nothing to move.
        """
        if text is None:
            return None
        name, strength = _split_number(text)
        frozen = _named(name, lambda: Freeze(self._paint(name), strength))
        if frozen.paint.values.max() == 0:
            self.note(f"{name}: black all over, so nothing is frozen")
        return frozen

    def force(self, text: str, duration: float, scheme: str, weight: Painted | None) -> ImageForce:
        """The force of --force-image FILE[:key=value,…]; its strength is a length in pixels.

        Raises:
            ValueError: as `read`; an unknown key or kind, a window outside the animation.
        """
        what = f"force-image {text!r}"
        name, given = _split_options(what, text)
        kind = given.get("kind", "gradient")
        if kind not in KINDS:
            raise ValueError(f"{what}: kind {kind!r}: expected one of {', '.join(KINDS)}")
        side = max(self.picture.width, self.picture.height)
        envelope, per_length = course(what, given, duration, scheme)
        length = given.get("strength", DEFAULT_LENGTH * side) / side
        radius = given.get("radius", DEFAULT_RADIUS * side) / side
        force = _named(
            name,
            lambda: ImageForce(
                (self.read if kind == "vectors" else self._paint)(name),
                kind,
                length * per_length,
                envelope,
                weight,
                radius,
            ),
        )
        if kind == "gradient" and weight is None:
            self.note(
                f"{name}: the pressure balances a gradient wholly, so alone it moves nothing; "
                "use kind=contour, or give it an --effect-mask"
            )
        return force


def files_of(viscosity: str | None, weight: str | None, freeze: str | None, forces: list[str]) -> list[str]:
    """The files that these options name."""
    named = [viscosity, weight, freeze and _split_number(freeze)[0]]
    named += [_split_options(f"force-image {text!r}", text)[0] for text in forces]
    return [name for name in named if name not in (None, SELF)]


def _split_number(text: str) -> tuple[str, float]:
    """MASK:strength, or a MASK whose name may have colons."""
    name, colon, number = text.rpartition(":")
    try:
        return (name, float(number)) if colon else (text, DEFAULT_STRENGTH)
    except ValueError:
        return text, DEFAULT_STRENGTH


def _split_options(what: str, text: str) -> tuple[str, dict]:
    name, colon, options = text.rpartition(":")
    if not colon or "=" not in options:
        return text, {}
    return name, parse_options(what, options, FORCE_KEYS, words=("kind",))


def _named(name: str, make: Callable):
    """What `make` makes; where it refuses, the file is named."""
    try:
        return make()
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(name) else f"{name}: {text}") from error
