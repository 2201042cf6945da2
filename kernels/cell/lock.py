"""The lock of all calls of Warp that a capture would record.

A capture records all launches, allocations, copies and writes, of every thread. So launches hold the lock
(`cell/program`), and so do the functions that make and write arrays (`wfluid/fields/arrays`), and each
capture from its beginning to its end (`wfluid/fields/graph`). Replays need no lock.
"""

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

LAUNCHES = threading.RLock()
"""Held while Warp launches, allocates, copies, or captures."""

if hasattr(os, "register_at_fork"):  # else a child inherits the lock as held by a thread that it lacks
    os.register_at_fork(
        before=LAUNCHES.acquire, after_in_parent=LAUNCHES.release, after_in_child=LAUNCHES.release
    )

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def exclusive(work: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Hold `LAUNCHES` while `work` runs."""

    @wraps(work)
    def held(*arguments: _Arguments.args, **settings: _Arguments.kwargs) -> _Result:
        with LAUNCHES:
            return work(*arguments, **settings)

    return held
