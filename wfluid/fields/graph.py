"""Captured graphs: launches recorded once, replayed by one thread or several."""

from __future__ import annotations

import threading
from collections.abc import Callable

import warp as wp

from wfluid.fields.arrays import read
from wfluid.kernels.cell.lock import LAUNCHES
from wfluid.kernels.cell.program import strips
from wfluid.kernels.cell.strips import GIVEN_UP, STRIP, Strip
from wfluid.system.threads import ThreadTeam

_PATIENCE = 10.0
"""Longest time that an interrupted replay waits for its helper threads to end [s]."""


class CapturedGraph:
    """The launches of `work`, captured once, replayed by one thread or by several that share the rows.

    The calling thread replays the first strip, the threads of `pool` the others; the pool must have no other
    work. Without a pool the calling thread replays everything.
    """

    def __init__(self, device: wp.Device, work: Callable[[], None], pool: ThreadTeam | None):
        self._pool = pool
        self._strips = strips(pool.count + 1, device) if pool else []
        self._graphs = [_captured(device, work, strip) for strip in self._strips or [None]]

    def launch(self) -> None:
        """Replay the graph, and return when all threads have replayed their part."""
        if self._pool is None:
            wp.capture_launch(self._graphs[0])
        else:
            self._launch_together(self._pool)

    def _launch_together(self, pool: ThreadTeam) -> None:
        try:
            others = [pool.submit(wp.capture_launch, graph) for graph in self._graphs[1:]]
            wp.capture_launch(self._graphs[0])
            for other in others:
                other.result()
        except (
            BaseException
        ):  # interrupted: threads that wait at a barrier for this one must not wait for ever
            self._give_up(pool)
            raise

    def _give_up(self, pool: ThreadTeam) -> None:
        """Open all barriers, so that waiting strips run to their end, with wrong results; then reset them."""
        counter = read(self._strips[0].counter)
        counter[GIVEN_UP] = 1
        idle = threading.Barrier(len(self._graphs))  # passed when every helper thread has ended its work
        for _ in self._graphs[1:]:
            pool.submit(idle.wait)
        try:
            idle.wait(_PATIENCE)
        finally:  # also where a helper thread was too late, or this thread is interrupted again
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
