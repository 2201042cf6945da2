"""Helper threads, and the number of cores available to them."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class ThreadTeam:
    """Helper threads of the calling thread. A forked process inherits no threads and starts new ones."""

    count: int
    """Number of helper threads."""

    def __init__(self, count: int):
        self.count = count
        self._process, self._pool = os.getpid(), ThreadPoolExecutor(count)

    def submit(self, work: Callable, *arguments) -> Future:
        """Run `work` in a helper thread; returns its future result."""
        if self._process != os.getpid():
            self._process, self._pool = os.getpid(), ThreadPoolExecutor(self.count)
        return self._pool.submit(work, *arguments)


def helpers(threads: int) -> ThreadTeam | None:
    """The helpers for a total number of threads; None for a single thread."""
    return ThreadTeam(threads - 1) if threads > 1 else None


def free_cores() -> int:
    """Number of cores that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1
