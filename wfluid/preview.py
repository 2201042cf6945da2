"""The controls drawn on the picture: what the numbers of a command mean, without running it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from wfluid.painted import Freeze, Painted, Quantity
from wfluid.picture import Picture, resample
from wfluid.push import DEFAULT_RADIUS, Push

COLOURS = ((1.0, 0.75, 0.0), (0.0, 0.8, 1.0), (1.0, 0.2, 0.6), (0.4, 1.0, 0.2))
"""One a push, in turn; linear light."""


STIFF, FROZEN = (1.0, 0.35, 0.0), (0.0, 0.35, 1.0)
"""Tints of what viscosity stiffens, by its part of the stiffest, and of what is frozen; linear light."""

_TINT = 0.6


def draw_controls(
    picture: Picture,
    pushes: Iterable[Push],
    viscosity: Quantity | None = None,
    freeze: Freeze | None = None,
    weight: Painted | None = None,
) -> Picture:
    """The picture with each push's arrow and a circle at its radius (one sigma), in colours in turn.

    A painted viscosity and what is frozen are tinted, orange and blue; what an effect mask spares is dark.
    """
    import OpenImageIO as oiio

    height, width, channels = picture.pixels.shape
    colours = picture.pixels[..., :3] if channels >= 3 else np.repeat(picture.pixels[..., :1], 3, axis=2)
    colours = np.clip(colours, 0, 1) * 0.8
    for painted, tint in (
        (viscosity if isinstance(viscosity, Painted) else None, STIFF),
        (freeze.paint if freeze else None, FROZEN),
    ):
        if painted is not None and painted.values.max() > 0:
            part = resample((painted.values / painted.values.max()).astype(np.float32), width, height)
            colours += _TINT * part[..., None] * (np.array(tint, dtype=np.float32) - colours)
    if weight is not None:
        part = resample(np.minimum(weight.values, 1.0).astype(np.float32), width, height)
        colours *= 0.3 + 0.7 * part[..., None]
    image = oiio.ImageBuf(np.ascontiguousarray(colours, dtype=np.float32))
    side = max(width, height)
    thick = max(1, side // 400)

    def line(points, colour) -> None:
        for (x0, y0), (x1, y1) in pairwise(points):
            for shift in range(thick):
                a = (round(x0) + shift, round(y0)), (round(x1) + shift, round(y1))
                b = (round(x0), round(y0) + shift), (round(x1), round(y1) + shift)
                for start, end in (a, b):
                    oiio.ImageBufAlgo.render_line(image, *start, *end, (*colour, 1.0))

    for number, push in enumerate(pushes):
        colour = COLOURS[number % len(COLOURS)]
        radius = push.options.get("radius", DEFAULT_RADIUS * side)
        turn = np.linspace(0, 2 * math.pi, 73)
        line(list(zip(push.x + radius * np.cos(turn), push.y + radius * np.sin(turn), strict=True)), colour)
        tip = (push.x + push.dx, push.y + push.dy)
        line([(push.x, push.y), tip], colour)
        back, wing = math.atan2(-push.dy, -push.dx), max(6.0, 0.02 * side)
        for side_angle in (0.45, -0.45):
            angle = back + side_angle
            line([tip, (tip[0] + wing * math.cos(angle), tip[1] + wing * math.sin(angle))], colour)
    pixels = image.get_pixels(oiio.FLOAT).reshape(height, width, 3)
    return Picture(pixels.astype(np.float32), None, "uint8", None)
