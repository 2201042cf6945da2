"""Tables on the device with a row for each step, and the counter of the row that a loop is at."""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.fields.arrays import assign, fill, read, zeros
from wfluid.kernels.adjoint import step_table

CHUNK = 1024
"""Entries that one thread of a launch copies on a CPU. On CUDA each copies one."""


class StepCounter:
    """The row that a captured loop is at, and the row at which it ends, in device memory."""

    def __init__(self, device: wp.Device):
        self.device = device
        self.step, self.going = (zeros(n, device, wp.int32) for n in (2, 1))

    def set(self, row: int, end: int) -> None:
        """Start the loop at `row`; it stops at `end`."""
        assign(np.array([row, end], dtype=np.int32), self.step)
        fill(int(row != end), self.going)

    def count(self, by: int) -> None:
        """Move by a number of rows: launches only."""
        step_table.count.launch(1, self.device, [by], [self.step, self.going])


class StepTable:
    """A number of rows, each of the size and type of an array."""

    def __init__(self, like: wp.array, count: int):
        self.size, self.device = like.size, wp.get_device(like.device)
        self.array = zeros(self.size * count, self.device, like.dtype)
        self._chunk = 1 if self.device.is_cuda else CHUNK
        self._lines = -(-self.size // self._chunk)
        self._take = step_table.take_indices if like.dtype is wp.int32 else step_table.take

    def take(self, counter: StepCounter, out: wp.array, ahead: int = 0) -> None:
        """out = the row `ahead` rows after the counter's: launches only."""
        inputs = [self.array, counter.step, ahead, self.size, self._chunk]
        self._take.launch(self._lines, self.device, inputs, [out])

    def give(self, counter: StepCounter, f: wp.array, ahead: int = 0) -> None:
        """Write f to the row `ahead` rows after the counter's: launches only."""
        inputs = [f, counter.step, ahead, self.size, self._chunk]
        step_table.give.launch(self._lines, self.device, inputs, [self.array])

    def copy(self, f: wp.array, out: wp.array) -> None:
        """out = f, both of the size of a row: launches only."""
        step_table.copy.launch(self._lines, self.device, [f, self.size, self._chunk], [out])

    def add_to(self, counter: StepCounter, out: wp.array, ahead: int = 0) -> None:
        """out += the row `ahead` rows after the counter's: launches only."""
        step_table.add_row.launch(self.size, self.device, [self.array, counter.step, ahead, self.size], [out])

    def row(self, n: int) -> wp.array:
        """Row n, a view."""
        return self.array if not self.size else self.array[n * self.size : (n + 1) * self.size]

    def put(self, first: int, values: np.ndarray) -> None:
        """Write values (count, size) to the rows from `first` on."""
        if values.size:
            assign(values.ravel(), self.array[first * self.size : (first + len(values)) * self.size])

    def rows(self, first: int, end: int) -> np.ndarray:
        """A copy of the rows `first` … `end` - 1, (end - first, size)."""
        if not self.size or first == end:
            return np.zeros((end - first, self.size))
        return read(self.array[first * self.size : end * self.size]).reshape(-1, self.size)
