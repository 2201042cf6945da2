"""Threads beside the calling one, and how many cores there are for them."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class ThreadTeam:
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


def helpers(threads: int) -> ThreadTeam | None:
    """The helpers for so many threads; None where the calling one is alone."""
    return ThreadTeam(threads - 1) if threads > 1 else None


def free_cores() -> int:
    """Cores that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1
