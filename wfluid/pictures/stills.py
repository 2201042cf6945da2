"""Still pictures read and written with OpenImageIO."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.limits import COLORSPACES
from wfluid.pictures import color
from wfluid.pictures.encoder import file_bytes
from wfluid.pictures.fitting import Fit, display_window, fit, stored
from wfluid.pictures.formats import CHANNELS, LARGEST, LINEAR, QUALITIES, Encoding, PictureError
from wfluid.pictures.picture import Picture, channels_beside
from wfluid.pictures.reading import Stored, read_stored
from wfluid.system.atomic import atomic_write

_NOT_KEPT = (
    "oiio:UnassociatedAlpha",
    "oiio:ColorSpace",
    "compression",
    "CompressionQuality",
    "Orientation",
    "jpeg:ColorSpace",
    "planarconfig",
    "tiff:.*",
)
"""Attributes of a file that hold for it alone."""

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


def read_picture(path: str | os.PathLike, colorspace: str = "auto", *, exact: bool = False) -> Picture:
    """Read a still in any format that OpenImageIO reads.

    Of a file with pictures of several sizes, such as an icon or a TIFF, the largest is read, of an animation
    the first frame; `Picture.notes` says so.

    `colorspace` is the encoding of the file's numbers: "srgb", "linear", "auto" (that of the ICC profile,
    otherwise sRGB for integers, linear for half and float) or "data" (no colours; numbers are written as they
    are read). Alpha is linear in all files. Straight colours are linearised and then multiplied by alpha.
    32-bit integers in OpenEXR, and one or two channels of them in other formats, are data, read as they are;
    alpha without colours is data too. The EXIF orientation is applied. NaN becomes 0, infinite values the
    largest half, with a note.

    Raises:
        PictureError: a file that is missing, unreadable, damaged, deep or too large for the memory; with
            `exact`, also one with values that are not finite.
    """
    path = Path(path)
    check_word("colorspace", colorspace, COLORSPACES, PictureError)
    read = read_stored(path, colorspace)
    data = read.data or colorspace == "data"
    srgb = colorspace == "srgb" or (colorspace == "auto" and read.integers and not data)
    pixels, notes = _linear(read, srgb), read.notes
    if wrong := pixels.size - np.count_nonzero(np.isfinite(pixels)):
        if exact:
            raise PictureError(f"{path}: {wrong} values are not finite")
        notes += (f"{wrong} values are not finite: NaN becomes 0, infinite ones {LARGEST:g}",)
        pixels = np.nan_to_num(pixels, copy=False, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
    upright = _UPRIGHT.get(read.spec.get_int_attribute("Orientation", 1), _UPRIGHT[1])
    return Picture(
        np.ascontiguousarray(upright(pixels)),
        read.alpha,
        read.dtype,
        read.spec,
        srgb,
        data=data,
        profile=read.profile,
        notes=notes,
    )


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


def write_picture(path: str | os.PathLike, picture: Picture, encoding: Encoding | None = None) -> None:
    """Write a still, completely or not at all, in the format of the name's ending.

    The number type is that of the picture if the format supports it, otherwise the default of the format;
    values are clamped to its range. Channels that the format does not support are dropped; without alpha the
    picture is over the encoding's background. Grey becomes colours where a format has only those. Metadata
    are kept, an ICC profile in integer files of formats that have one; otherwise numbers are sRGB, or linear
    with the primaries of Rec. 709. EXR files keep display and data windows, in proportion to their size;
    other formats show the display window.

    Raises:
        FileError: a name that cannot be written to; a PictureError for an unknown format, an unsupported
            setting, or a picture that the format cannot hold.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    path, encoding = Path(path), encoding or Encoding()
    how = fit(path, picture, encoding)
    ending = path.suffix.lower()
    numbers = stored(picture, how)
    spec = _spec_for(picture, numbers.shape, how, ending)
    if encoding.compression is not None:
        spec.attribute("compression", encoding.compression)
    if encoding.quality is not None:
        spec.attribute("compression", f"{QUALITIES[ending]}:{encoding.quality}")
    atomic_write(path, file_bytes(path, [spec], [numbers]), sync=False)


def _spec_for(picture: Picture, shape: tuple[int, ...], how: Fit, ending: str):
    """The spec of the file that the picture came from, if any, adapted to a file's numbers."""
    import OpenImageIO as oiio

    height, width, channels = shape
    spec = oiio.ImageSpec(picture.metadata) if picture.metadata is not None else oiio.ImageSpec()
    names, window = spec.channelnames, None if how.window else display_window(picture)
    spec.x, spec.y = (-window.x, -window.y) if window else (0, 0)
    spec.full_x = spec.full_y = 0
    spec.full_width, spec.full_height = (window.width, window.height) if window else (width, height)
    spec.width, spec.height, spec.depth = width, height, 1
    spec.tile_width = spec.tile_height = spec.tile_depth = 0
    spec.nchannels = channels
    spec.channelformats = ()
    kept = ending not in CHANNELS and len(names) == channels and how.channels == tuple(range(channels))
    spec.channelnames = names if kept else _names(channels, how.alpha)
    spec.alpha_channel = -1 if how.alpha is None else how.alpha
    spec.set_format(oiio.TypeDesc(how.dtype))
    for name in _NOT_KEPT:
        spec.erase_attribute(name)
    if ending != ".dpx":
        spec.erase_attribute("oiio:BitsPerSample")
    if how.dtype in LINEAR or (picture.profile is not None and how.profile is None):
        spec.erase_attribute("ICCProfile.*")
    if how.alpha is not None and how.dtype not in LINEAR:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    return spec


def _names(channels: int, alpha: int | None) -> tuple[str, ...]:
    """Names of channels: none but alpha is called A."""
    colors = channels - (alpha is not None)
    usual = iter(["Y"] if colors == 1 else ["R", "G", "B", *(f"channel{n}" for n in range(3, channels))])
    return tuple("A" if n == alpha else next(usual) for n in range(channels))
