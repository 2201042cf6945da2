"""Still pictures read and written with OpenImageIO."""

from __future__ import annotations

import os
from pathlib import Path

from wfluid.pictures.decoding import decoded
from wfluid.pictures.encoder import file_bytes
from wfluid.pictures.fitting import Fit, display_window, fit, stored
from wfluid.pictures.formats import CHANNELS, LINEAR, QUALITIES, Encoding
from wfluid.pictures.picture import Picture, PictureLike
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
    return Picture(**decoded(path, colorspace, exact=exact))


def write_picture(path: str | os.PathLike, picture: PictureLike, encoding: Encoding | None = None) -> None:
    """Write a still, completely or not at all, in the format of the name's ending.

    `picture` is anything that `Picture.of` takes.

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
    path, encoding, picture = Path(path), encoding or Encoding(), Picture.of(picture)
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
