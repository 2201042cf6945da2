"""Checks of the names that files are written to."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from wfluid.system.errors import FileError

NAME_LIMIT = 255
"""Longest name of a file on common file systems [bytes]."""

_WRITABLE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


def target_of(path: Path, error: type[FileError] = FileError) -> Path:
    """The file that is written for a path: symbolic links are followed. Nothing is written or removed.

    Raises:
        FileError: a name that is too long, a folder that does not exist or cannot be written to, a path that
            is a folder, a pipe or a device, or a file that is read-only. `error` replaces the type.
    """
    try:
        target = path.resolve()
        kind = target.stat().st_mode if os.path.lexists(target) else None
    except (OSError, RuntimeError) as failure:
        why = getattr(failure, "strerror", None) or "a link that leads to itself"
        raise error(f"{path}: cannot be written ({why})") from None
    folder, size = target.parent, len(os.fsencode(target.name))
    if not folder.is_dir():
        raise error(f"{folder}: no such folder; make it first")
    if size > (longest := _longest_name(folder)):
        raise error(f"{path}: a name of {size} bytes; {longest} are possible here")
    if kind is not None and stat.S_ISDIR(kind):
        raise error(f"{path}: a folder; name a file in it")
    if kind is not None and not stat.S_ISREG(kind):
        raise error(f"{path}: a pipe or a device; name a file")
    if kind is not None and not (kind & _WRITABLE and os.access(target, os.W_OK)):
        raise error(f"{path}: this file is read-only; make it writable, or write to another name")
    if not os.access(folder, os.W_OK):
        raise error(f"{folder}: this folder cannot be written to")
    return target


def _longest_name(folder: Path) -> int:
    """Longest name of a file in a folder [bytes]."""
    try:
        return os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):
        return NAME_LIMIT
