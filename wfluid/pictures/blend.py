"""Blends of two pictures."""

from __future__ import annotations

import numpy as np

from wfluid.domain.limits import BLEND_SPACES
from wfluid.pictures import color
from wfluid.pictures.picture import Picture


def check_light(light: str) -> None:
    """Check the name of a space to blend in.

    Raises:
        ValueError: an unknown name; the message lists the known ones.
    """
    if light not in BLEND_SPACES:
        raise ValueError(f"blend in {light!r} light: expected one of {', '.join(BLEND_SPACES)}")


def blended(a: Picture, b: Picture, weight: float | np.ndarray, light: str = "linear") -> Picture:
    """(1 - weight) a + weight b, for pictures of one size; the weight is a number or (height, width), 0 … 1.

    `light` is the space to blend in: "linear" light, or "display" values (sRGB), which data pictures do not
    have. A weight of 0 or 1 everywhere returns one of the two pictures without rounding.
    """
    weight = np.asarray(weight, dtype=np.float32)
    if not weight.any() or np.all(weight == 1):
        return a.with_pixels(b.pixels) if weight.all() else a
    weight = weight[..., None]
    if light == "linear" or a.data:
        return a.with_pixels(_mixed(a.pixels, b.pixels, weight))
    shown = _mixed(_displayed(a.pixels, a.alpha), _displayed(b.pixels, a.alpha), weight)
    return a.with_pixels(_displayed(shown, a.alpha, color.to_linear))


def _mixed(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return (1 - weight) * a + weight * b


def _displayed(pixels: np.ndarray, alpha: int | None, transfer=color.to_srgb) -> np.ndarray:
    """Premultiplied values after a transfer function, which is applied to values divided by alpha."""
    if alpha is None:
        return transfer(pixels)
    opacity = pixels[..., [alpha]]
    straight = np.divide(pixels, opacity, out=np.zeros_like(pixels), where=opacity > 0)
    shown = transfer(straight) * opacity
    shown[..., [alpha]] = opacity
    return shown
