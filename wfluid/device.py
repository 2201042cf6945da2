"""The compute device: chosen once, opened quietly, kernels compiled with the time they took."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import wraps
from pathlib import Path

import warp as wp

from wfluid.files import quiet_stderr
from wfluid.kernels.cells import FORWARD, module_of, strips
from wfluid.kernels.strips import GIVEN_UP, STRIP, Strip

LAUNCHES = threading.RLock()
"""Held by whatever calls Warp but for replays: a capture takes in what any thread allocates or launches."""


def exclusive(method: Callable) -> Callable:
    """Hold `LAUNCHES` while `method` runs."""

    @wraps(method)
    def held(*arguments, **settings):
        with LAUNCHES:
            return method(*arguments, **settings)

    return held


_PATIENCE = 10.0
"""How long an interrupted replay waits for its helpers to end [s]."""


class Replay:
    """The launches of `work`, captured once, replayed by several threads that share their rows.

    The calling thread is one of them, `pool`, which must have no other work, has the others.
    """

    def __init__(self, device: wp.Device, work: Callable[[], None], pool: Helpers | None):
        self._pool = pool
        self._strips = strips(pool.count + 1, device) if pool else [None]
        self._graphs = [_captured(device, work, strip) for strip in self._strips]

    def launch(self) -> None:
        """Run it."""
        try:
            others = [self._pool.submit(wp.capture_launch, graph) for graph in self._graphs[1:]]
            wp.capture_launch(self._graphs[0])
            for other in others:
                other.result()
        except BaseException:  # interrupted: whoever waits for this thread must not do so for ever
            if self._pool:
                self._give_up()
            raise

    def _give_up(self) -> None:
        """Let strips that wait go on to their end, whatever they compute; then forget the meetings."""
        counter = self._strips[0].counter.numpy()
        counter[GIVEN_UP] = 1
        idle = threading.Barrier(len(self._graphs))  # reached when every helper has done what it had
        for _ in self._graphs[1:]:
            self._pool.submit(idle.wait)
        try:
            idle.wait(_PATIENCE)
        finally:  # whoever came late, or is interrupted again
            idle.abort()
            counter[:] = 0


def _captured(device: wp.Device, work: Callable[[], None], strip: Strip | None) -> wp.Graph:
    with LAUNCHES, wp.ScopedCapture(device=device) as captured:
        token = STRIP.set(strip)
        try:
            work()
        finally:
            STRIP.reset(token)
    return captured.graph


class Helpers:
    """The threads beside the calling one. A forked process, which inherits none, gets its own."""

    count: int
    """How many there are."""

    def __init__(self, count: int):
        self.count = count
        self._process, self._pool = os.getpid(), ThreadPoolExecutor(count)

    def submit(self, work: Callable, *arguments) -> Future:
        """Have one of them do `work`."""
        if self._process != os.getpid():
            self._process, self._pool = os.getpid(), ThreadPoolExecutor(self.count)
        return self._pool.submit(work, *arguments)


def helpers(threads: int) -> Helpers | None:
    """The helpers for so many threads; None where the calling one is alone."""
    return Helpers(threads - 1) if threads > 1 else None


def free_cores() -> int:
    """Cores that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


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
