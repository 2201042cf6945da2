"""Still pictures read and written with OpenImageIO."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.limits import COLORSPACES, TYPES
from wfluid.pictures import color
from wfluid.pictures.encoder import file_bytes
from wfluid.pictures.formats import (
    CHANNELS,
    LARGEST,
    LINEAR,
    QUALITIES,
    WRITES,
    Encoding,
    PictureError,
    first_line,
)
from wfluid.pictures.picture import Picture, channels_beside, encode
from wfluid.system.atomic import atomic_write
from wfluid.system.memory import free_memory, readable_size
from wfluid.system.stderr import quiet_stderr

SIDE_LIMIT = 65_535
"""Longest side of a picture [px], limited by most formats and by 32-bit indices."""

_NOT_KEPT = ("oiio:UnassociatedAlpha", "oiio:ColorSpace", "compression", "CompressionQuality", "Orientation")

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
    """Read a still in any format that OpenImageIO reads; of a file with several pictures, the first.

    `colorspace` is the encoding of the file's numbers: "srgb", "linear", "auto" (sRGB for integers, linear
    for half and float) or "data" (no colours; numbers are written as they are read). Alpha is linear in all
    files. Straight colours are linearised and then multiplied by alpha. The EXIF orientation is applied. NaN
    becomes 0, infinite values the largest half.

    Raises:
        PictureError: a file that is missing, unreadable, damaged or too large for the memory; with `exact`,
            also one with values that are not finite.
    """
    import OpenImageIO as oiio

    path = Path(path)
    check_word("colorspace", colorspace, COLORSPACES, PictureError)
    if not path.is_file():
        why = "is a folder, not a picture" if path.is_dir() else "no such picture"
        raise PictureError(f"{path}: {why}")
    if path.stat().st_size == 0:
        raise PictureError(f"{path}: the file is empty")
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    with quiet_stderr():
        source = oiio.ImageInput.open(str(path), hints)
        if source is None:
            raise PictureError(f"{path}: not a picture that can be read ({first_line(_message(oiio))})")
        try:
            spec = source.spec()
            _check_size(path, spec)
            dtype = _type_of(str(spec.format))
            stored = source.read_image(0, 0, 0, spec.nchannels, dtype)
            message = _message(source)
        finally:
            source.close()
    if stored is None or message:
        raise PictureError(f"{path}: damaged or cut off ({first_line(message)})")
    stored = np.asarray(stored).reshape(spec.height, spec.width, spec.nchannels)
    if dtype == "half":
        stored = stored.view(np.float16) if stored.dtype != np.float16 else stored
    alpha = spec.alpha_channel if 0 <= spec.alpha_channel < spec.nchannels else None
    srgb = colorspace == "srgb" or (colorspace == "auto" and dtype not in LINEAR)
    pixels = np.empty(stored.shape, dtype=np.float32)
    for channel in range(spec.nchannels):
        pixels[..., channel] = color.decode(stored[..., channel], srgb and channel != alpha)
    if alpha is not None and spec.get_int_attribute("oiio:UnassociatedAlpha"):
        colours = channels_beside(alpha, spec.nchannels)
        pixels[..., colours] *= pixels[..., [alpha]]
    if exact and not np.isfinite(pixels).all():
        raise PictureError(f"{path}: {np.count_nonzero(~np.isfinite(pixels))} values are not finite")
    pixels = np.nan_to_num(pixels, copy=False, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
    upright = _UPRIGHT.get(spec.get_int_attribute("Orientation", 1), _UPRIGHT[1])
    return Picture(np.ascontiguousarray(upright(pixels)), alpha, dtype, spec, srgb, data=colorspace == "data")


def write_picture(path: str | os.PathLike, picture: Picture, encoding: Encoding | None = None) -> None:
    """Write a still, completely or not at all, in the format of the name's ending.

    The number type is that of the picture if the format supports it, otherwise the default of the format.
    Channels that the format does not support are dropped; without alpha the picture is over black. Metadata
    are kept, as are display and data windows if the size is unchanged.

    Raises:
        FileError: a name that cannot be written to; a PictureError for an unknown format, an unsupported
            setting, or a picture that the format cannot hold.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    path, encoding = Path(path), encoding or Encoding()
    encoding.check(path)
    ending = path.suffix.lower()
    own = picture.dtype if picture.dtype in WRITES[ending] else WRITES[ending][0]
    dtype = encoding.type or own
    linear = dtype in LINEAR
    stored, alpha = encode(picture, dtype, linear, CHANNELS.get(ending, 1024))
    spec = _spec_for(picture, stored.shape, dtype)
    spec.alpha_channel = -1 if alpha is None else alpha
    if alpha is not None and not linear:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if encoding.compression is not None:
        spec.attribute("compression", encoding.compression)
    if encoding.quality is not None:
        spec.attribute("compression", f"{QUALITIES[ending]}:{encoding.quality}")
    atomic_write(path, file_bytes(path, [spec], [stored]), sync=False)


def _spec_for(picture: Picture, shape: tuple[int, ...], dtype: str):
    """The spec of the file that the picture came from, if any, adapted to shape and number type."""
    import OpenImageIO as oiio

    height, width, channels = shape
    spec = oiio.ImageSpec(picture.metadata) if picture.metadata is not None else oiio.ImageSpec()
    names = spec.channelnames
    upright = spec.get_int_attribute("Orientation", 1) == 1
    if (spec.width, spec.height) != (width, height) or not upright:
        spec.x = spec.y = spec.full_x = spec.full_y = 0
        spec.full_width, spec.full_height = width, height
    spec.width, spec.height, spec.depth = width, height, 1
    spec.tile_width = spec.tile_height = spec.tile_depth = 0
    spec.nchannels = channels
    spec.channelformats = ()
    spec.default_channel_names()
    if len(names) == channels:
        spec.channelnames = names
    spec.set_format(oiio.TypeDesc(dtype))
    for name in _NOT_KEPT:
        spec.erase_attribute(name)
    return spec


def _check_size(path: Path, spec) -> None:
    """Check the size of a picture before memory is allocated.

    Raises:
        PictureError: a size out of range, or one that exceeds the free memory.
    """
    if not (1 <= spec.width <= SIDE_LIMIT and 1 <= spec.height <= SIDE_LIMIT and spec.depth == 1):
        size = f"{spec.width} x {spec.height} x {spec.depth}"
        raise PictureError(f"{path}: {size} pixels; sides of 1 … {SIDE_LIMIT} can be read")
    need, there = 12 * spec.width * spec.height * max(spec.nchannels, 1), free_memory()
    if need > there:
        raise PictureError(
            f"{path}: {spec.width} x {spec.height} pixels need about {readable_size(need)} of memory, "
            f"{readable_size(there)} are free; make the picture smaller first"
        )


def _type_of(format_name: str) -> str:
    if format_name in TYPES:
        return format_name
    return {"double": "float", "int8": "uint8", "uint32": "float", "int32": "float"}.get(
        format_name, "uint16"
    )


def _message(library) -> str:
    """OpenImageIO's message, which cannot be decoded if it quotes bytes of a damaged file."""
    try:
        return library.geterror()
    except UnicodeDecodeError:
        return "invalid file structure"
