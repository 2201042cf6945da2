"""Formats of stills: the number types, channels and encodings of each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from wfluid.domain.checks import check_word
from wfluid.domain.limits import QUALITY_LIMIT, TYPES
from wfluid.system.errors import FileError

LARGEST = 65504.0
"""Largest number of type half. It replaces infinite values on reading, which filters would turn into NaN."""

NUMPY = {"uint8": "uint8", "uint16": "uint16", "half": "float16", "float": "float32"}
WRITES = {
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
"""Formats that stills are written in, and the number types of each, the default first."""

CHANNELS = {
    ".jpg": (1, 3),
    ".jpeg": (1, 3),
    ".hdr": (3,),
    ".bmp": (1, 3),
    ".png": (1, 2, 3, 4),
    ".webp": (3, 4),
    ".tga": (1, 3, 4),
    ".dpx": (1, 3, 4),
}
"""Numbers of channels that a format holds, where they are limited; 2 and 4 include alpha."""

PROFILES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
"""Formats that hold ICC profiles."""

POSITIVE = (".hdr",)
"""Formats of light that hold no negative values: RGBE has no sign."""

WINDOWS = (".exr",)
"""Formats that hold a display window beside the data's."""

_COMPRESSIONS = {
    ".exr": ("none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"),
    ".tif": ("none", "lzw", "zip", "packbits"),
    ".tiff": ("none", "lzw", "zip", "packbits"),
}

QUALITIES = {".jpg": "jpeg", ".jpeg": "jpeg", ".webp": "webp"}

LINEAR = ("half", "float")
"""Number types that hold linear light; the others hold sRGB."""


class PictureError(FileError):
    """A picture that cannot be read or written; the message names the file, the reason and the remedy."""


@dataclass(frozen=True)
class Encoding:
    """How a still is written; None leaves a setting to the picture and the format.

    Raises:
        PictureError: a value that no format supports.
    """

    type: str | None = None
    """Number type: one of `TYPES`."""
    compression: str | None = None
    """Lossless or lossy method, for EXR and TIFF."""
    quality: int | None = None
    """1 … 100, for JPEG and WebP."""
    background: tuple[float, float, float] | None = None
    """Colour behind a transparent picture in files without alpha, in linear light; None for black."""

    def __post_init__(self) -> None:
        if self.type is not None:
            check_word("type", self.type, TYPES, PictureError)
        known = sorted({name for names in _COMPRESSIONS.values() for name in names})
        if self.compression is not None:
            check_word("compression", self.compression, known, PictureError)
        if self.quality is not None and not 1 <= self.quality <= QUALITY_LIMIT:
            raise PictureError(f"quality {self.quality}: expected 1 … {QUALITY_LIMIT}")

    def check(self, path: Path) -> None:
        """Check the settings against the format of `path`.

        Raises:
            PictureError: an unknown ending, or an unsupported setting; the message lists the supported ones.
        """
        ending = path.suffix.lower()
        if ending not in WRITES:
            raise PictureError(f"{path}: unknown picture format {path.suffix!r}; known: {', '.join(WRITES)}")
        if self.type is not None and self.type not in WRITES[ending]:
            raise PictureError(f"{path}: {ending} holds {' or '.join(WRITES[ending])}, not {self.type}")
        if self.compression is not None and self.compression not in _COMPRESSIONS.get(ending, ()):
            known = ", ".join(_COMPRESSIONS.get(ending, ())) or "no choice of compression"
            raise PictureError(
                f"{path}: compression {self.compression!r} is not for {ending}: it has {known}"
            )
        if self.quality is not None and ending not in QUALITIES:
            raise PictureError(f"{path}: {ending} has no quality; {', '.join(QUALITIES)} have")

    def check_movie(self, path: Path) -> None:
        """Check that nothing is set that GIFs and movies do not have.

        Raises:
            PictureError: a setting of stills; the message names it.
        """
        for name in ("type", "compression", "quality"):
            if getattr(self, name) is not None:
                kind = path.suffix.lower()
                raise PictureError(f"{path}: {kind} has no {name}; it is for stills, such as x.####.png")


def first_line(message: str) -> str:
    """The first line of a library's message, which may be empty."""
    return message.strip().splitlines()[0] if message.strip() else "no reason given"
