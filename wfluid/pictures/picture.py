"""Pictures in linear light with premultiplied alpha."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wfluid.pictures import color
from wfluid.pictures.color import CODES, LUMINANCE, channels_beside
from wfluid.pictures.decoding import PillowImage, decoded, taken
from wfluid.pictures.formats import LINEAR, NUMPY, PictureError, first_line
from wfluid.pictures.profiles import Profile


@dataclass(frozen=True)
class Picture:
    """An image in linear light with the primaries of Rec. 709, alpha premultiplied.

    >>> Picture.of("examples/images/cat.png")
    Picture(451 x 300 px, 3 channels, uint8)
    >>> grey = Picture.of(np.full((2, 3), 128, dtype=np.uint8))
    >>> np.asarray(grey).shape, np.asarray(grey).max()
    ((2, 3, 1), np.uint8(128))
    """

    pixels: np.ndarray
    """Values (height, width, channels), float32; row 0 is the top. Colours beyond Rec. 709 have negative
    values."""
    alpha: int | None = None
    """Index of the alpha channel."""
    dtype: str = "float"
    """Number type of the file that was read: one of `TYPES`."""
    metadata: Any = None
    """The OpenImageIO `ImageSpec` of the file, for writing."""
    srgb: bool | None = None
    """Whether the file's numbers are sRGB; None for the default of the number type."""
    data: bool = False
    """Whether the numbers are not colours, so that files store them unconverted."""
    profile: Profile | None = None
    """Colour space of the file's numbers, where its ICC profile says another than sRGB."""
    notes: tuple[str, ...] = ()
    """What a user should know of how the file was read."""

    @classmethod
    def of(cls, thing: PictureLike, colorspace: str = "auto") -> Picture:
        """The picture of a path, an image of Pillow or an array; a `Picture` is returned unchanged.

        An array is (height, width) or (height, width, channels): grey, grey and alpha, RGB or RGBA, colours
        not multiplied by alpha. Its numbers are sRGB: codes of uint8 or uint16, or floats 0 … 1; True is
        white. `colorspace` says something else: "linear" light, or "data", which are no colours. For files,
        see `read_picture`. Later changes to the array do not change the picture.

        Raises:
            TypeError: something else; the message lists what is possible.
            PictureError: an array of another shape or with floats that look like codes; a file as by
                `read_picture`.
        """
        if isinstance(thing, Picture):
            return thing
        if isinstance(thing, str | os.PathLike):
            return cls(**decoded(thing, colorspace))
        return cls(**taken(thing, colorspace))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The numbers of the picture's file (height, width, channels), in their own type.

        Display values for uint8 and uint16, colours not multiplied by alpha: what `Picture.of` takes.
        `pixels` are linear light.

        Raises:
            ValueError: `copy` is False: the numbers are computed.
        """
        if copy is False:
            raise ValueError("the numbers of a picture are computed: write np.asarray(picture)")
        numbers, top = as_stored(self), CODES.get(self.dtype)
        numbers = numbers if top is None else np.rint(np.clip(numbers, 0.0, 1.0) * top)
        return numbers.astype(NUMPY[self.dtype] if dtype is None else dtype)

    def __repr__(self) -> str:
        channels = self.pixels.shape[2]
        kind = ", data" if self.data else ", with alpha" if self.alpha is not None else ""
        plural = "" if channels == 1 else "s"
        return f"Picture({self.width} x {self.height} px, {channels} channel{plural}{kind}, {self.dtype})"

    @property
    def width(self) -> int:
        """Number of pixels along x."""
        return self.pixels.shape[1]

    @property
    def height(self) -> int:
        """Number of pixels along y."""
        return self.pixels.shape[0]

    @property
    def color_channels(self) -> list[int]:
        """Indices of all channels except alpha."""
        return channels_beside(self.alpha, self.pixels.shape[2])

    def resized(self, width: int, height: int) -> Picture:
        """The picture at another size [px]; shrinking filters against aliasing."""
        if (width, height) == (self.width, self.height):
            return self
        return self.with_pixels(resample(self.pixels, width, height, filter=""))

    def shrunk(self, width: int, height: int) -> Picture:
        """The picture reduced to at most a size [px], filtered against aliasing; it is never enlarged."""
        return self.resized(min(width, self.width), min(height, self.height))

    def with_pixels(self, pixels: np.ndarray) -> Picture:
        """The picture with other pixels (height, width, channels); everything else is kept."""
        return replace(self, pixels=pixels)


PictureLike = Picture | str | os.PathLike | np.ndarray | PillowImage
"""What `Picture.of` takes."""


def picture_of(name: str, thing: PictureLike) -> Picture:
    """`Picture.of`, with a name in its refusals."""
    try:
        return Picture.of(thing)
    except TypeError as error:
        raise TypeError(f"{name}: {error}") from None


def resample(values: np.ndarray, width: int, height: int, filter: str = "triangle") -> np.ndarray:
    """Values (rows, columns) or (rows, columns, channels) at another size, without aliasing.

    `filter` is a filter of OpenImageIO. "" selects its default for pictures, which may overshoot; "triangle"
    stays within the range of the values.

    Raises:
        PictureError: OpenImageIO cannot resize the values.
    """
    import OpenImageIO as oiio

    if values.shape[:2] == (height, width):
        return values
    source = oiio.ImageBuf(np.ascontiguousarray(values, dtype=np.float32).reshape(*values.shape[:2], -1))
    roi = oiio.ROI(0, width, 0, height, 0, 1, 0, source.nchannels)
    result = oiio.ImageBufAlgo.resize(source, filter, roi=roi)
    resized = None if result.has_error else result.get_pixels(oiio.FLOAT)
    if resized is None:
        raise PictureError(f"resizing to {width} x {height} failed ({first_line(result.geterror())})")
    return resized.reshape(height, width, *values.shape[2:])


def as_stored(picture: Picture) -> np.ndarray:
    """The numbers of the picture's file (height, width, channels), straight colours, integers as 0 … 1."""
    pixels, alpha, colours = picture.pixels, picture.alpha, picture.color_channels
    stored = pixels.copy()
    if alpha is not None:
        opacity = pixels[..., [alpha]]
        stored[..., colours] = np.divide(
            pixels[..., colours], opacity, out=np.zeros_like(pixels[..., colours]), where=opacity > 0
        )
    if picture.profile is not None and len(picture.profile.curves) == len(colours):
        stored[..., colours] = picture.profile.encode(stored[..., colours])
    elif picture.dtype not in LINEAR if picture.srgb is None else picture.srgb:
        stored[..., colours] = color.to_srgb(stored[..., colours])
    return stored


