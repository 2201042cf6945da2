"""Ctrl-C stops work at the next check, whenever it is pressed."""

import os
import signal
import threading
import time

import pytest

from wfluid.system.interrupt import HeldInterrupt


def press():
    """Press Ctrl-C; the signal is handled before this returns."""
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.01)


class Pressing:
    """Is interrupted in its destructor, where Python drops exceptions."""

    def __del__(self):
        press()


def test_an_interrupt_within_a_destructor_is_not_lost():
    with HeldInterrupt() as interrupt:
        thing = Pressing()
        interrupt.check()
        del thing
        with pytest.raises(KeyboardInterrupt):
            interrupt.check()


def test_the_first_interrupt_is_deferred_and_the_second_is_not():
    reached = False
    with pytest.raises(KeyboardInterrupt), HeldInterrupt():
        press()
        reached = True
        press()
        reached = False
    assert reached


def test_the_signal_handler_is_restored():
    before = signal.getsignal(signal.SIGINT)
    with HeldInterrupt():
        assert signal.getsignal(signal.SIGINT) != before
    assert signal.getsignal(signal.SIGINT) == before


def test_other_threads_do_not_defer_interrupts():
    before, inside = signal.getsignal(signal.SIGINT), []

    def work():
        with HeldInterrupt() as interrupt:
            interrupt.check()
            inside.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert inside == [before]
