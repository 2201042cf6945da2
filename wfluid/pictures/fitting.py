"""What of a picture a file holds: its channels by their meaning, its type, its colour space, its window."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wfluid.pictures import color
from wfluid.pictures.formats import CHANNELS as COUNTS
from wfluid.pictures.formats import LINEAR, NUMPY, POSITIVE, PROFILES, WINDOWS, WRITES, Encoding
from wfluid.pictures.pairing import Window, cropped
from wfluid.pictures.picture import Picture
from wfluid.pictures.profiles import Profile

Color = tuple[float, float, float]
"""Red, green and blue in linear light."""


@dataclass(frozen=True)
class Fit:
    """How the numbers of a picture are stored in a file."""

    dtype: str
    """Number type of the file."""
    channels: tuple[int | None, ...]
    """The picture's channel that each of the file's is; None is 0 all over."""
    alpha: int | None
    """Index of alpha among the file's channels."""
    profile: Profile | None
    """Colour space of the file's numbers, where it is not the type's."""
    window: Window | None
    """The part of the picture that the file shows; None for all of it."""
    background: Color | None
    """Colour behind the picture where the file has no alpha, in linear light."""
    notes: tuple[str, ...] = ()
    """What the file does not hold, which a user should know."""
    positive: bool = False
    """Whether negative values become 0."""


def fit(path: Path, picture: Picture, encoding: Encoding) -> Fit:
    """How a picture is stored in a still of the format that `path` names.

    Raises:
        PictureError: an unknown format, or a setting that it does not support.
    """
    encoding.check(path)
    ending = path.suffix.lower()
    own = picture.dtype if picture.dtype in WRITES[ending] else WRITES[ending][0]
    dtype = encoding.type or own
    linear = dtype in LINEAR
    alpha = picture.alpha
    channels: tuple[int | None, ...]
    if ending not in COUNTS:
        channels, kept = tuple(range(picture.pixels.shape[2])), alpha
    else:
        channels, kept = _fitted(color_channels(picture), alpha, COUNTS[ending])
    profile = picture.profile
    colors = len(channels) - (kept is not None)
    if linear or picture.data or ending not in PROFILES or profile is None or len(profile.curves) != colors:
        profile = None
    window = None if ending in WINDOWS else display_window(picture)
    background = encoding.background if alpha is not None and kept is None and not picture.data else None
    notes = _notes(path, picture, channels, window)
    if picture.data and not linear and picture.pixels.max() > 1:
        highest = f"{picture.pixels.max():.6g}"
        notes += (f"{path}: numbers up to {highest} are cut off at 1; .exr and .tif hold them as float",)
    return Fit(dtype, channels, kept, profile, window, background, notes, ending in POSITIVE)


def stored(picture: Picture, fit: Fit) -> np.ndarray:
    """The numbers (height, width, channels) of a file, clamped to the range of their type.

    In linear files colours are premultiplied; in the others they are divided by alpha first. A channel that
    the file does not hold is dropped; without alpha the picture is over the background, by default black.
    """
    if fit.window is not None:
        picture = cropped(picture, fit.window)
    pixels = picture.pixels
    if fit.background is not None and picture.alpha is not None:
        pixels = _over(pixels, picture.alpha, fit.channels, fit.background)
    else:
        pixels = _chosen(pixels, fit.channels)
    if fit.positive:
        pixels = np.maximum(pixels, 0.0)
    dtype, linear = NUMPY[fit.dtype], fit.dtype in LINEAR
    srgb = not linear and not picture.data
    if linear or fit.alpha is None:
        numbers = _encoded(pixels, dtype, srgb, fit.profile)
    else:
        opacity = pixels[..., [fit.alpha]]
        straight = np.divide(pixels, opacity, out=np.zeros_like(pixels), where=opacity > 0)
        numbers = _encoded(straight, dtype, srgb, fit.profile, fit.alpha)
    if fit.alpha is not None:
        numbers[..., fit.alpha] = color.encode(pixels[..., fit.alpha], dtype, srgb=False)
    return numbers


def display_rgb(picture: Picture, background: Color | None = None) -> np.ndarray:
    """A picture as 8-bit sRGB (height, width, 3), its display window, over a colour where it is transparent.

    The colour is in linear light, and black by default. Grey is repeated.
    """
    channels, _ = _fitted(color_channels(picture), picture.alpha, (1, 3))
    behind = background if picture.alpha is not None and not picture.data else None
    numbers = stored(picture, Fit("uint8", channels, None, None, display_window(picture), behind))
    if numbers.shape[2] < 3:
        numbers = np.repeat(numbers, 3, axis=2)
    return np.ascontiguousarray(numbers)


