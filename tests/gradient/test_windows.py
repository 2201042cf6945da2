"""A run cut in two is the whole run: it goes on from what it left, to the bit, forward and back."""

import re
from dataclasses import replace

import numpy as np
import pytest
from control_cases import (
    BRIEF_GROWTH,
    END,
    GRID,
    INK,
    MAP,
    MIDDLE,
    POINTS,
    PUSH,
    SMOKE,
    TIMELINE,
    TWIRL,
    WANTED,
    begin,
    paint,
)

from wfluid import Constant, Fluid, Free, Freeze, Functional, GaussianForce, Grid, Growth, Keyed, State
from wfluid.gradient.graph_cache import GraphCache
from wfluid.gradient.objectives import Effort, ParticleMisfit
from wfluid.gradient.state_objectives import DensityMisfit

LATE = [
    GaussianForce((0.4, 0.35), (7.0, -4.0), 0.15, Constant(MIDDLE, END)),
    GaussianForce((0.6, 0.3), (-3.0, 8.0), 0.11, Constant(MIDDLE + 1 / 48, END)),
]
"""Forces that begin when the second half does."""

GROWING = Growth((0.35, 0.45), 2.0, 0.16, Constant(0.0, MIDDLE))
"""It ends with the first half: the first step of the second begins from no pressure."""

FLUIDS = {
    "constant viscosity": {"viscosity": 0.01},
    "no-slip": {"viscosity": 0.01, "walls": "no-slip"},
    "densities": {"viscosity": 0.005, "densities": [INK, SMOKE], "walls": "periodic,free-slip"},
    "viscosity that moves": {
        "viscosity": paint(0.002, 0.05, 14),
        "viscosity_moves": True,
        "diffusion_tolerance": 1e-4,
    },
    "drag": {"viscosity": 0.004, "freeze": Freeze(paint(0, 0.4, 16), 1e3)},
    "the paper's scheme": {"viscosity": 0.01, "scheme": "paper", "sweeps": 20},
}
"""Ones that are solved in the same way at all times."""


@pytest.fixture
def make(device):
    """A run of some forces, whole or in part, in which every second one may vary."""

    def build(fluid, objective, forces, free=None, **more):
        free = [Free(f"forces[{n}].vector") for n in range(0, len(forces), 2)] if free is None else free
        return Functional(GRID, Fluid(**fluid), forces, TIMELINE, objective, free, device=str(device), **more)

    return build


def fields(state):
    return [a.numpy().copy() for a in state.fields]


def cut(make, fluid, forces, **more):
    """The state in the middle."""
    first = make(fluid, ParticleMisfit(POINTS, WANTED, MIDDLE), forces, end=MIDDLE, **more)
    return first.state_after(first.start)


@pytest.mark.parametrize(
    ("name", "early"), [*((name, PUSH) for name in FLUIDS), ("no-slip", GROWING), ("drag", GROWING)]
)
def test_a_run_continued_from_a_state_ends_as_the_complete_run(make, name, early):
    """Velocity, map, pressure, densities to the bit; particles too, but for their places' change of unit."""
    fluid, forces = FLUIDS[name], [PUSH, early, *LATE]
    whole = make(fluid, ParticleMisfit(POINTS, WANTED, END), forces)
    expected = whole.state_after(whole.start)
    middle = cut(make, fluid, forces)
    second = make(fluid, ParticleMisfit(middle.points, WANTED, END), forces, begin=(MIDDLE, middle))
    state = second.state_after(second.start)
    for got, wanted in zip(fields(state), fields(expected), strict=True):
        np.testing.assert_array_equal(got, wanted)
    np.testing.assert_allclose(state.points, expected.points, rtol=0, atol=1e-6)
    assert np.abs(expected.velocity[0]).max() > 0.05


def test_a_continued_run_uses_the_viscosity_at_its_time(make):
    """Its cycles are planned for the whole of a run: halves are solved otherwise, as well as was asked."""
    keys = {0.0: paint(0.002, 0.03, 19), 0.1: 0.02, 0.2: paint(0.02, 0.3, 20)}
    fluid = {"viscosity": Keyed(keys), "diffusion_tolerance": 1e-6, "pressure_cycles": 5}
    whole = make(fluid, ParticleMisfit(POINTS, WANTED, END), [PUSH, *LATE])
    expected = whole.state_after(whole.start).velocity
    middle = cut(make, fluid, [PUSH, *LATE])
    second = make(fluid, MAP, [PUSH, *LATE], begin=(MIDDLE, middle))
    for got, wanted in zip(second.state_after(second.start).velocity, expected, strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=2e-5 * np.abs(wanted).max())


