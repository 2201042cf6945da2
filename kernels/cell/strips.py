"""Strips: the same launches replayed by several CPU threads at once, each on its part of the rows.

A graph is captured once a strip, with that strip current. A launch over many rows then takes this
strip's share of them; one over few (a coarse level, a sum) is left to the first strip. Before a launch
that may need what another strip wrote, all of them meet: a counter in shared memory that each raises and
then watches until all have. Every row is computed by the same code from the same values, so the bits do
not depend on the number of strips.

All strips of a step must be replayed together, each on a thread of its own, or the ones that are will
wait for ever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

import warp as wp
from wfluid.kernels.cell.lock import LAUNCHES

SHARED_LINES = 48
"""Rows from which on a launch is shared: fewer take less time than a meeting."""


ARRIVALS, GIVEN_UP = 0, 1
"""Entries of a counter: how often strips have come to a meeting, and whether one will never come."""


@wp.func_native("""
    // arrivals are counted for ever; a meeting is over when as many have come as make whole rounds
    unsigned int* arrivals = (unsigned int*)counter.data;
    unsigned int mine = __atomic_add_fetch(arrivals, 1u, __ATOMIC_ACQ_REL);
    unsigned int all = (mine + count - 1) / count * count;
    for (int waited = 0; (int)(__atomic_load_n(arrivals, __ATOMIC_ACQUIRE) - all) < 0; ++waited) {
        if (__atomic_load_n(arrivals + 1, __ATOMIC_RELAXED)) return;
    #if defined(__x86_64__)
        __builtin_ia32_pause();
    #elif defined(__aarch64__)
        __asm__ volatile("yield");
    #endif
    #if defined(__linux__)
        int sched_yield(void) __asm__("sched_yield");
        if (waited > 1000) sched_yield();  // another program needs this core
    #endif
    }
""")
def wait_for_all(counter: wp.array[wp.int32], count: int):
    """Wait until `count` strips have come here, or one has given up."""
    ...


def strips_meet(count: int, counter: wp.array[wp.int32]):
    wait_for_all(counter, count)


@dataclass
class Strip:
    """The one of `count` strips whose launches are being captured."""

    index: int
    count: int
    counter: wp.array
    """Of meetings; one array for all strips."""
    kernel: wp.Kernel
    """The meeting."""
    _wrote: str = field(default="nothing", init=False)
    """Who has written since the last meeting: "nothing", "first" (the first strip) or "all"."""
    _wrote_before: str | None = field(default=None, init=False)
    """The same, before the independent launches that are being captured."""

    def share(self, first: int, end: int) -> tuple[int, int]:
        """This strip's part of lines `first` … `end` - 1, after a meeting where one is needed."""
        lines = end - first
        if lines < SHARED_LINES:
            return (first, end) if self.alone() else (end, end)
        self._see(shared=True)
        return first + lines * self.index // self.count, first + lines * (self.index + 1) // self.count

    def alone(self, turn: int = 0) -> bool:
        """Whether what follows, which one strip does for all, is this one's: strip `turn`, counted round."""
        by = turn % self.count
        self._see(shared=by > 0)
        return self.index == by

    def _see(self, shared: bool) -> None:
        """Meet if what comes may read what another strip wrote; it writes itself."""
        read = self._wrote if self._wrote_before is None else self._wrote_before
        if read == "all" or (read == "first" and shared):
            self.meet()
        self._wrote = "all" if shared or self._wrote == "all" else "first"

    def meet(self) -> None:
        """Wait here for the other strips."""
        inputs = [self.count, self.counter]
        wp.launch(self.kernel, dim=1, inputs=inputs, device=self.counter.device, record_tape=False)
        self._wrote = "nothing"
        if self._wrote_before is not None:
            self._wrote_before = "nothing"


STRIP: ContextVar[Strip | None] = ContextVar("strip", default=None)
"""The strip whose launches are being captured; None where one thread runs them all."""


def share(first: int, end: int, turn: int | None = None) -> tuple[int, int]:
    """The part of lines `first` … `end` - 1 that the current strip runs; by `turn` all of them or none."""
    strip = STRIP.get()
    if strip is None:
        return first, end
    if turn is None:
        return strip.share(first, end)
    return (first, end) if strip.alone(turn) else (end, end)


@contextmanager
def together() -> Iterator[None]:
    """Launches within read nothing that another of them writes, so strips need not meet between them."""
    strip = STRIP.get()
    if strip is None or strip._wrote_before is not None:
        yield
        return
    strip._wrote_before = strip._wrote
    try:
        yield
    finally:
        strip._wrote_before = None


def alone(work: Callable[[], None]) -> None:
    """Do what is no launch of a program, such as a copy, once for all strips."""
    strip = STRIP.get()
    if strip is None or strip.alone():
        with LAUNCHES:
            work()


def repeat_while(going: wp.array, body: Callable[[], None]) -> None:
    """Run `body` as long as going[0], which it changes, is not 0: inside a graph, on every strip."""
    strip = STRIP.get()

    def meet() -> None:
        if strip:
            strip.meet()

    def everywhere() -> None:
        meet()  # all have read `going`: now it may be changed
        body()
        meet()  # it has been: now all may read it

    meet()
    wp.capture_while(going, everywhere)
    meet()  # all have left
