"""Schedules of a run that is gone back through, played by an executor that knows only sets of steps."""

from collections import Counter
from itertools import combinations, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wfluid.gradient.checkpoints import Advance, Restore, Reverse, Schedule, Store, even_segments, least_room


class Executor:
    """Does what actions say with the numbers of states alone, and refuses what the states at hand forbid.

    States of the run lie in rooms of their own where all are kept, else in one set of rooms that every
    segment begins anew; stored ones apart.
    """

    def __init__(self, steps, keeps_all):
        self.keeps_all = keeps_all
        self.there, self.stored = {0}, set()
        self.taken, self.reversed_to = Counter(), steps
        self.rooms = 0

    def do(self, action):
        if isinstance(action, Advance):
            assert action.start in self.there, f"{action}: the state it begins with is gone"
            assert action.start < action.end
            fresh = set(range(action.start, action.end + 1))
            self.there = self.there | fresh if self.keeps_all else fresh
            self.taken.update(range(action.start, action.end))
        elif isinstance(action, Store):
            assert action.step in self.there, f"{action}: there is nothing to store"
            assert action.step not in self.stored, f"{action}: written over before it was used"
            self.stored.add(action.step)
            self.there = {action.step}
        elif isinstance(action, Restore):
            assert action.step in self.stored, f"{action}: it was never stored"
            self.there = {action.step}
        else:
            assert isinstance(action, Reverse)
            needed = set(range(action.start, action.end + 1))
            assert needed <= self.there, f"{action}: {needed - self.there} are not there"
            assert action.end == self.reversed_to, f"{action}: the gradient is at {self.reversed_to}"
            self.reversed_to = action.start
        self.rooms = max(self.rooms, len(self.there) + len(self.stored))

    def play(self, schedule):
        for action in schedule.forward():
            self.do(action)
        self.went_to = max(self.there)
        for action in schedule.backward():
            self.do(action)
        return self


@st.composite
def runs(draw):
    """Steps and breaks of a run."""
    steps = draw(st.integers(1, 60))
    return steps, draw(st.sets(st.integers(0, steps), max_size=5))


@given(runs(), st.data())
def test_schedules_have_every_state_they_need_and_store_as_many_as_they_say(run, data):
    steps, breaks = run
    room = data.draw(st.integers(least_room(steps, breaks), steps + 3))
    schedule = even_segments(steps, room, breaks)
    played = Executor(steps, schedule.keeps_all).play(schedule)
    assert played.went_to == steps and played.reversed_to == 0
    assert played.rooms == schedule.room <= room
    assert set(played.taken) == set(range(steps))


@given(runs(), st.data())
def test_no_step_is_taken_more_than_twice_and_those_of_the_last_segment_once(run, data):
    steps, breaks = run
    schedule = even_segments(steps, data.draw(st.integers(least_room(steps, breaks), steps + 3)), breaks)
    taken = Executor(steps, schedule.keeps_all).play(schedule).taken
    last, _ = schedule.segments[-1]
    for step, times in taken.items():
        assert times == (1 if schedule.keeps_all or step >= last else 2), step


@given(runs(), st.data())
def test_segments_are_contiguous_and_end_at_every_break(run, data):
    steps, breaks = run
    schedule = even_segments(steps, data.draw(st.integers(least_room(steps, breaks), steps + 3)), breaks)
    ends = [schedule.segments[0][0], *(end for _, end in schedule.segments)]
    assert ends[0] == 0 and ends[-1] == steps
    assert schedule.segments == tuple(pairwise(ends)) and ends == sorted(set(ends))
    assert breaks <= set(ends)


@given(runs(), st.integers(0, 5))
def test_segments_between_two_breaks_differ_by_a_step_at_most(run, more):
    steps, breaks = run
    cuts = sorted({0, steps, *breaks})
    schedule = even_segments(steps, least_room(steps, breaks) + more, breaks)
    for start, end in pairwise(cuts):
        lengths = [b - a for a, b in schedule.segments if start <= a < end]
        assert max(lengths) - min(lengths) <= 1


def rooms_of_every_cut(steps, breaks):
    """The rooms that each way of cutting a run into segments takes, and that of keeping all its states."""
    inner = [step for step in range(1, steps) if step not in breaks]
    yield steps + 1
    for count in range(len(inner) + 1):
        for more in combinations(inner, count):
            ends = sorted({0, steps, *breaks, *more})
            yield max(b - a for a, b in pairwise(ends)) + 1 + len(ends) - 1


@pytest.mark.parametrize("breaks", [(), (3,), (2, 3), (1, 5, 9), (0, 7), (11,)], ids=str)
@pytest.mark.parametrize("steps", [1, 2, 3, 5, 8, 11])
def test_the_least_room_is_the_minimum_over_all_segmentations(steps, breaks):
    breaks = {step for step in breaks if step <= steps}
    least = min(rooms_of_every_cut(steps, breaks))
    assert least_room(steps, breaks) == least
    assert even_segments(steps, least, breaks).room <= least
    with pytest.raises(ValueError, match=rf"room for {least - 1} states: at least {least} are needed$"):
        even_segments(steps, least - 1, breaks)


@given(runs())
def test_with_room_for_all_states_every_step_is_taken_once(run):
    steps, breaks = run
    every = even_segments(steps, breaks=breaks)
    assert every.keeps_all and every.room == steps + 1
    assert even_segments(steps, steps + 1, breaks) == every
    assert not any(isinstance(action, Store | Restore) for action in every.forward() + every.backward())


@given(runs(), st.data())
def test_segments_are_the_longest_that_fit(run, data):
    """Of all lengths the longest that fits is taken: every longer one needs more room than there is."""
    steps, breaks = run
    least = least_room(steps, breaks)
    schedule = even_segments(steps, room := data.draw(st.integers(least, max(least, steps))), breaks)
    if schedule.keeps_all:
        return
    cuts = sorted({0, steps, *breaks})
    longest = max(end - start for start, end in schedule.segments)
    for length in range(longest + 1, steps + 1):
        counts = [-(-(end - start) // length) for start, end in pairwise(cuts)]
        longest_of_these = max(
            -(-(end - start) // count) for (start, end), count in zip(pairwise(cuts), counts, strict=True)
        )
        if longest_of_these > longest:
            assert longest_of_these + 1 + sum(counts) > room


@pytest.mark.parametrize("steps", [4, 10, 100, 1000, 9999])
def test_room_for_twice_the_root_of_the_steps_suffices(steps):
    """Segments of sqrt(n) steps take sqrt(n) + 1 rooms and sqrt(n) stores; rounding up adds one to either."""
    assert least_room(steps) <= 2 * steps**0.5 + 3


def test_rooms_equal_those_counted_by_hand():
    """Seven steps, cut at 3 and 5: four states of the longest segment, and three stored."""
    schedule = Schedule(((0, 3), (3, 5), (5, 7)), keeps_all=False)
    assert schedule.room == 4 + 3
    assert schedule.forward() == [
        Store(0), Advance(0, 3), Store(3), Advance(3, 5), Store(5), Advance(5, 7),
    ]  # fmt: skip
    assert schedule.backward() == [
        Reverse(5, 7), Restore(3), Advance(3, 5), Reverse(3, 5), Restore(0), Advance(0, 3), Reverse(0, 3),
    ]  # fmt: skip