def test_a_state_can_be_continued_from_more_than_once(make):
    """A run does not change the state it begins with; ten runs of a step each are one of ten steps."""
    fluid, forces = FLUIDS["viscosity that moves"], [PUSH, TWIRL]
    whole = make(fluid, MAP, forces)
    expected = fields(whole.state_after(whole.start))
    state, t = None, 0.0
    for step in range(1, TIMELINE.steps + 1):
        end = TIMELINE.time_of(step)
        one = make(fluid, Effort(), forces, end=end, begin=state and (t, state))
        kept = state and fields(state)
        after = one.state_after(one.start)
        for got, before in zip(fields(state), kept, strict=True) if state else ():
            np.testing.assert_array_equal(got, before)
        state, t = after, end
    for got, wanted in zip(fields(state), expected, strict=True):
        np.testing.assert_array_equal(got, wanted)


@pytest.mark.parametrize("capped", [False, True])
@pytest.mark.parametrize("name", ["constant viscosity", "densities", "viscosity that moves"])
def test_the_second_half_has_the_gradient_of_the_complete_run(make, name, capped):
    """With respect to forces that act in it only; whatever the memory that it has."""
    fluid, forces = FLUIDS[name], [*LATE, PUSH, BRIEF_GROWTH]
    free = [Free(f"forces[{n}].{key}") for n in (0, 1) for key in ("vector", "center", "radius")]
    asked = MAP
    if "densities" in fluid:
        asked = MAP + DensityMisfit("ink", paint(0, 2, 10), MIDDLE + 2 / 48)
    whole = make(fluid, asked + ParticleMisfit(POINTS, WANTED, END), forces, free)
    value, expected = whole.value_and_gradient(whole.start)
    middle = cut(make, fluid, forces)
    objective, more = asked + ParticleMisfit(middle.points, WANTED, END), {"begin": (MIDDLE, middle)}
    if capped:
        with pytest.raises(ValueError, match="need at least") as refused:
            make(fluid, objective, forces, free, memory_mb=1e-3, **more)
        more["memory_mb"] = float(str(refused.value).rpartition(" ")[2])
    second = make(fluid, objective, forces, free, **more)
    for _ in range(2):  # the second time replayed
        got, gradient = second.value_and_gradient(second.start)
        assert got == pytest.approx(value, rel=1e-6)
        np.testing.assert_allclose(gradient, expected, rtol=0, atol=2e-6 * np.abs(expected).max())
    assert np.all(expected != 0)


def test_the_efforts_of_the_halves_add_to_that_of_the_complete_run(make):
    fluid, forces = FLUIDS["constant viscosity"], [PUSH, *LATE]
    whole, first = make(fluid, Effort(), forces), make(fluid, Effort(), forces, end=MIDDLE)
    second = make(fluid, Effort(), forces, begin=(MIDDLE, cut(make, fluid, forces)))
    parts = [one.value(one.start) for one in (first, second)]
    assert sum(parts) == pytest.approx(whole.value(whole.start), rel=1e-6)
    assert min(parts) > 0


def test_objectives_of_a_half_have_the_times_of_the_complete_run(make):
    """Particles and maps at a time between two others, whatever step of its own run that is."""
    fluid, forces = FLUIDS["constant viscosity"], [PUSH, *LATE]
    middle, between = cut(make, fluid, forces), MIDDLE + 2 / 48

    def values(points, **more):
        misfit = ParticleMisfit(points, WANTED, between)
        one = make(fluid, misfit + replace(MAP, time=between) + misfit, forces, **more)
        return one.value(one.start)

    whole, half = values(POINTS), values(middle.points, begin=(MIDDLE, middle))
    assert half == pytest.approx(whole, rel=1e-5)
    assert values(POINTS, end=between) == whole


