"""Densities composited over a picture: ink colours it, smoke covers it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from wfluid.model.densities import Density
from wfluid.pictures.picture import Picture

DARKEST = 1e-3
"""Least transmission of ink of density 1: with 0 even the thinnest ink would be opaque."""


def upsample(
    values: np.ndarray, width: int, height: int, periodic: tuple[bool, bool] = (False, False)
) -> np.ndarray:
    """Values at centres (ny, nx), interpolated to pixels (height, width) by cubic B-splines.

    The result stays within the range of the values.
    """
    rows, columns = values.shape
    down, across = _splines(rows, height, periodic[1]), _splines(columns, width, periodic[0])
    return down @ values.astype(np.float32) @ across.T


@lru_cache(maxsize=8)
def _splines(cells: int, pixels: int, periodic: bool) -> np.ndarray:
    """Weights (pixels, cells) of a uniform cubic B-spline along one axis."""
    position = (np.arange(pixels) + 0.5) * (cells / pixels) - 0.5
    before = np.floor(position).astype(int)
    t = position - before
    weights = [(1 - t) ** 3 / 6, 2 / 3 - t**2 + t**3 / 2, 0.0, t**3 / 6]
    weights[2] = 1 - weights[0] - weights[1] - weights[3]
    matrix = np.zeros((pixels, cells), dtype=np.float32)
    for n, weight in enumerate(weights, start=-1):
        place = before + n
        place = place % cells if periodic else np.clip(place, 0, cells - 1)
        np.add.at(matrix, (np.arange(pixels), place), weight)
    return matrix


def composite_densities(
    picture: Picture,
    densities: Sequence[Density],
    values: Sequence[np.ndarray],
    periodic: tuple[bool, bool] = (False, False),
) -> Picture:
    """The picture with densities (ny, nx) over it, in linear light, in their order.

    Ink multiplies the picture by color^rho. Smoke has the opacity 1 - exp(-rho), over transparent
    pixels too. Negative densities count as 0.
    """
    pixels = picture.pixels
    for density, rho in zip(densities, values, strict=True):
        if rho.max() <= 0:
            continue
        amount = upsample(np.maximum(rho, 0.0), picture.width, picture.height, periodic)
        pixels = pixels.copy() if pixels is picture.pixels else pixels
        colours = picture.color_channels[:3]
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