def display_notes(path: Path, picture: Picture) -> tuple[str, ...]:
    """What a GIF or a movie at `path` does not hold of a picture, which a user should know."""
    return _notes(path, picture, color_channels(picture), display_window(picture))


def color_channels(picture: Picture) -> tuple[int | None, ...]:
    """The channels of a picture that are red, green and blue, or grey; None is a colour that is not there.

    The names of the channels tell them, such as "R" or "diffuse.R"; otherwise the first one or three.
    """
    others = picture.color_channels
    names = getattr(picture.metadata, "channelnames", ())
    if len(names) == picture.pixels.shape[2]:
        last = {names[n].rpartition(".")[2].lower(): n for n in reversed(others)}
        red, green, blue = (last.get(short, last.get(long)) for short, long in _COLOR_NAMES)
        if red is not None and green is not None:
            return red, green, blue
        if "y" in last:
            return (last["y"],)
    if len(others) == 2:
        return others[0], others[1], None
    return tuple(others[:3] if len(others) >= 3 else others[:1])


_COLOR_NAMES = (("r", "red"), ("g", "green"), ("b", "blue"))


def display_window(picture: Picture) -> Window | None:
    """The display window of the picture's file, in the picture's pixels; None where it is the whole picture.

    It is scaled with the picture. A picture of another aspect than the file's has none.
    """
    spec = picture.metadata
    if spec is None or not spec.width or not spec.height:
        return None
    if (spec.x, spec.y, spec.width, spec.height) == (
        spec.full_x,
        spec.full_y,
        spec.full_width,
        spec.full_height,
    ):
        return None
    if abs(picture.width * spec.height - picture.height * spec.width) > max(spec.width, spec.height):
        return None
    across, down = picture.width / spec.width, picture.height / spec.height
    return Window(
        round((spec.full_x - spec.x) * across),
        round((spec.full_y - spec.y) * down),
        max(1, round(spec.full_width * across)),
        max(1, round(spec.full_height * down)),
    )


def _fitted(
    colors: tuple[int | None, ...], alpha: int | None, counts: tuple[int, ...]
) -> tuple[tuple[int | None, ...], int | None]:
    """The channels of a file that holds one of some counts of channels, and the index of alpha among them.

    Grey is repeated where a format has colours only.
    """
    grey = len(colors) == 1
    if alpha is not None:
        for one in (colors, colors * 3) if grey else (colors,):
            if len(one) + 1 in counts:
                return (*one, alpha), len(one)
    return (colors * 3 if grey and 1 not in counts else colors), None


def _chosen(pixels: np.ndarray, channels: tuple[int | None, ...]) -> np.ndarray:
    """The channels of a file."""
    count = len(channels)
    if channels == tuple(range(count)):
        return pixels[..., :count]
    chosen = np.zeros((*pixels.shape[:2], count), dtype=pixels.dtype)
    for n, channel in enumerate(channels):
        if channel is not None:
            chosen[..., n] = pixels[..., channel]
    return chosen


def _over(pixels: np.ndarray, alpha: int, channels: tuple[int | None, ...], background: Color) -> np.ndarray:
    """The colours of a file over a background, which is grey for a grey file."""
    behind = np.asarray(background, dtype=np.float32)
    if len(channels) == 1:
        behind = behind @ np.asarray(color.LUMINANCE, dtype=np.float32)
    opacity = np.clip(pixels[..., [alpha]], 0.0, 1.0)
    return _chosen(pixels, channels) + (1 - opacity) * behind


def _encoded(
    linear: np.ndarray, dtype: str, srgb: bool, profile: Profile | None, alpha: int | None = None
) -> np.ndarray:
    """Colours as numbers of a file; those in the place of alpha mean nothing."""
    if profile is None:
        return color.encode(linear, dtype, srgb=srgb)
    colors = [n for n in range(linear.shape[2]) if n != alpha]
    numbers = np.empty(linear.shape, dtype)
    numbers[..., colors] = color.encode(profile.encode(linear[..., colors]), dtype, srgb=False)
    return numbers


def _notes(
    path: Path, picture: Picture, channels: tuple[int | None, ...], window: Window | None
) -> tuple[str, ...]:
    found = []
    left = [n for n in range(picture.pixels.shape[2]) if n not in (*channels, picture.alpha)]
    if left:
        names = getattr(picture.metadata, "channelnames", ())
        named = [names[n] if len(names) > n else str(n) for n in left]
        found.append(f"{path}: has no room for the channels {', '.join(named)}; .exr and .tif have")
    if window is not None:
        found.append(
            f"{path}: shows the display window, {window.width} x {window.height} pixels, of the picture's "
            f"{picture.width} x {picture.height}"
        )
    return tuple(found)
