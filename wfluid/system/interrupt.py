"""Ctrl-C, heeded where work can stop: between frames, or between iterations of an optimiser."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType


class HeldInterrupt:
    """Holds a Ctrl-C back until `check` is asked; a second one stops at once.

    >>> with HeldInterrupt() as interrupt:
    ...     for frame in range(3):
    ...         interrupt.check()

    Python raises KeyboardInterrupt wherever it is, and forgets it where that is a destructor, of which there
    are many while arrays of the device come and go; or it leaves a library half way. Only the main thread is
    told of signals: in others nothing is held.
    """

    def __init__(self) -> None:
        self.wanted = False

    wanted: bool
    """Whether somebody has asked to stop."""

    def __enter__(self) -> HeldInterrupt:
        self._held = threading.current_thread() is threading.main_thread()
        if self._held:
            self._before = signal.signal(signal.SIGINT, self._hold)
        return self

    def _hold(self, number: int, frame: FrameType | None) -> None:
        if self.wanted:
            raise KeyboardInterrupt
        self.wanted = True

    def check(self) -> None:
        """Stop here, if that is wanted.

        Raises:
            KeyboardInterrupt: it is.
        """
        if self.wanted:
            raise KeyboardInterrupt

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._held:
            signal.signal(signal.SIGINT, self._before or signal.SIG_DFL)