_RINGING = 1e-3
"""Largest negative value, in size, that counts as ringing of a filter around 0."""


def intensity(picture: Picture) -> np.ndarray:
    """Intensity (height, width), 0 … 1 of the number type's range; transparent is 0.

    The intensity is the luminance (Rec. 709 weights) of the file's numbers, which are display values in 8-
    and 16-bit files, clamped to 1 and multiplied by alpha.

    Raises:
        PictureError: a value that is negative or not finite.
    """
    pixels, alpha = picture.pixels, picture.alpha
    stored = as_stored(picture)
    checked = pixels if picture.profile is None else stored  # of wide colours, Rec. 709 values are negative
    wrong = ~np.isfinite(checked) | (checked < -_RINGING)
    if wrong.any():
        value = checked[wrong].flat[0]
        raise PictureError(
            f"a picture with the value {value} has no intensity: expected finite values from 0 on"
        )
    colours = picture.color_channels[:3]
    weights = LUMINANCE if len(colours) == 3 else (1.0,)
    grey = sum(weight * stored[..., channel] for weight, channel in zip(weights, colours, strict=False))
    opacity = pixels[..., alpha] if alpha is not None else np.float32(1.0)
    return np.round(np.clip(grey, 0.0, 1.0) * opacity, 6)  # white is 1: conversions may round to less
