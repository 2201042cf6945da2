"""Warp's folder of compiled kernels: damaged files are found before they are run, and built again."""

from __future__ import annotations

import hashlib
import shutil
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from wfluid.system.atomic import atomic_write_text
from wfluid.system.quiet import quiet_libraries

_SUMS = "wfluid.sha256"
_SOURCES = (".cpp", ".cu")

_LOADED: set[Path] = set()
"""Folders whose kernels this process has loaded."""

Loaded = TypeVar("Loaded")


def load_intact(folder: Path, load: Callable[[], Loaded]) -> Loaded:
    """What `load` returns, which loads compiled kernels from `folder`, or builds them there.

    A damaged folder is removed first, with a warning: its machine code might crash the process. Checksums
    are kept in the folder. A folder without them is trusted, unless `load` fails.
    """
    if folder in _LOADED:
        return load()
    built = folder.exists()
    if built and not _intact(folder):
        _remove(folder)
        built = False
    if not built:
        loaded = load()
    else:
        try:
            with quiet_libraries():
                loaded = load()
        except Exception:
            _remove(folder)
            loaded = load()
    with suppress(OSError):
        sums = _sums(folder)
        if sums != _kept(folder):
            atomic_write_text(folder / _SUMS, "".join(f"{sums[name]}  {name}\n" for name in sorted(sums)))
    _LOADED.add(folder)
    return loaded


def _intact(folder: Path) -> bool:
    """Whether every compiled file has the checksum that is kept for it, if any."""
    try:
        kept = _kept(folder)
        return all(kept.get(name, digest) == digest for name, digest in _sums(folder).items())
    except (OSError, ValueError):
        return False


def _kept(folder: Path) -> dict[str, str]:
    try:
        lines = (folder / _SUMS).read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return {}
    return {name: digest for digest, name in (line.split("  ", 1) for line in lines)}


def _sums(folder: Path) -> dict[str, str]:
    """Checksum by name of the files that are loaded."""
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.iterdir()
        if path.name != _SUMS and path.suffix not in _SOURCES and not path.name.startswith(".")
    }


def _remove(folder: Path) -> None:
    warnings.warn(f"the compiled kernels in {folder} are damaged: they are built again", stacklevel=2)
    if folder.is_dir() and not folder.is_symlink():
        shutil.rmtree(folder, ignore_errors=True)
    else:
        folder.unlink()
