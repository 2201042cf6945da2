"""Refusals of pictures by their headers, before memory is allocated, in sentences of one form."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wfluid.domain.limits import CHANNEL_LIMIT, SIDE_LIMIT
from wfluid.pictures.formats import PictureError, first_line
from wfluid.system.memory import readable_size

_LIMITS = {
    "limits:resolution": SIDE_LIMIT,
    "limits:channels": CHANNEL_LIMIT,
    "limits:imagesize_MB": 0,  # the free memory is the limit, which is checked after the header
}
"""OpenImageIO's own limits, which are checked as it opens a file."""

_SIZE = re.compile(r"(?:dimension|appears to be) (\d+)x(\d+)")
_MOST = re.compile(r"may not exceed (\d+)x")
_CHANNELS = re.compile(r"(\d+)(?: channels exceeds|-channel images)")
_SIDE = re.compile(r"Maximum supported image dimension|invalid image (?:width|height)|Invalid display window")
_SHORT = re.compile(r"header claims a (\d+) MB image from a (\d+) byte file")
_SHORT_TGA = re.compile(r"claims image size (\d+) bytes, implausible for (\d+) bytes")


@contextmanager
def own_limits(oiio: Any) -> Iterator[None]:
    """A context with this program's limits in place of those of OpenImageIO, which belong to the process."""
    kept = {name: oiio.get_int_attribute(name) for name in _LIMITS}
    for name, limit in _LIMITS.items():
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


def refusal(path: Path, message: str) -> PictureError:
    """The error of a file that OpenImageIO does not open, from its message."""
    if claimed := _SIZE.search(message):
        width, height = int(claimed[1]), int(claimed[2])
        most = _MOST.search(message)
        limit = min(SIDE_LIMIT, int(most[1])) if most else SIDE_LIMIT
        return PictureError(f"{path}: {width} x {height} pixels; sides of 1 … {limit} can be read")
    if claimed := _CHANNELS.search(message):
        return PictureError(f"{path}: {claimed[1]} channels; at most {CHANNEL_LIMIT} can be read")
    if _SIDE.search(message):
        return PictureError(f"{path}: its header names a size beyond what its format holds; it is damaged")
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
