"""The compute device: chosen once, opened quietly, kernels compiled with the time they took."""

from __future__ import annotations

import time
from pathlib import Path

import warp as wp

from wfluid.kernels.cell.lock import exclusive
from wfluid.kernels.cell.program import FORWARD, module_of
from wfluid.system.stderr import quiet_stderr


class DeviceError(ValueError):
    """A device that this machine does not have."""


def open_device(name: str | None = None) -> wp.Device:
    """The device called `name`: "cpu", "cuda", "cuda:1", …; the CPU by default.

    Raises:
        DeviceError: no such device here; the message lists what there is.
    """
    wp.config.log_level = max(wp.config.log_level, wp.LOG_ERROR)
    with quiet_stderr():
        wp.init()
    try:
        return wp.get_device(name or "cpu")
    except (ValueError, RuntimeError) as error:
        there = ", ".join(device.alias for device in wp.get_devices())
        raise DeviceError(f"device {name!r} is not available here; there is: {there}") from error


def kernels_are_built(device: wp.Device) -> bool:
    """Whether Warp's cache holds the kernels for `device`, so that loading them takes no compiler."""
    module = module_of(_kind(device))
    return (Path(wp.config.kernel_cache_dir) / module.get_module_identifier(_threads(device))).is_dir()


@exclusive
def load_kernels(device: wp.Device, module: str = FORWARD) -> float:
    """Load every kernel of a module for `device`, compiling them first if need be; the seconds it took.

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
    """Threads a block, as `wp.launch` takes them: part of what a module is compiled for."""
    return 256 if device.is_cuda else 1
