"""Refusals of pictures by their headers, before memory is allocated, in sentences of one form."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wfluid.domain.limits import CHANNEL_LIMIT, SIDE_LIMIT
from wfluid.pictures.formats import PictureError, first_line
from wfluid.system.memory import readable_size

_READING = 12
"""Bytes of memory that reading takes for each number of a picture."""

_SIZE = re.compile(r"(?:dimension|appears to be) (\d+)x(\d+)")
_MOST = re.compile(r"may not exceed (\d+)x")
_CHANNELS = re.compile(r"(\d+)(?: channels exceeds|-channel images)")
_SIDE = re.compile(r"Maximum supported image dimension|invalid image (?:width|height)|Invalid display window")
_MEMORY = re.compile(r"image size ([\d.]+) MB exceeds")
_SHORT = re.compile(r"header claims a (\d+) MB image from a (\d+) byte file")
_SHORT_TGA = re.compile(r"claims image size (\d+) bytes, implausible for (\d+) bytes")


@contextmanager
def own_limits(oiio: Any, memory: int) -> Iterator[None]:
    """A context with this program's limits in place of those of OpenImageIO, which belong to the process.

    They are checked as a file is opened, where some formats are decoded already. `memory` is what is free
    [bytes]; numbers of at most 4 bytes are expected.
    """
    limits = {
        "limits:resolution": SIDE_LIMIT,
        "limits:channels": CHANNEL_LIMIT,
        "limits:imagesize_MB": max(memory * 4 // _READING >> 20, 1),
    }
    kept = {name: oiio.get_int_attribute(name) for name in limits}
    for name, limit in limits.items():
        oiio.attribute(name, limit)
    try:
        yield
    finally:
        for name, limit in kept.items():
            oiio.attribute(name, limit)


def check_size(path: Path, size: tuple[int, ...], channels: int) -> None:
    """Check width, height, perhaps depth, and the number of channels of a picture.

    Raises:
        PictureError: one out of range; the message states the range.
    """
    width, height, *depth = size
    if not (1 <= width <= SIDE_LIMIT and 1 <= height <= SIDE_LIMIT and depth in ([], [1])):
        shown = " x ".join(map(str, size if depth != [1] else size[:2]))
        raise PictureError(f"{path}: {shown} pixels; sides of 1 … {SIDE_LIMIT} can be read")
    if channels > CHANNEL_LIMIT:
        raise PictureError(f"{path}: {channels} channels; at most {CHANNEL_LIMIT} can be read")


def check_memory(path: Path, size: tuple[int, int], channels: int, memory: int) -> None:
    """Check that a picture of a width, a height and a number of channels can be read in the free memory.

    Raises:
        PictureError: it needs more; the message says how much.
    """
    need = _READING * size[0] * size[1] * max(channels, 1)
    if need > memory:
        raise _too_large(path, f"{size[0]} x {size[1]} pixels need about {readable_size(need)}", memory)


def check_jpeg2000(path: Path, memory: int) -> None:
    """Check the size of a JPEG 2000, if the file is one, before it is opened: then it is decoded.

    The size stands in the segment SIZ (ISO 15444-1, A.5.1), as the corners of the picture on a canvas.

    Raises:
        PictureError: as `check_size` and `check_memory`; the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            head = file.read(1 << 16)
    except OSError as error:
        raise PictureError(f"{path}: cannot be read ({error.strerror})") from None
    at = head.find(b"\xff\x4f\xff\x51")
    if at < 0 or not (at == 0 or head[4:8] == b"jP  ") or len(head) < at + 42:
        return
    right, bottom, left, top = struct.unpack(">4I", head[at + 8 : at + 24])
    (channels,) = struct.unpack(">H", head[at + 40 : at + 42])
    if right > left and bottom > top:
        check_size(path, (right - left, bottom - top), channels)
        check_memory(path, (right - left, bottom - top), channels, memory)


def _too_large(path: Path, need: str, memory: int) -> PictureError:
    free = readable_size(memory)
    return PictureError(f"{path}: {need} of memory, {free} are free; make the picture smaller first")


def refusal(path: Path, message: str, memory: int) -> PictureError:
    """The error of a file that OpenImageIO does not open, from its message; `memory` is what is free."""
    if claimed := _SIZE.search(message):
        width, height = int(claimed[1]), int(claimed[2])
        most = _MOST.search(message)
        limit = min(SIDE_LIMIT, int(most[1])) if most else SIDE_LIMIT
        return PictureError(f"{path}: {width} x {height} pixels; sides of 1 … {limit} can be read")
    if claimed := _CHANNELS.search(message):
        return PictureError(f"{path}: {claimed[1]} channels; at most {CHANNEL_LIMIT} can be read")
    if _SIDE.search(message):
        return PictureError(f"{path}: its header names a size beyond what its format holds; it is damaged")
    if claimed := _MEMORY.search(message):
        least = readable_size(float(claimed[1]) * _READING / 4 * (1 << 20))
        return _too_large(path, f"its pixels need more than {least}", memory)
    for pattern, unit in ((_SHORT, 1 << 20), (_SHORT_TGA, 1)):
        if claimed := pattern.search(message):
            need, there = readable_size(int(claimed[1]) * unit), readable_size(int(claimed[2]))
            return PictureError(f"{path}: its header claims {need} of pixels, the file has {there}: damaged")
    return PictureError(f"{path}: not a picture that can be read ({first_line(message)})")


def message_of(library: Any) -> str:
    """OpenImageIO's message, which cannot be decoded if it quotes bytes of a damaged file."""
    try:
        return library.geterror()
    except UnicodeDecodeError:
        return "invalid file structure"