def test_a_returned_state_does_not_change_when_the_run_is_repeated(make):
    functional = make(FLUIDS["constant viscosity"], MAP, [PUSH])
    state = functional.state_after(functional.start)
    kept = fields(state)
    functional.value(2 * functional.start)
    for got, wanted in zip(fields(state), kept, strict=True):
        np.testing.assert_array_equal(got, wanted)


@pytest.mark.parametrize("size", [(600, 400), (480, 320), (400, 600)])
def test_a_run_can_be_continued_with_a_point_on_an_edge(device, size):
    """Single precision may leave it outside by its rounding."""
    grid, fluid = Grid.for_picture(*size, 48), Fluid(viscosity=0.01)
    points = [(0.5 * grid.width, grid.height), (grid.width, 0.4 * grid.height)]
    one = Functional(
        grid, fluid, [PUSH], TIMELINE, ParticleMisfit(points, points, MIDDLE), [FREE], end=MIDDLE
    )
    middle = one.state_after(one.start)
    misfit = ParticleMisfit(middle.points, points, END)
    two = Functional(grid, fluid, [PUSH], TIMELINE, misfit, [FREE], begin=(MIDDLE, middle))
    assert np.isfinite(two.value(two.start))


STRETCHES = {
    "all of it": {},
    "the first half": {"end": MIDDLE},
    "a piece": {"begin": 2 / 48, "end": 7 / 48},
    "the second half": {"begin": MIDDLE},
}


@pytest.mark.parametrize("name", FLUIDS)
@pytest.mark.parametrize("weight", [0.0, 1e-3])
def test_a_functional_with_the_graphs_of_another_computes_the_same(device, name, weight):
    """Value and gradient to the bit, over stretch after stretch, with other numbers and other ones free."""
    fluid, forces = Fluid(**FLUIDS[name]), [PUSH, *LATE]
    graphs, last, sure = GraphCache(), None, False
    for n, (words, stretch) in enumerate(STRETCHES.items()):
        stretch, points = dict(stretch), POINTS
        if "begin" in stretch:
            t = stretch["begin"]
            before = Functional(GRID, fluid, forces, TIMELINE, misfit(points, t), [FREE], end=t)
            state = before.state_after(before.start)
            stretch["begin"], points = (t, state), state.points
        objective = misfit(points, stretch.get("end", END))
        objective = (1 + n) * objective + (weight / (1 + n)) * Effort() if weight else objective
        forces = [replace(PUSH, vector=(9.0 - n, 5.0)), *LATE]
        free = [FREE, Free("forces[1].center")][: 1 + n % 2]
        one, other = (
            Functional(GRID, fluid, forces, TIMELINE, objective, free, device=str(device), **stretch, **more)
            for more in ({}, {"graphs": graphs, "room": END})
        )
        for _ in range(2):
            (expected, slopes), (got, found) = (each.value_and_gradient(each.start) for each in (one, other))
            assert got == expected, words
            np.testing.assert_array_equal(found, slopes)
        assert np.any(slopes)
        sure = sure or (last is not None and other._recording is last._recording)
        last = other
    assert sure  # they were taken over


@pytest.mark.parametrize(
    "change",
    [
        {"fluid": Fluid(viscosity=0.02)},
        {"fluid": Fluid(viscosity=0.01, walls="no-slip")},
        {"forces": [PUSH]},
        {"forces": [PUSH, *LATE, GROWING]},
        {"objective": MAP},
        {"objective": ParticleMisfit(POINTS[:1], WANTED[:1], END)},
        {"objective": ParticleMisfit(POINTS, WANTED, END) + Effort()},
        {"end": END, "of": {"end": MIDDLE}},
        {"memory_mb": 1.0},
        {"grid": replace(GRID, nx=24)},
        {"timeline": replace(TIMELINE, substeps=2 * TIMELINE.steps_per_frame)},
    ],
    ids=lambda change: ", ".join(change),
)
def test_graphs_that_do_not_fit_are_not_reused(device, change):
    change = dict(change)
    usual = {
        "grid": GRID,
        "fluid": Fluid(viscosity=0.01),
        "forces": [PUSH, *LATE],
        "timeline": TIMELINE,
        "objective": ParticleMisfit(POINTS, WANTED, END),
        "free": [FREE],
        "device": str(device),
    }
    of = change.pop("of", {})
    objective = misfit(POINTS, of.get("end", END))
    graphs = GraphCache()
    first = Functional(**usual | {"objective": objective} | of, graphs=graphs)
    first.value(first.start)
    second, expected = Functional(**usual | change, graphs=graphs), Functional(**usual | change)
    assert second._recording is not first._recording
    assert second.value(second.start) == expected.value(expected.start)
    first.value(first.start)  # still has its graphs


