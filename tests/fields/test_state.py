"""A state's lists of arrays come from one."""

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import fill
from wfluid.fields.state import State


def test_copies_hold_every_array_and_share_none(device):
    state = State.at_rest(Grid(6, 5, 1.0, 1.0), device, densities=2, points=3)
    for n, f in enumerate(state.arrays, start=1):
        fill(float(n), f)
    copied, other = state.copy(), State.at_rest(state.grid, device, densities=2, points=3)
    state.copy_into(other)
    seen = state.view()
    assert len(state.arrays) == 9 and len(state.seen) == 6
    fill(0.0, *state.arrays)
    for n, arrays in enumerate(zip(copied.arrays, other.arrays, seen.arrays, strict=True), start=1):
        assert [float(f.numpy()[0]) for f in arrays] == [n, n, 0]
    copied.zero_()
    assert not any(f.numpy().any() for f in copied.arrays)


def test_a_number_that_is_not_finite_is_found_in_every_array(device):
    state = State.at_rest(Grid(6, 5, 1.0, 1.0), device, densities=1, points=1)
    assert state.finite
    for f in state.arrays:
        fill(np.nan, f)
        assert not state.finite
        fill(0.0, f)


def test_every_array_takes_its_gradient_from_the_same_array_of_another_state(device):
    grid = Grid(6, 5, 1.0, 1.0)
    state, bar = (State.at_rest(grid, device, densities=2, points=3) for _ in range(2))
    state.take_gradient(bar)
    for n, f in enumerate(bar.arrays, start=1):
        fill(float(n), f)
    assert [float(f.grad.numpy()[0]) for f in state.arrays] == [*range(1, 10)]
    assert [float(rho.grad.numpy()[0]) for rho in state.rho] == [float(rho.numpy()[0]) for rho in bar.rho]
