"""Files in the formats of OpenImageIO, as bytes in memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wfluid.pictures.formats import PictureError, first_line
from wfluid.system.encoded import encoded
from wfluid.system.errors import WriteError
from wfluid.system.quiet import quiet_libraries

_IN_ORDER = (".png", ".jpg", ".jpeg", ".webp")
"""Formats that are written from beginning to end. On a failing disk, libjpeg ends the process, and libwebp
never returns."""

_SIDES = {".jpg": 65_500, ".jpeg": 65_500, ".webp": 16_383}
"""Longest sides where a format has a limit of its own [px]; beyond it, libjpeg ends the process."""

_HARMLESS = "failed TIFFWriteCustomDirectory() of the Exif data"
"""What OpenImageIO 3.2 says of every TIFF without Exif data."""


def file_bytes(path: Path, specs: Sequence, images: Sequence[np.ndarray]) -> bytes:
    """The file that holds images of given specs, in the format of the name's ending.

    Raises:
        PictureError: an image that the format cannot hold.
        WriteError: the file is larger than the system allows.
    """
    ending = path.suffix.lower()
    size = max(max(spec.width, spec.height) for spec in specs)
    if size > (longest := _SIDES.get(ending, size)):
        raise PictureError(f"{path}: a side of {size} pixels; {ending} has at most {longest}")
    try:
        with quiet_libraries():
            data = encoded(lambda name: _write(path, name, specs, images), in_order=ending in _IN_ORDER)
    except WriteError as error:
        raise WriteError(f"{path}: cannot be written ({error})") from None
    return _named(data, path) if ending == ".dpx" else data


def _write(path: Path, name: str, specs: Sequence, images: Sequence[np.ndarray]) -> None:
    """Write images to the file `name`, in the format of the ending of `path`.

    Raises:
        PictureError: OpenImageIO failed, or has a message of failure although it returned success.
    """
    import OpenImageIO as oiio

    oiio.attribute("tiff:half", 1)  # without it, half is written as float
    out = oiio.ImageOutput.create(f"x{path.suffix}")
    if out is None:
        raise PictureError(f"{path}: cannot be written ({first_line(oiio.geterror())})")
    done = out.open(name, specs[0]) if len(specs) == 1 else out.open(name, tuple(specs))
    for index, image in enumerate(images):
        done = done and (index == 0 or out.open(name, specs[index], "AppendSubimage"))
        done = done and out.write_image(np.ascontiguousarray(image))
    message = out.geterror()
    done = out.close() and done
    message += out.geterror().replace(_HARMLESS, "")
    if message.strip() or not done:
        raise PictureError(f"{path}: cannot be written ({first_line(message)})")


def _named(dpx: bytes, path: Path) -> bytes:
    """A DPX file with its own name in its header, 99 bytes at most (SMPTE 268M, field 8)."""
    name = path.name.encode()[:99]
    return dpx[:36] + name.ljust(100, b"\0") + dpx[136:]
