"""What a picture is made from, in linear light: a file, an image of Pillow, or an array."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.limits import COLORSPACES
from wfluid.pictures import color
from wfluid.pictures.color import channels_beside
from wfluid.pictures.formats import LARGEST, NUMPY, PictureError
from wfluid.pictures.reading import Stored, read_stored

BEYOND_WHITE = 2.0
"""Display value above which numbers look like codes 0 … 255: white is 1, and filters overshoot a little."""

KEPT_MODES = ("L", "LA", "RGB", "RGBA", "I;16", "F")
"""Modes of Pillow whose numbers are taken as they are."""

MODES = {"1": "L", "La": "LA", "PA": "RGBA", "RGBa": "RGBA"}
"""Other modes, each with the one that it is converted to; further ones become RGB."""


class PillowImage(Protocol):
    """An image of Pillow, or of a library that speaks like it."""

    @property
    def mode(self) -> str:
        """Its channels, such as "RGB"."""
        ...

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        ...

    @property
    def __array_interface__(self) -> dict[str, Any]:
        """Its numbers (height, width, channels)."""
        ...


_UPRIGHT = {
    1: lambda a: a,
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a.swapaxes(0, 1)[::-1, ::-1],
    8: lambda a: a.swapaxes(0, 1)[::-1],
}
"""Functions that turn a stored array upright, by EXIF orientation (EXIF 2.32, tag 0x0112)."""


def decoded(path: str | os.PathLike, colorspace: str, *, exact: bool = False) -> dict[str, Any]:
    """The fields of the picture of a file; `stills.read_picture` has the rules.

    Raises:
        PictureError: as `stills.read_picture`.
    """
    path = Path(path)
    check_word("colorspace", colorspace, COLORSPACES, PictureError)
    fields = _fields(read_stored(path, colorspace), colorspace)
    pixels = fields["pixels"]
    if wrong := pixels.size - np.count_nonzero(np.isfinite(pixels)):
        if exact:
            raise PictureError(f"{path}: {wrong} values are not finite")
        fields["notes"] += (f"{wrong} values are not finite: NaN becomes 0, infinite ones {LARGEST:g}",)
        pixels = np.nan_to_num(pixels, copy=False, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
    upright = _UPRIGHT.get(fields["metadata"].get_int_attribute("Orientation", 1), _UPRIGHT[1])
    return fields | {"pixels": np.ascontiguousarray(upright(pixels))}


def taken(thing: Any, colorspace: str) -> dict[str, Any]:
    """The fields of the picture of an image of Pillow or an array; `Picture.of` has the rules.

    Raises:
        TypeError: something else, or an array of other numbers; the message says what to write.
        PictureError: an array of another shape, or with values that are not finite or look like codes.
    """
    check_word("colorspace", colorspace, COLORSPACES, PictureError)
    array = _array(thing)
    if array.ndim == 2:
        array = array[..., None]
    if array.ndim != 3 or not array.size or array.shape[2] > 4:
        turned = array.ndim == 3 and array.shape[0] <= 4 < array.shape[1]
        remedy = "; write array.transpose(1, 2, 0)" if turned else ""
        raise PictureError(
            f"an array of shape {array.shape}: expected (height, width) or (height, width, channels), "
            f"with 1 … 4 channels{remedy}"
        )
    alpha = {2: 1, 4: 3}.get(array.shape[2])
    integers, data = array.dtype.kind == "u", colorspace == "data"
    if not integers:
        _check_light(array, colorspace in ("auto", "srgb"))
    dtype = next(name for name, numpy in NUMPY.items() if numpy == array.dtype.name)
    alpha = None if data else alpha
    read = Stored(array, dtype, alpha, True, integers, data, None, None, ())
    return _fields(read, "srgb" if colorspace == "auto" else colorspace)


def _array(thing: Any) -> np.ndarray:
    """The numbers of an image of Pillow or of an array: 8 or 16 bits, half or float.

    Raises:
        TypeError: something else.
    """
    if isinstance(getattr(thing, "mode", None), str) and hasattr(thing, "__array_interface__"):
        wanted = thing.mode if thing.mode in KEPT_MODES else MODES.get(thing.mode, "RGB")
        if "transparency" in getattr(thing, "info", {}):
            wanted = "RGBA"
        if thing.mode != wanted and not hasattr(thing, "convert"):
            raise TypeError(f'an image of mode {thing.mode}: write image.convert("{wanted}")')
        thing = thing if thing.mode == wanted else thing.convert(wanted)
    elif not hasattr(thing, "__array_interface__") and not hasattr(thing, "__array__"):
        raise TypeError(
            "expected a picture, as a path, a Picture, an image of Pillow or an array (height, width, "
            f"channels); got {type(thing).__name__}"
        )
    array = np.asarray(thing)
    if array.dtype == bool:
        return array.astype(np.uint8) * np.uint8(255)
    if array.dtype.name in ("float64", "longdouble"):
        return array.astype(np.float32)
    if array.dtype.name not in NUMPY.values():
        raise TypeError(
            f"an array of {array.dtype}: write array.astype(np.uint8) for codes 0 … 255, or give floats 0 … 1"
        )
    return array


def _check_light(array: np.ndarray, display: bool) -> None:
    """Check the floats of an array; `display` values are at most about 1.

    Raises:
        PictureError: values that are not finite, or codes 0 … 255.
    """
    if not np.isfinite(array).all():
        raise PictureError(f"{np.count_nonzero(~np.isfinite(array))} values are not finite: expected numbers")
    if display and array.max() > BEYOND_WHITE:
        raise PictureError(
            f"display values up to {array.max():g}: expected 0 … 1; divide codes by 255, or say "
            'Picture.of(array, "linear") of light'
        )


def _fields(read: Stored, colorspace: str) -> dict[str, Any]:
    """The fields of a picture with these numbers."""
    data = read.data or colorspace == "data"
    srgb = colorspace == "srgb" or (colorspace == "auto" and read.integers and not data)
    return {
        "pixels": _linear(read, srgb),
        "alpha": read.alpha,
        "dtype": read.dtype,
        "metadata": read.spec,
        "srgb": srgb,
        "data": data,
        "profile": read.profile,
        "notes": read.notes,
    }


def _linear(read: Stored, srgb: bool) -> np.ndarray:
    """The numbers of a file in linear light, multiplied by alpha.

    Where integers are multiplied by alpha already, that was done to the encoded numbers, which are divided by
    it before they are decoded.
    """
    numbers, alpha, profile = read.numbers, read.alpha, read.profile
    colours = channels_beside(alpha, numbers.shape[2])
    pixels = np.empty(numbers.shape, dtype=np.float32)
    for channel in range(numbers.shape[2]):
        coded = srgb and profile is None and channel != alpha
        pixels[..., channel] = color.decode(numbers[..., channel], coded)
    if alpha is None:
        return pixels if profile is None else profile.decode(pixels)
    opacity = pixels[..., [alpha]]
    if read.straight or not (srgb or profile):
        if profile is not None:
            pixels[..., colours] = profile.decode(pixels[..., colours])
        if read.straight:
            pixels[..., colours] *= opacity
        return pixels
    stored = color.decode(numbers[..., colours], False)
    partly = (opacity > 0) & (opacity < 1)
    straight = np.divide(stored, opacity, out=stored.copy(), where=partly)
    if profile is None:
        light = np.where(partly, color.to_linear(straight), pixels[..., colours])
    else:
        light = profile.decode(straight)
    pixels[..., colours] = np.where(partly, light * opacity, light)
    return pixels
