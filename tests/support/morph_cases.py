"""Pairs of pictures with known pictures in between, and their morphs, each searched for once."""

from dataclasses import replace
from functools import cache

import numpy as np

from wfluid import Fluid, Picture, morph

SIDE, HEIGHT = 240, 160
"""Pixels of the pictures with dots."""

POINTS = (((0.3, 0.25), (0.38, 0.3)), ((0.7, 0.3), (0.64, 0.24)), ((0.5, 0.45), (0.5, 0.52)))
"""Corresponding points of both pictures."""

SHIFT = (8, -6)
"""Pixels by which the periodic picture of 64 x 48 is shifted."""

ANGLE = np.radians(20)
"""Angle by which the round picture of 128 x 128 is turned."""


def dots(points, spread=2.0, width=SIDE, height=HEIGHT):
    """A black picture with a white dot of a few pixels at each place."""
    x, y = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    squares = [(x - width * a) ** 2 + (y - width * b) ** 2 for a, b in points]
    values = sum(np.exp(-0.5 * square / spread**2) for square in squares)
    return Picture(np.repeat(values[..., None], 3, axis=2).astype(np.float32))


def centroid(picture, near, reach=12):
    """Centroid of the light around a place [px]."""
    values = picture.pixels[..., 0].astype(np.float64)
    x, y = np.arange(values.shape[1]) + 0.5, (np.arange(values.shape[0]) + 0.5)[:, None]
    side = max(values.shape)
    values = np.where(np.hypot(x - side * near[0], y - side * near[1]) < reach, values, 0)
    return np.array([(values * x).sum(), (values * y).sum()]) / values.sum()


def waves(shift=(0, 0)):
    """A periodic picture: waves of at most 4 periods along either axis, 0.5 +- 0.17, shifted by pixels."""
    rng = np.random.default_rng(0)
    x, y = (np.arange(64) + 0.5 - shift[0]) / 64, ((np.arange(48) + 0.5 - shift[1]) / 48)[:, None]
    values = np.full((48, 64, 3), 0.5)
    for channel in range(3):
        for _ in range(6):
            a, b = rng.integers(-4, 5, 2)
            values[..., channel] += 0.1 * np.cos(2 * np.pi * (a * x + b * y) + rng.uniform(0, 2 * np.pi))
    return Picture(values.astype(np.float32))


def round_picture(angle=0.0):
    """Stripes of 13 px under a wide Gaussian, turned clockwise about the middle; grey by the border."""
    x = (np.arange(128) + 0.5) / 128 - 0.5
    y, c, s = x[:, None], np.cos(angle), np.sin(angle)
    across, down = c * x + s * y, c * y - s * x
    weight = 0.5 * np.exp(-0.5 * (across**2 + down**2) / 0.12**2)
    stripes = np.cos(60 * across), np.sin(50 * across - 25 * down), np.cos(60 * down + 1)
    return Picture(np.stack([0.5 + weight * one for one in stripes], axis=2).astype(np.float32))


def rotated(point, angle):
    """A place turned clockwise about the middle of the square."""
    x, y = point[0] - 0.5, point[1] - 0.5
    c, s = np.cos(angle), np.sin(angle)
    return 0.5 + c * x - s * y, 0.5 + s * x + c * y


RING = [(0.5 + 0.16 * np.cos(a), 0.5 + 0.16 * np.sin(a)) for a in np.pi / 2 * np.arange(4) + 0.3]
"""Points of the turned picture."""

LINEAR = {"warp_curve": "linear", "blend_curve": "linear"}


@cache
def searched(name, device):
    """The morph of a case."""
    if name == "dots":
        a, b = (dots([pair[n] for pair in POINTS]) for n in (0, 1))
        return morph(a, b, POINTS, 0.5, 12, cells=48, device=device, **LINEAR)
    if name == "shift":
        moved = (SHIFT[0] / 64, SHIFT[1] / 64)
        points = [(p, (p[0] + moved[0], p[1] + moved[1])) for p in ((0.3, 0.2), (0.7, 0.55))]
        fluid = Fluid(viscosity=10.0, walls="periodic")
        return morph(
            waves(),
            waves(SHIFT),
            points,
            1.0,
            4,
            fluid=fluid,
            cells=32,
            tolerance=1e-4,
            device=device,
            **LINEAR,
        )
    points = [(point, rotated(point, ANGLE)) for point in RING]
    return morph(round_picture(), round_picture(ANGLE), points, 1.0, 4, cells=40, device=device, **LINEAR)


def going(found, **changes):
    """A morph on the same flow with other settings."""
    return replace(found, settings=replace(found.settings, **changes))


def of_pictures(found, a, b):
    """A morph of other pictures of the same sizes on the same flow."""
    match = replace(found.match, animation=replace(found.match.animation, picture=a))
    return replace(found, match=match, pair=replace(found.pair, a=a, b=b))


def psnr(got, wanted):
    """Peak signal-to-noise ratio of pixels 0 … 1 [dB]."""
    return -10 * np.log10(np.mean((np.asarray(got, np.float64) - wanted) ** 2) + 1e-30)
