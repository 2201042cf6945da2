"""Deferred Ctrl-C: work stops between frames, or between iterations of an optimiser."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType


class HeldInterrupt:
    """A context that defers Ctrl-C to the next call of `check`; a second Ctrl-C stops at once.

    >>> with HeldInterrupt() as interrupt:
    ...     for frame in range(3):
    ...         interrupt.check()

    Python raises KeyboardInterrupt at any instruction. In a destructor, such as that of a device array, the
    exception is lost; in a library it may leave an inconsistent state. Only the main thread receives signals:
    in other threads the context does nothing.
    """

    def __init__(self) -> None:
        self.wanted = False

    wanted: bool
    """Whether Ctrl-C was pressed."""

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
        """Stop here if Ctrl-C was pressed.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        if self.wanted:
            raise KeyboardInterrupt

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._held:
            signal.signal(signal.SIGINT, self._before or signal.SIG_DFL)
