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
"""How long an interrupted replay waits for its helpers to end [s]."""


class CapturedGraph:
    """The launches of `work`, captured once, replayed by several threads that share their rows.

    The calling thread is one of them, `pool`, which must have no other work, has the others.
    """

    def __init__(self, device: wp.Device, work: Callable[[], None], pool: ThreadTeam | None):
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
        counter = read(self._strips[0].counter)
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
