"""Pictures: read and written through OpenImageIO, held in linear light with premultiplied alpha."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wfluid import colour
from wfluid.files import free_memory, quiet_stderr, readable_size, whole_file

COLORSPACES = ("auto", "srgb", "linear", "data")

TYPES = ("uint8", "uint16", "half", "float")
"""Number types a picture is written with."""

LARGEST = 65504.0
"""What an infinite value becomes on reading (the largest half): filters would spread it as NaN."""

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue (Rec. 709)."""

SIDE_LIMIT = 65_535
"""Longest side of a picture [px]: what most formats, and 32-bit indices, allow."""

_NUMPY = {"uint8": "uint8", "uint16": "uint16", "half": "float16", "float": "float32"}
_WRITES = {
    ".png": ("uint8", "uint16"),
    ".tif": ("uint8", "uint16", "half", "float"),
    ".tiff": ("uint8", "uint16", "half", "float"),
    ".jpg": ("uint8",),
    ".jpeg": ("uint8",),
    ".exr": ("half", "float"),
    ".hdr": ("float",),
    ".webp": ("uint8",),
    ".tga": ("uint8",),
    ".bmp": ("uint8",),
    ".dpx": ("uint8", "uint16"),
}
"""Formats written as stills, and the number types of each, the first one being the default."""

_CHANNELS = {".jpg": 3, ".jpeg": 3, ".hdr": 3, ".bmp": 3, ".png": 4, ".webp": 4, ".tga": 4, ".dpx": 4}
"""Most channels that a format holds, where that is few; with 3 there is no alpha among them."""

_COMPRESSIONS = {
    ".exr": ("none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"),
    ".tif": ("none", "lzw", "zip", "packbits"),
    ".tiff": ("none", "lzw", "zip", "packbits"),
}
_QUALITIES = {".jpg": "jpeg", ".jpeg": "jpeg", ".webp": "webp"}

_LINEAR = ("half", "float")
"""Number types that hold linear light; the others hold sRGB."""

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
"""By EXIF orientation (EXIF 2.32, tag 0x0112): the stored array turned upright."""


class PictureError(ValueError):
    """A picture that cannot be read or written; the message says which, why and what to do."""


@dataclass(frozen=True)
class Encoding:
    """How a still is written; what is None follows the picture and the format.

    Raises:
        PictureError: a value that no format has.
    """

    type: str | None = None
    """Number type: one of `TYPES`."""
    compression: str | None = None
    """Lossless or lossy method, for EXR and TIFF."""
    quality: int | None = None
    """1 … 100, for JPEG and WebP."""

    def __post_init__(self) -> None:
        if self.type is not None and self.type not in TYPES:
            raise PictureError(f"type {self.type!r}: expected one of {', '.join(TYPES)}")
        known = sorted({name for names in _COMPRESSIONS.values() for name in names})
        if self.compression is not None and self.compression not in known:
            raise PictureError(f"compression {self.compression!r}: expected one of {', '.join(known)}")
        if self.quality is not None and not 1 <= self.quality <= 100:
            raise PictureError(f"quality {self.quality}: expected 1 … 100")

    def check(self, path: Path) -> None:
        """Refuse what the format of `path` does not have.

        Raises:
            PictureError: an unknown ending, or a setting its format lacks, with what it has.
        """
        ending = path.suffix.lower()
        if ending not in _WRITES:
            raise PictureError(f"{path}: unknown picture format {path.suffix!r}; known: {', '.join(_WRITES)}")
        if self.type is not None and self.type not in _WRITES[ending]:
            raise PictureError(f"{path}: {ending} holds {' or '.join(_WRITES[ending])}, not {self.type}")
        if self.compression is not None and self.compression not in _COMPRESSIONS.get(ending, ()):
            known = ", ".join(_COMPRESSIONS.get(ending, ())) or "no choice of compression"
            raise PictureError(
                f"{path}: compression {self.compression!r} is not for {ending}: it has {known}"
            )
        if self.quality is not None and ending not in _QUALITIES:
            raise PictureError(f"{path}: {ending} has no quality; {', '.join(_QUALITIES)} have")


@dataclass(frozen=True)
class Picture:
    """An image in linear light, alpha premultiplied."""

    pixels: np.ndarray
    """Values (height, width, channels), float32; row 0 is the top."""
    alpha: int | None = None
    """Index of the alpha channel."""
    dtype: str = "float"
    """Number type of the file it came from: one of `TYPES`."""
    metadata: Any = None
    """The OpenImageIO `ImageSpec` it came with, for writing."""
    srgb: bool | None = None
    """Whether the file's numbers were sRGB; None for what its number type says."""
    data: bool = False
    """Whether its numbers are no colours, so that no file converts them."""

    @property
    def width(self) -> int:
        """Pixels along x."""
        return self.pixels.shape[1]

    @property
    def height(self) -> int:
        """Pixels along y."""
        return self.pixels.shape[0]

    def resized(self, width: int, height: int) -> Picture:
        """The picture at another size, filtered so that shrinking does not alias."""
        if (width, height) == (self.width, self.height):
            return self
        return self.with_pixels(resample(self.pixels, width, height, filter=""))

    def shrunk(self, width: int, height: int) -> Picture:
        """The picture for frames of a size: shrunk where it is larger, so that they do not alias."""
        return self.resized(min(width, self.width), min(height, self.height))

    def with_pixels(self, pixels: np.ndarray) -> Picture:
        """The same kind of picture with other pixels."""
        return replace(self, pixels=pixels)


