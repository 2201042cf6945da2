"""The numbers of a picture's file, brought to one convention: which are colours, and which is alpha.

OpenImageIO returns what each format stores. Formats differ in alpha (straight or premultiplied, of one bit,
unused) and in what they hold besides one picture: pages, frames, thumbnails, samples in depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wfluid.domain.limits import TYPES
from wfluid.pictures.formats import LINEAR, PictureError, first_line
from wfluid.pictures.profiles import Profile, read_profile
from wfluid.pictures.refusals import (
    check_jpeg2000,
    check_memory,
    check_size,
    message_of,
    own_limits,
    refusal,
)
from wfluid.system.memory import free_memory
from wfluid.system.quiet import quiet_libraries

STRAIGHT = ("jpeg2000", "jpegxl", "bmp", "gif", "dds", "dpx")
"""Formats of straight alpha, whose readers in OpenImageIO leave it to be taken for premultiplied."""

SPARE = ("bmp", "targa", "ico")
"""Formats whose fourth byte may be padding, which is 0 all over."""

PAGES = ("ico", "tiff")
"""Formats whose files hold pictures of several sizes, of which the largest is read."""

ONE = ("psd",)
"""Formats whose further pictures are parts of the first."""

_ALPHA_OF_TARGA = 3
"""Least attribute of a TGA's extension area that says that it has alpha (TGA 2.0, field 24)."""

_WIDE = ("uint", "uint32", "int", "int32")
"""Names of integers of 32 bits."""


@dataclass(frozen=True)
class Stored:
    """The numbers of a file, before any conversion."""

    numbers: np.ndarray
    """(height, width, channels), of the type `dtype`."""
    dtype: str
    """One of `TYPES`."""
    alpha: int | None
    """Index of the alpha channel."""
    straight: bool
    """Whether colours are not multiplied by alpha."""
    integers: bool
    """Whether the file holds integers, which are sRGB unless something else is known."""
    data: bool
    """Whether the numbers are no colours."""
    profile: Profile | None
    """Colour space of the numbers, where it is neither sRGB nor unknown."""
    spec: Any
    """The OpenImageIO `ImageSpec`, without what holds for this file alone."""
    notes: tuple[str, ...]
    """What a user should know of the file."""


def read_stored(path: Path, colorspace: str) -> Stored:
    """Read the numbers of a file; 32-bit integers with no given `colorspace` are read as they are.

    Raises:
        PictureError: a file that is missing, unreadable, damaged, deep or too large for the memory.
    """
    import OpenImageIO as oiio

    if not path.is_file():
        why = "is a folder, not a picture" if path.is_dir() else "no such picture"
        raise PictureError(f"{path}: {why}")
    if path.stat().st_size == 0:
        raise PictureError(f"{path}: the file is empty")
    memory = free_memory()
    check_jpeg2000(path, memory)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    notes: list[str] = []
    with quiet_libraries(), own_limits(oiio, memory):
        source = oiio.ImageInput.open(str(path), hints)
        if source is None:
            raise refusal(path, message_of(oiio), memory)
        try:
            page = _page(source.format_name(), oiio.ImageInput.open(str(path)), notes)
            source.seek_subimage(page, 0)
            if source.format_name() == "png" and _is_animated(path):
                notes.append(_FIRST)
            spec = source.spec()
            _check(path, source.format_name(), spec, memory)
            dtype = _type_of(str(spec.format))
            raw = _raw_channels(source.format_name(), spec) if colorspace in ("auto", "data") else []
            stored = source.read_image(page, 0, 0, spec.nchannels, dtype)
            counts = {n: source.read_image(page, 0, n, n + 1, kind) for n, kind in raw}
            message = message_of(source)
            kind = source.format_name()
        finally:
            source.close()
    if stored is None or message or any(count is None for count in counts.values()):
        raise PictureError(f"{path}: damaged or cut off ({first_line(message)})")
    stored = np.asarray(stored).reshape(spec.height, spec.width, spec.nchannels)
    if dtype == "half" and stored.dtype != np.float16:
        stored = stored.view(np.float16)
    for n, count in counts.items():
        stored[..., n] = np.asarray(count).reshape(spec.height, spec.width)
    if counts:
        notes.append("32-bit integers are read as they are, as numbers without a range")
    alpha = _alpha(spec)
    data = len(counts) == spec.nchannels
    if alpha is not None and spec.nchannels == 1:
        alpha, data = None, True
        notes.append("it holds alpha alone, which is read as numbers, not as colours")
    integers = dtype not in LINEAR or str(spec.format) in _WIDE
    straight = kind in STRAIGHT or bool(spec.get_int_attribute("oiio:UnassociatedAlpha"))
    stated = spec.get_int_attribute("targa:alpha_type") >= _ALPHA_OF_TARGA
    if alpha is not None and kind in SPARE and not stated and not stored[..., alpha].any():
        stored, alpha = np.delete(stored, alpha, axis=2), None
        notes.append("its alpha is 0 all over, so the picture is taken as opaque")
    colors = stored.shape[2] - (alpha is not None)
    profile = _profile(spec, colors, dtype, colorspace, notes)
    _forget(spec, kind, alpha)
    return Stored(stored, dtype, alpha, straight, integers, data, profile, spec, tuple(notes))


