"""Ctrl-C stops work where it can stop, wherever it comes."""

import os
import signal
import threading
import time

import pytest

from wfluid.system.interrupt import HeldInterrupt


def press():
    """Ctrl-C, heeded before this returns."""
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.01)


class Pressing:
    """Is interrupted while it is taken down, where Python forgets exceptions."""

    def __del__(self):
        press()


def test_an_interrupt_within_a_destructor_is_not_lost():
    with HeldInterrupt() as interrupt:
        thing = Pressing()
        interrupt.check()
        del thing
        with pytest.raises(KeyboardInterrupt):
            interrupt.check()


def test_the_first_interrupt_waits_and_the_second_does_not():
    reached = False
    with pytest.raises(KeyboardInterrupt), HeldInterrupt():
        press()
        reached = True
        press()
        reached = False
    assert reached


def test_afterwards_interrupts_are_what_they_were():
    before = signal.getsignal(signal.SIGINT)
    with HeldInterrupt():
        assert signal.getsignal(signal.SIGINT) != before
    assert signal.getsignal(signal.SIGINT) == before


def test_other_threads_hold_nothing():
    before, inside = signal.getsignal(signal.SIGINT), []

    def work():
        with HeldInterrupt() as interrupt:
            interrupt.check()
            inside.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert inside == [before]