def resample(values: np.ndarray, width: int, height: int, filter: str = "triangle") -> np.ndarray:
    """Values (rows, columns) or (rows, columns, channels) at another size, without aliasing.

    `filter` is one of OpenImageIO's, widened where it shrinks; "" is its best for pictures, which may
    overshoot; "triangle" keeps within the range of the values.
    """
    import OpenImageIO as oiio

    if values.shape[:2] == (height, width):
        return values
    source = oiio.ImageBuf(np.ascontiguousarray(values, dtype=np.float32).reshape(*values.shape[:2], -1))
    roi = oiio.ROI(0, width, 0, height, 0, 1, 0, source.nchannels)
    result = oiio.ImageBufAlgo.resize(source, filter, roi=roi)
    if result.has_error:
        raise PictureError(f"resizing to {width} x {height} failed ({_first_line(result.geterror())})")
    return result.get_pixels(oiio.FLOAT).reshape(height, width, *values.shape[2:])


def as_stored(picture: Picture) -> np.ndarray:
    """The numbers of the picture's file, integers scaled to 0 … 1, colours not multiplied by alpha."""
    pixels, alpha = picture.pixels, picture.alpha
    colours = [channel for channel in range(pixels.shape[2]) if channel != alpha]
    stored = pixels.copy()
    if alpha is not None:
        opacity = pixels[..., [alpha]]
        stored[..., colours] = np.divide(
            pixels[..., colours], opacity, out=np.zeros_like(pixels[..., colours]), where=opacity > 0
        )
    if picture.dtype not in _LINEAR if picture.srgb is None else picture.srgb:
        stored[..., colours] = colour.to_srgb(stored[..., colours])
    return stored


_RINGING = 1e-3
"""How far below zero a filter may have left a value that was painted 0."""


def intensity(picture: Picture) -> np.ndarray:
    """Intensity (height, width), 0 … 1 of the number type's range; transparent is 0.

    Luminance of the file's numbers (Rec. 709 weights), which are display values in 8- and 16-bit files;
    what is above the range is cut off; times alpha.

    Raises:
        PictureError: a value that is negative or not finite.
    """
    pixels, alpha = picture.pixels, picture.alpha
    wrong = ~np.isfinite(pixels) | (pixels < -_RINGING)
    if wrong.any():
        raise PictureError(f"a picture with the value {pixels[wrong].flat[0]} has no intensity there")
    colours = [channel for channel in range(pixels.shape[2]) if channel != alpha][:3]
    colours = [channel for channel in range(pixels.shape[2]) if channel != alpha][:3]
    weights = LUMINANCE if len(colours) == 3 else (1.0,)
    stored = as_stored(picture)
    grey = sum(weight * stored[..., channel] for weight, channel in zip(weights, colours, strict=False))
    opacity = pixels[..., alpha] if alpha is not None else np.float32(1.0)
    return np.round(np.clip(grey, 0.0, 1.0) * opacity, 6)  # full is 1: conversions round below that