def _page(kind: str, probe: Any, notes: list[str]) -> int:
    """The index of the picture of a file that is read: the largest page, or the first frame.

    `probe` is the file opened once more: some readers do not turn back from the second picture to the first.
    """
    if kind in ONE or probe is None or not probe.seek_subimage(1, 0):
        return 0
    if kind not in PAGES:
        notes.append(_FIRST)
        return 0
    sizes: list[tuple[int, int]] = []
    while probe.seek_subimage(len(sizes), 0):
        sizes.append((probe.spec().width, probe.spec().height))
    page = max(range(len(sizes)), key=lambda n: sizes[n][0] * sizes[n][1])
    width, height = sizes[page]
    notes.append(f"picture {page + 1} of {len(sizes)} in it, {width} x {height} pixels, is read: the largest")
    return page


_FIRST = "the first of several pictures in the file is read, without the others"


def _is_animated(png: Path) -> bool:
    """Whether a PNG has a chunk of animation, which is before its first picture (PNG 3, section 11.3.6.1)."""
    with png.open("rb") as file:
        return b"acTL" in file.read(1 << 16).partition(b"IDAT")[0]


def _check(path: Path, kind: str, spec: Any, memory: int) -> None:
    """Check kind and size of a picture before memory is allocated.

    Raises:
        PictureError: no picture, samples in depth, a size out of range, or one that exceeds the free memory.
    """
    if kind == "null":  # OpenImageIO's black picture for every file of this name
        raise PictureError(f"{path}: not a picture; files of this name hold nothing")
    if spec.deep:
        raise PictureError(f"{path}: a deep picture, with samples in depth; flatten it first")
    check_size(path, (spec.width, spec.height, spec.depth), spec.nchannels)
    check_memory(path, (spec.width, spec.height), spec.nchannels, memory)


def _type_of(format_name: str) -> str:
    if format_name in TYPES:
        return format_name
    wide = dict.fromkeys(_WIDE, "float")
    return {"double": "float", "int8": "uint8", **wide}.get(format_name, "uint16")


def _raw_channels(kind: str, spec: Any) -> list[tuple[int, str]]:
    """Channels of 32-bit integers that are numbers, not a range from 0 to 1, each with its type.

    OpenEXR has no other integers. In other formats colours may be integers of 32 bits; one or two
    channels of them are measurements or labels.
    """
    formats = [str(one) for one in spec.channelformats] or [str(spec.format)] * spec.nchannels
    found = [(n, name) for n, name in enumerate(formats) if name in _WIDE]
    return found if kind == "openexr" or spec.nchannels < 3 else []


def _alpha(spec: Any) -> int | None:
    """Index of the alpha channel; of a GIF OpenImageIO's index is wrong, but not the name."""
    if spec.alpha_channel < 0:
        return None
    if spec.alpha_channel < spec.nchannels:
        return spec.alpha_channel
    return spec.channelnames.index("A") if "A" in spec.channelnames else None


def _profile(spec: Any, colors: int, dtype: str, colorspace: str, notes: list[str]) -> Profile | None:
    """The colour space that the file's ICC profile says, unless a `colorspace` is given.

    The profile stays in the file's metadata if it holds for the numbers of frames.
    """
    data = spec.get("ICCProfile")
    if data is None:
        return None
    try:
        profile = read_profile(np.asarray(data, dtype=np.uint8).tobytes(), colors)
    except ValueError as error:
        notes.append(f"its colour profile {error}: it is left out")
        profile = None
    if profile is None or colorspace != "auto" or (profile.is_srgb and dtype in LINEAR):
        spec.erase_attribute("ICCProfile.*")
        return None
    return None if profile.is_srgb else profile


def _forget(spec: Any, kind: str, alpha: int | None) -> None:
    """Remove from a spec what no other file may take over."""
    spec.alpha_channel = -1 if alpha is None else alpha
    if kind != "dpx":  # the bits of a DPX belong to what it is
        spec.erase_attribute("oiio:BitsPerSample")
    if kind != "openexr":  # elsewhere an offset is a place on paper
        spec.x = spec.y = spec.full_x = spec.full_y = 0
        spec.full_width, spec.full_height = spec.width, spec.height
