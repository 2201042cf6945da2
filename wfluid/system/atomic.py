"""Files that appear whole or not at all, native libraries that keep quiet, memory that is there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_PART = ".part"


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """A temporary name in the same folder, renamed to `path` on success and removed on failure."""
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{_PART}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of processes that were killed before they could."""
    for path in folder.glob(f".*{_PART}.*"):
        owner = path.name.removesuffix(path.suffix).removesuffix(_PART).rpartition(".")[2]
        if owner.isdigit() and not _alive(int(owner)):
            path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True
