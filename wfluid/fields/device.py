"""The compute device: opens it, and loads its kernels."""

from __future__ import annotations

import time
from pathlib import Path

import warp as wp

from wfluid.kernels.cell.lock import exclusive
from wfluid.kernels.cell.program import FORWARD, module_of
from wfluid.system.stderr import quiet_stderr


class DeviceError(ValueError):
    """The machine has no such device."""


def open_device(name: str | None = None) -> wp.Device:
    """The device called `name`: "cpu", "cuda", "cuda:1", …; the CPU by default.

    Raises:
        DeviceError: the machine has no such device; the message lists its devices.
    """
    wp.config.log_level = max(wp.config.log_level, wp.LOG_ERROR)
    try:
        with quiet_stderr():  # the driver's complaints, where there is none
            wp.init()
            return wp.get_device(name or "cpu")
    except (ValueError, RuntimeError) as error:
        aliases = ", ".join(device.alias for device in wp.get_devices())
        raise DeviceError(f"device {name!r} is not available here; there is: {aliases}") from error


def kernels_are_built(device: wp.Device) -> bool:
    """Whether the cache of Warp holds the kernels for `device`, so that loading them does not compile."""
    module = module_of(_kind(device))
    return (Path(str(wp.config.kernel_cache_dir)) / module.get_module_identifier(_threads(device))).is_dir()


@exclusive
def load_kernels(device: wp.Device, module: str = FORWARD) -> float:
    """Load the kernels of a module for `device`, compiled if the cache lacks them; returns the time taken
    [s].

    Raises:
        RuntimeError: the kernels do not compile for this device.
    """
    start = time.perf_counter()
    if module_of(_kind(device), module).load(device, _threads(device)) is None:
        raise RuntimeError(f"the kernels could not be built for {device.alias}")
    return time.perf_counter() - start


def _kind(device: wp.Device) -> str:
    return "cuda" if device.is_cuda else "cpu"


def _threads(device: wp.Device) -> int:
    """Threads per block, as in `wp.launch`; modules are compiled for it."""
    return 256 if device.is_cuda else 1
