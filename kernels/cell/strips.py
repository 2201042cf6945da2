"""Strips: the same launches replayed by several CPU threads at once, each on its part of the rows.

A graph is captured once per strip, with that strip current. A launch over many rows then runs on the strip's
part of them. A launch over few rows (a coarse level, a sum) is run by the first strip alone. Before a launch
that may read values of another strip, all strips meet at a barrier: each increments a counter in shared
memory and waits until all have. Every row is computed by the same code from the same values, so the bits do
not depend on the number of strips.

All strips of a step must be replayed at the same time, each by its own thread; otherwise those that run
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
"""Least rows of a launch that strips share: fewer rows take less time than a barrier."""


ARRIVALS, GIVEN_UP = 0, 1
"""Entries of a counter: the number of arrivals at barriers; 1 if a strip has given up, else 0."""


@wp.func_native("""
    // arrivals grow from barrier to barrier; a barrier opens when their number is the next multiple of count
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
    """Wait until `count` strips have arrived, or one has given up."""
    ...


def strips_meet(count: int, counter: wp.array[wp.int32]):
    wait_for_all(counter, count)


@dataclass
class Strip:
    """Strip number `index` of `count`, whose launches are being captured."""

    index: int
    count: int
    counter: wp.array
    """Counter of the barriers; one array for all strips."""
    kernel: wp.Kernel
    """Kernel of a barrier."""
    _wrote: str = field(default="nothing", init=False)
    """Strips that have written since the last barrier: "nothing", "first" (the first strip) or "all"."""
    _wrote_before: str | None = field(default=None, init=False)
    """Value of `_wrote` before the independent launches that are being captured; None outside them."""

    def share(self, first: int, end: int) -> tuple[int, int]:
        """This strip's part of lines `first` … `end` - 1, after a barrier where one is needed."""
        lines = end - first
        if lines < SHARED_LINES:
            return (first, end) if self.alone() else (end, end)
        self._note_launch(shared=True)
        return first + lines * self.index // self.count, first + lines * (self.index + 1) // self.count

    def alone(self, turn: int = 0) -> bool:
        """Whether this strip is number `turn` (modulo their count), which alone does the work."""
        runner = turn % self.count
        self._note_launch(shared=runner > 0)
        return self.index == runner

    def _note_launch(self, shared: bool) -> None:
        """Put a barrier before a launch that may read values of another strip; note that it writes."""
        read = self._wrote if self._wrote_before is None else self._wrote_before
        if read == "all" or (read == "first" and shared):
            self.meet()
        self._wrote = "all" if shared or self._wrote == "all" else "first"

    def meet(self) -> None:
        """Put a barrier here: wait for the other strips."""
        inputs = [self.count, self.counter]
        wp.launch(self.kernel, dim=1, inputs=inputs, device=self.counter.device, record_tape=False)
        self._wrote = "nothing"
        if self._wrote_before is not None:
            self._wrote_before = "nothing"


STRIP: ContextVar[Strip | None] = ContextVar("strip", default=None)
"""The strip whose launches are being captured; None where one thread runs all launches."""


def share(first: int, end: int, turn: int | None = None) -> tuple[int, int]:
    """The part of lines `first` … `end` - 1 that the current strip runs; all or none with a `turn`."""
    strip = STRIP.get()
    if strip is None:
        return first, end
    if turn is None:
        return strip.share(first, end)
    return (first, end) if strip.alone(turn) else (end, end)


@contextmanager
def together() -> Iterator[None]:
    """No launch within reads what another of them writes, so that no barriers are needed between them."""
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
    """Do work that is not the launch of a program, such as a copy, on the first strip alone."""
    strip = STRIP.get()
    if strip is None or strip.alone():
        with LAUNCHES:
            work()


def repeat_while(going: wp.array, body: Callable[[], None]) -> None:
    """Run `body` while going[0] is not 0, which `body` changes: inside a graph, on every strip."""
    strip = STRIP.get()

    def meet() -> None:
        if strip:
            strip.meet()

    def everywhere() -> None:
        meet()  # all strips have read `going`, so that it may change
        body()
        meet()  # `going` has its new value, so that all strips may read it

    meet()
    wp.capture_while(going, everywhere)
    meet()  # all strips have left the loop