def read_picture(path: str | os.PathLike, colorspace: str = "auto", *, exact: bool = False) -> Picture:
    """Read a still in any format that OpenImageIO reads; of several in one file, the first.

    `colorspace` says what the numbers are: "srgb", "linear", or "auto": sRGB for integers, linear for
    half and float; "data" are no colours, and written as they are read. Alpha is never linearised; where
    it is unassociated it multiplies the colours once they are linear. The picture is turned upright by
    its EXIF orientation.

    Raises:
        PictureError: no such file, one that cannot be read, is damaged, or is too large for the memory.
    """
    import OpenImageIO as oiio

    path = Path(path)
    if colorspace not in COLORSPACES:
        raise PictureError(f"colorspace {colorspace!r}: expected one of {', '.join(COLORSPACES)}")
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
            raise PictureError(f"{path}: not a picture that can be read ({_first_line(_message(oiio))})")
        try:
            spec = source.spec()
            _check_size(path, spec)
            dtype = _type_of(str(spec.format))
            stored = source.read_image(0, 0, 0, spec.nchannels, dtype)
            message = _message(source)
        finally:
            source.close()
    if stored is None or message:
        raise PictureError(f"{path}: damaged or cut off ({_first_line(message)})")
    stored = np.asarray(stored).reshape(spec.height, spec.width, spec.nchannels)
    if dtype == "half":
        stored = stored.view(np.float16) if stored.dtype != np.float16 else stored
    alpha = spec.alpha_channel if 0 <= spec.alpha_channel < spec.nchannels else None
    srgb = colorspace == "srgb" or (colorspace == "auto" and dtype not in _LINEAR)
    pixels = np.empty(stored.shape, dtype=np.float32)
    for channel in range(spec.nchannels):
        pixels[..., channel] = colour.decode(stored[..., channel], srgb and channel != alpha)
    if alpha is not None and spec.get_int_attribute("oiio:UnassociatedAlpha"):
        colours = [channel for channel in range(spec.nchannels) if channel != alpha]
        pixels[..., colours] *= pixels[..., [alpha]]
    if exact and not np.isfinite(pixels).all():
        raise PictureError(f"{path}: {np.count_nonzero(~np.isfinite(pixels))} values are not finite")
    pixels = np.nan_to_num(pixels, copy=False, nan=0.0, posinf=LARGEST, neginf=-LARGEST)
    upright = _UPRIGHT.get(spec.get_int_attribute("Orientation", 1), _UPRIGHT[1])
    return Picture(np.ascontiguousarray(upright(pixels)), alpha, dtype, spec, srgb, data=colorspace == "data")


def write_picture(path: str | os.PathLike, picture: Picture, encoding: Encoding | None = None) -> None:
    """Write a still in the format that the name's ending says, whole or not at all.

    The number type is the picture's own where the format has it, else the format's default. Alpha and
    further channels are dropped where the format has no room (alpha over black). Metadata travel, and
    windows where the size is still the source's.

    Raises:
        PictureError: a format or setting that does not exist, or the file cannot be written.
    """
    import OpenImageIO as oiio

    path, encoding = Path(path), encoding or Encoding()
    encoding.check(path)
    ending = path.suffix.lower()
    own = picture.dtype if picture.dtype in _WRITES[ending] else _WRITES[ending][0]
    dtype = encoding.type or own
    linear = dtype in _LINEAR
    stored, alpha = encode(picture, dtype, linear, _CHANNELS.get(ending, 1024))
    spec = _spec_for(picture, stored.shape, dtype)
    spec.alpha_channel = -1 if alpha is None else alpha
    if alpha is not None and not linear:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if encoding.compression is not None:
        spec.attribute("compression", encoding.compression)
    if encoding.quality is not None:
        spec.attribute("compression", f"{_QUALITIES[ending]}:{encoding.quality}")
    with whole_file(path) as temporary, quiet_stderr():
        out = oiio.ImageOutput.create(str(temporary))
        if out is None:
            raise PictureError(f"{path}: cannot be written ({_first_line(oiio.geterror())})")
        done = out.open(str(temporary), spec) and out.write_image(np.ascontiguousarray(stored))
        message = out.geterror()
        if not (out.close() and done):
            raise PictureError(f"{path}: cannot be written ({_first_line(message or out.geterror())})")


def encode(picture: Picture, dtype: str, linear: bool, channels: int) -> tuple[np.ndarray, int | None]:
    """A picture's numbers as a file of at most `channels` channels stores them, and which is alpha.

    With up to three channels there is no alpha. In linear files it stays premultiplied; in display files
    it is divided out first.
    """
    pixels, alpha = picture.pixels, picture.alpha
    if alpha is not None and channels <= 3:
        pixels, alpha = np.delete(pixels, alpha, axis=2), None
    pixels = pixels[..., :channels] if alpha is None or alpha < channels else pixels[..., :3]
    if channels == 3 and pixels.shape[2] == 2:
        pixels = pixels[..., :1]
    kind, srgb = _NUMPY[dtype], not linear and not picture.data
    if linear or alpha is None:
        return colour.encode(pixels, kind, srgb=srgb), alpha
    opacity = pixels[..., [alpha]]
    straight = np.divide(pixels, opacity, out=np.zeros_like(pixels), where=opacity > 0)
    stored = colour.encode(straight, kind, srgb=srgb)
    stored[..., alpha] = colour.encode(pixels[..., alpha], kind, srgb=False)
    return stored, alpha


def _spec_for(picture: Picture, shape: tuple[int, ...], dtype: str):
    """The picture's own spec where it has one, made to fit."""
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
    """Refuse dimensions that no memory holds, before any is taken."""
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
    """OpenImageIO's message; it may quote bytes of a damaged file that are no text."""
    try:
        return library.geterror()
    except UnicodeDecodeError:
        return "the file's structure makes no sense"


def _first_line(message: str) -> str:
    return message.strip().splitlines()[0] if message.strip() else "no reason given"
