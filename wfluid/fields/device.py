"""The compute device: opens it, and loads its kernels."""

from __future__ import annotations

import time
from pathlib import Path

import warp as wp

from wfluid.fields.kernel_cache import load_intact
from wfluid.kernels.cell.lock import exclusive
from wfluid.kernels.cell.program import FORWARD, module_of
from wfluid.system.quiet import quiet_libraries


class DeviceError(ValueError):
    """The machine has no such device."""


def open_device(name: str | None = None) -> wp.Device:
    """The device called `name`: "cpu", "cuda", "cuda:1", …; the CPU by default.

    Raises:
        DeviceError: the machine has no such device; the message lists its devices. Or there is no folder for
            compiled kernels.
    """
    wp.config.log_level = max(wp.config.log_level, wp.LOG_ERROR)
    try:
        with quiet_libraries():
            wp.init()
    except OSError as error:
        raise DeviceError(
            f"{error.filename}: the folder of compiled kernels cannot be made ({error.strerror}); "
            "name another one in WARP_CACHE_PATH"
        ) from error
    try:
        with quiet_libraries():  # the driver's complaints, where there is none
            return wp.get_device(name or "cpu")
    except (ValueError, RuntimeError) as error:
        aliases = ", ".join(device.alias for device in wp.get_devices())
        raise DeviceError(f"device {name!r} is not available here; there is: {aliases}") from error


def kernels_are_built(device: wp.Device) -> bool:
    """Whether the cache of Warp holds the kernels for `device`, so that loading them does not compile."""
    return _folder(device, FORWARD).is_dir()


def _folder(device: wp.Device, module: str) -> Path:
    """The folder in the cache of Warp where the kernels of a module are, or will be."""
    name = module_of(_kind(device), module).get_module_identifier(_threads(device))
    return Path(str(wp.config.kernel_cache_dir)) / name


@exclusive
def load_kernels(device: wp.Device, module: str = FORWARD) -> float:
    """Load the kernels of a module for `device`; returns the time taken [s].

    They are compiled if the cache lacks them, or if the files in the cache are damaged.

    Raises:
        RuntimeError: the kernels do not compile for this device, or the cache cannot be written to.
    """
    start = time.perf_counter()
    program = module_of(_kind(device), module)
    try:
        loaded = load_intact(_folder(device, module), lambda: program.load(device, _threads(device)))
    except OSError as error:
        raise RuntimeError(
            f"{wp.config.kernel_cache_dir}: the kernels cannot be kept here ({error.strerror}); "
            "name another folder in WARP_CACHE_PATH"
        ) from error
    except Exception as error:  # Warp's are bare
        raise RuntimeError(f"the kernels could not be built for {device.alias} ({error})") from error
    if loaded is None:
        raise RuntimeError(f"the kernels could not be built for {device.alias}")
    return time.perf_counter() - start


def _kind(device: wp.Device) -> str:
    return "cuda" if device.is_cuda else "cpu"


def _threads(device: wp.Device) -> int:
    """Threads per block, as in `wp.launch`; modules are compiled for it."""
    return 256 if device.is_cuda else 1
