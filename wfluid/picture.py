"""Pictures: read and written through OpenImageIO, held in linear light with premultiplied alpha."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wfluid import colour

DTYPES = ("uint8", "uint16", "half", "float")
"""Number types a picture is written with."""

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

_LINEAR = ("half", "float")
"""Number types that hold linear light; the others hold sRGB."""

_WITHOUT_ALPHA = (".jpg", ".jpeg", ".hdr", ".bmp")


class PictureError(ValueError):
    """A picture that cannot be read or written; the message says which, why and what to do."""


@dataclass(frozen=True)
class Picture:
    """An image in linear light, alpha premultiplied."""

    pixels: np.ndarray
    """Values (height, width, channels), float32; row 0 is the top."""
    alpha: int | None = None
    """Index of the alpha channel."""
    dtype: str = "float"
    """Number type of the file it came from: one of `DTYPES`."""
    metadata: Any = None
    """The OpenImageIO `ImageSpec` it came with, for writing."""

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
        import OpenImageIO as oiio

        if (width, height) == (self.width, self.height):
            return self
        source = oiio.ImageBuf(np.ascontiguousarray(self.pixels))
        roi = oiio.ROI(0, width, 0, height, 0, 1, 0, self.pixels.shape[2])
        result = oiio.ImageBufAlgo.resize(source, roi=roi)
        if result.has_error:
            raise PictureError(f"resizing to {width} x {height} failed ({_first_line(result.geterror())})")
        return self.with_pixels(result.get_pixels(oiio.FLOAT).reshape(height, width, -1))

    def with_pixels(self, pixels: np.ndarray) -> Picture:
        """The same kind of picture with other pixels."""
        return replace(self, pixels=pixels)


def read_picture(path: str | os.PathLike) -> Picture:
    """Read a still: 8-bit, 16-bit, half or float, 1 to 4 channels or more.

    Integers are taken as sRGB and linearised; EXR, HDR and other floats are linear. Unassociated alpha
    is linearised first and multiplied in after.

    Raises:
        PictureError: no such file, or one that OpenImageIO cannot read.
    """
    import OpenImageIO as oiio

    path = Path(path)
    if not path.is_file():
        raise PictureError(f"{path}: no such picture" if not path.exists() else f"{path}: not a file")
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hints)
    if source is None:
        raise PictureError(f"{path}: not a picture that can be read ({_first_line(oiio.geterror())})")
    try:
        spec = source.spec()
        dtype = _dtype_of(str(spec.format))
        stored = source.read_image(0, 0, 0, spec.nchannels, "half" if dtype == "half" else _NUMPY[dtype])
        if stored is None:
            raise PictureError(f"{path}: damaged ({_first_line(source.geterror())})")
    finally:
        source.close()
    if str(spec.format) == "half":
        stored = stored.view(np.float16) if stored.dtype != np.float16 else stored
    stored = stored.reshape(spec.height, spec.width, spec.nchannels)
    alpha = spec.alpha_channel if spec.alpha_channel >= 0 else None
    srgb = stored.dtype.kind == "u"
    pixels = np.empty(stored.shape, dtype=np.float32)
    for channel in range(spec.nchannels):
        pixels[..., channel] = colour.decode(stored[..., channel], srgb and channel != alpha)
    if alpha is not None and spec.get_int_attribute("oiio:UnassociatedAlpha"):
        colours = [channel for channel in range(spec.nchannels) if channel != alpha]
        pixels[..., colours] *= pixels[..., [alpha]]
    return Picture(pixels, alpha, dtype, spec)


def write_picture(path: str | os.PathLike, picture: Picture) -> None:
    """Write a still in the format that the name's ending says, whole or not at all.

    The number type is the picture's own where the format has it, else the format's default; alpha is
    dropped (over black) where the format has none.

    Raises:
        PictureError: unknown ending, or the file cannot be written.
    """
    import OpenImageIO as oiio

    path = Path(path)
    ending = path.suffix.lower()
    check_ending(path)
    dtype = picture.dtype if picture.dtype in _WRITES[ending] else _WRITES[ending][0]
    linear = dtype in _LINEAR
    stored, alpha = encode(picture, dtype, linear, ending not in _WITHOUT_ALPHA)
    spec = oiio.ImageSpec(picture.metadata) if picture.metadata is not None else oiio.ImageSpec()
    spec.width, spec.height, spec.depth = picture.width, picture.height, 1
    spec.full_width, spec.full_height = picture.width, picture.height
    spec.x = spec.y = spec.full_x = spec.full_y = 0
    spec.tile_width = spec.tile_height = spec.tile_depth = 0
    spec.nchannels = stored.shape[2]
    spec.default_channel_names()
    spec.set_format(oiio.TypeDesc(dtype))
    spec.alpha_channel = -1 if alpha is None else alpha
    for name in ("oiio:UnassociatedAlpha", "oiio:ColorSpace", "compression"):
        spec.erase_attribute(name)
    if alpha is not None and not linear:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    with whole_file(path) as temporary:
        out = oiio.ImageOutput.create(str(temporary))
        if out is None:
            raise PictureError(f"{path}: cannot be written ({_first_line(oiio.geterror())})")
        done = out.open(str(temporary), spec) and out.write_image(np.ascontiguousarray(stored))
        message = out.geterror()
        if not (out.close() and done):
            raise PictureError(f"{path}: cannot be written ({_first_line(message or out.geterror())})")


def encode(picture: Picture, dtype: str, linear: bool, with_alpha: bool) -> tuple[np.ndarray, int | None]:
    """A picture's numbers as a file stores them, and which channel is alpha.

    In linear files alpha stays premultiplied; in display files it is divided out first.
    """
    pixels, alpha = picture.pixels, picture.alpha
    if alpha is not None and not with_alpha:
        pixels, alpha = np.delete(pixels, alpha, axis=2), None
    kind = _NUMPY[dtype]
    if linear or alpha is None:
        return colour.encode(pixels, kind, srgb=not linear), alpha
    opacity = pixels[..., [alpha]]
    straight = np.divide(pixels, opacity, out=np.zeros_like(pixels), where=opacity > 0)
    stored = colour.encode(straight, kind, srgb=True)
    stored[..., alpha] = colour.encode(pixels[..., alpha], kind, srgb=False)
    return stored, alpha


def check_ending(path: Path) -> None:
    """Refuse a name whose ending is no still format.

    Raises:
        PictureError: with the list of endings.
    """
    if path.suffix.lower() not in _WRITES:
        raise PictureError(f"{path}: unknown picture format {path.suffix!r}; known: {', '.join(_WRITES)}")


class whole_file:
    """A temporary name in the same folder, renamed to `path` on success and removed on failure."""

    def __init__(self, path: Path):
        self.path = path
        self.temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")

    def __enter__(self) -> Path:
        return self.temporary

    def __exit__(self, kind, error, trace) -> None:
        if kind is None:
            os.replace(self.temporary, self.path)
        else:
            self.temporary.unlink(missing_ok=True)


def _dtype_of(format_name: str) -> str:
    if format_name in DTYPES:
        return format_name
    return {"double": "float", "int8": "uint8", "int16": "uint16"}.get(format_name, "uint16")


def _first_line(message: str) -> str:
    return message.strip().splitlines()[0] if message.strip() else "no reason given"
