"""Densities seen over a picture: ink that colours, smoke that covers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wfluid.density import Density
from wfluid.picture import Picture, resample

DARKEST = 1e-3
"""Least part of the light that ink of density 1 lets through: a colour of 0 would let none through any."""


def show_densities(picture: Picture, densities: Sequence[Density], values: Sequence[np.ndarray]) -> Picture:
    """The picture with densities (ny, nx) over it, in linear light, in their order.

    Ink multiplies the picture by color^rho. Smoke covers it with its colour by 1 - exp(-rho), where it is
    transparent too. Negative densities are none.
    """
    pixels = picture.pixels
    for density, rho in zip(densities, values, strict=True):
        if rho.max() <= 0:
            continue
        amount = resample(rho.astype(np.float32), picture.width, picture.height, filter="bspline")
        amount = np.maximum(amount, 0.0)
        pixels = pixels.copy() if pixels is picture.pixels else pixels
        colours = [channel for channel in range(pixels.shape[2]) if channel != picture.alpha][:3]
        color = density.color if len(colours) == 3 else [sum(density.color) / 3] * len(colours)
        if density.look == "ink":
            for channel, value in zip(colours, color, strict=True):
                pixels[..., channel] *= np.exp(amount * np.log(max(value, DARKEST)), dtype=np.float32)
        else:
            through = np.exp(-amount)
            for channel, value in zip(colours, color, strict=True):
                pixels[..., channel] = pixels[..., channel] * through + value * (1 - through)
            if picture.alpha is not None:
                pixels[..., picture.alpha] = pixels[..., picture.alpha] * through + (1 - through)
    return picture.with_pixels(pixels)