def test_a_functional_whose_graphs_another_reuses_refuses_to_run(device):
    """Its tables hold another's run: it would return another's value."""
    graphs, objective = GraphCache(), ParticleMisfit(POINTS, WANTED, END)
    fluid = Fluid(viscosity=0.01)
    first, second = (
        Functional(GRID, fluid, [force], TIMELINE, objective, [FREE], device=str(device), graphs=graphs)
        for force in (PUSH, replace(PUSH, vector=(0.0, 1.0)))
    )
    assert second._recording is first._recording
    second.value(second.start)
    with pytest.raises(RuntimeError, match="taken over"):
        first.value(first.start)


FREE = Free("forces[0].vector")


def misfit(points, time):
    return ParticleMisfit(points, WANTED, time)


def refuses(message, build, *arguments, **more):
    """It raises ValueError with one line that contains the message."""
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        build(*arguments, **more)
    assert "\n" not in str(caught.value)


def test_a_beginning_that_does_not_fit_the_run_is_refused(make):
    fluid, forces = FLUIDS["constant viscosity"], [PUSH]
    middle = cut(make, fluid, forces)
    says = "a run begins with a velocity or with a state, not with both"
    refuses(says, make, fluid, MAP, forces, begin=(MIDDLE, middle), velocity=begin())
    says = "a run begins with a state of its own grid and densities"
    refuses(says, make, fluid | {"densities": [INK]}, MAP, forces, begin=(MIDDLE, middle))
    other = State.at_rest(replace(GRID, nx=24), middle.u.device)
    refuses(says, make, fluid, MAP, forces, begin=(MIDDLE, other))


@pytest.mark.parametrize("time", [0.0, -0.1, 0.3, float("nan")])
def test_an_end_or_a_beginning_outside_the_timeline_is_refused(make, time):
    fluid, forces = FLUIDS["constant viscosity"], [PUSH]
    says = f"at {time:g} s: expected a time after 0 and up to {END:g} s"
    refuses(f"an end {says}", make, fluid, Effort(), forces, end=time)
    refuses(f"a beginning {says}", make, fluid, Effort(), forces, begin=(time, cut(make, fluid, forces)))


def test_an_end_or_a_beginning_between_steps_is_refused(make):
    fluid, forces = FLUIDS["constant viscosity"], [PUSH]
    says = "falls between steps, at 0.0833333 s and 0.104167 s"
    refuses("an end at 0.09375 s " + says, make, fluid, Effort(), forces, end=4.5 / 48)
    says = "a beginning at 0.09375 s " + says
    refuses(says, make, fluid, Effort(), forces, begin=(4.5 / 48, cut(make, fluid, forces)))


def test_objectives_of_other_parts_of_the_run_are_refused(make):
    """Before the beginning, at it, after the end."""
    fluid, forces = FLUIDS["constant viscosity"], [PUSH]
    more = {"begin": (MIDDLE, cut(make, fluid, forces)), "end": 8 / 48}
    for step in (3, 6, 9):
        says = f"an objective at {step / 48:g} s: expected a time after 0.125 and up to 0.166667 s"
        refuses(says, make, fluid, ParticleMisfit(POINTS, WANTED, step / 48), forces, **more)
    make(fluid, ParticleMisfit(POINTS, WANTED, 8 / 48), forces, **more)


def test_a_part_of_no_steps_is_refused(make):
    fluid, forces = FLUIDS["constant viscosity"], [PUSH]
    middle = cut(make, fluid, forces)
    says = "a beginning at 0.125 s: expected a time before the end"
    refuses(says, make, fluid, Effort(), forces, begin=(MIDDLE, middle), end=MIDDLE)
    says = "a beginning at 0.125 s: expected a time after 0 and up to 0.0625 s"
    refuses(says, make, fluid, Effort(), forces, begin=(MIDDLE, middle), end=3 / 48)
    says = f"a beginning at {END:g} s: expected a time before the end"
    refuses(says, make, fluid, Effort(), forces, begin=(END, middle))
