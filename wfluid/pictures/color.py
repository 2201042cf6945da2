"""The sRGB transfer function (IEC 61966-2-1) and the steps from stored numbers to linear light."""

from __future__ import annotations

from functools import cache

import numpy as np

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue (Rec. 709)."""

CODES = {"uint8": 255, "uint16": 65535}
"""Largest code of an integer type."""
_LADDER = 1 << 16


def to_linear(encoded: np.ndarray) -> np.ndarray:
    """Scene-linear values of sRGB-encoded ones; an odd function, so that negative values are kept."""
    size = np.abs(encoded)
    linear = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.copysign(linear, encoded).astype(np.float32)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """The inverse of `to_linear`."""
    size = np.abs(linear)
    encoded = np.where(size <= 0.0031308, size * 12.92, 1.055 * size ** (1 / 2.4) - 0.055)
    return np.copysign(encoded, linear).astype(np.float32)


def decode(stored: np.ndarray, srgb: bool) -> np.ndarray:
    """Stored numbers of any type as float32, integers scaled to 0 … 1, in linear light."""
    top = CODES.get(stored.dtype.name)
    if top is None:
        values = stored.astype(np.float32)
        return to_linear(values) if srgb else values
    return _decoding(stored.dtype.name, srgb)[stored]


def encode(linear: np.ndarray, dtype: str, srgb: bool) -> np.ndarray:
    """Linear light as numbers of `dtype`, rounded to the nearest one within the range of the type."""
    top = CODES.get(dtype)
    if top is None:
        limit = np.finfo(dtype).max
        values = to_srgb(linear) if srgb else linear
        return (np.clip(values, -limit, limit) if dtype == "float16" else values).astype(dtype)
    if dtype == "uint8" and srgb:  # a table over the square root: 4 times faster than the power
        steps = np.sqrt(np.clip(linear, 0.0, 1.0), dtype=np.float32) * np.float32(_LADDER - 1)
        return _srgb_codes()[(steps + np.float32(0.5)).astype(np.uint16)]
    values = np.clip(linear, 0.0, 1.0)
    return np.rint((to_srgb(values) if srgb else values) * np.float64(top)).astype(dtype)


def channels_beside(alpha: int | None, channels: int) -> list[int]:
    """Indices of all channels except alpha."""
    return [channel for channel in range(channels) if channel != alpha]


@cache
def _decoding(dtype: str, srgb: bool) -> np.ndarray:
    values = np.arange(CODES[dtype] + 1, dtype=np.float64) / CODES[dtype]
    return to_linear(values) if srgb else values.astype(np.float32)


@cache
def _srgb_codes() -> np.ndarray:
    linear = (np.arange(_LADDER) / (_LADDER - 1)) ** 2
    return np.rint(to_srgb(linear).astype(np.float64) * 255).astype(np.uint8)


def linear_color(text: str) -> tuple[float, float, float]:
    """Red, green and blue in linear light of a display colour, written "#rrggbb"."""
    codes = np.array([int(text[n : n + 2], 16) for n in (1, 3, 5)], dtype=np.uint8)
    red, green, blue = (float(value) for value in decode(codes, True))
    return red, green, blue
