"""Maps of a flow to its start and to its end: shifts are exact, and the two maps are inverse."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from wfluid import Animation, Fluid, GaussianForce, Grid, Picture, Solver, Timeline, VortexForce, Wind
from wfluid.fields.device import open_device
from wfluid.morphing.flow_maps import flow_maps

WALLS = ("free-slip", "no-slip", "periodic", "periodic,no-slip")

TURN = (VortexForce((0.5, 0.4), 30.0, 0.12), GaussianForce((0.3, 0.5), (3.0, -2.0), 0.12))
"""A vortex that turns the middle by more than half a turn and moves a fifth of the picture far."""

SECONDS = 0.5

FINER = ((32, 6), (64, 12), (128, 24))
"""Numbers of cells and steps, both doubled each time."""


@cache
def turned(device, cells, steps, walls="free-slip"):
    """The flow maps of `TURN`."""
    fluid, grid = Fluid(viscosity=0.01, walls=walls), Grid.for_picture(4, 3, cells)
    return flow_maps(Solver(grid, fluid, open_device(device)), TURN, timeline(steps))


def timeline(steps):
    return Timeline(SECONDS, steps / SECONDS, 1)


@pytest.fixture
def name(request):
    return request.config.getoption("--device")


def falls(errors):
    """The orders of convergence of errors."""
    return np.log2(np.divide(errors[:-1], errors[1:]))


def test_a_constant_wind_shifts_both_ways(make_solver):
    """From rest under an acceleration a, carried by the velocity of each step's beginning:

    D(k) = a dt^2 k (k - 1) / 2. Between steps the place is on the line; to the end the rest is left.
    """
    solver, times = make_solver(24, 17, walls="periodic", viscosity=0.02), Timeline(0.5, 12, 2)
    a = np.array([0.9, -0.5])
    passage = flow_maps(solver, [Wind(tuple(a))], times)

    def moved(step):
        return a * times.dt**2 * step * (step - 1) / 2

    for at in (0, 1, 2, 5.5, 7.25, 11, 12):
        low = int(min(at, 11))
        place = moved(low) + (at - low) * (moved(low + 1) - moved(low))
        back, on = passage.since_start(at / 12), passage.until_end(at / 12)
        np.testing.assert_allclose(back.displacement, np.broadcast_to(-place, (17, 24, 2)), atol=3e-7)
        wanted = np.broadcast_to(moved(12) - place, (17, 24, 2))
        np.testing.assert_allclose(on.displacement, wanted, rtol=0, atol=3e-7)
    assert passage.inconsistency().max() < 1e-6


def test_nothing_moves_without_forces(make_solver):
    passage = flow_maps(make_solver(16, 12), (), Timeline(0.5, 12, 2))
    assert not passage.from_start.any() and not passage.to_end.any()


@pytest.mark.parametrize("walls", WALLS)
def test_maps_are_exactly_zero_at_their_ends(name, walls):
    """The map to the start is 0 at the start, the map to the end at the end, and both for times outside."""
    passage = turned(name, 32, 6, walls)
    for part in (0, 0.0, -1.0, np.zeros((24, 32))):
        assert not passage.since_start(part).displacement.any()
    for part in (1, 1.0, 2.0, np.ones((24, 32))):
        assert not passage.until_end(part).displacement.any()
    assert passage.since_start(1.0).displacement.any() and passage.until_end(0.0).displacement.any()


def test_going_to_the_end_and_back_is_the_identity_to_second_order(name):
    """Cells and steps halved: midpoint traces lose O(dt^2), cubic interpolation O(h^3 / dt)."""
    worst, mean = [], []
    for cells, steps in FINER:
        passage = turned(name, cells, steps)
        start, end = passage.until_end(0.0), passage.since_start(1.0)
        again = end.source_at(start.source_of.reshape(-1, 2))
        there = (start.source_of - start.displacement).reshape(-1, 2)
        missed = np.linalg.norm(again - there, axis=1)
        np.testing.assert_allclose(passage.inconsistency().ravel(), missed, rtol=0, atol=1e-6)
        worst.append(missed.max())
        mean.append(missed.mean())
    assert worst[0] < 0.02 * np.abs(turned(name, *FINER[0]).to_end).max()
    assert falls(worst).min() > 1.9 and falls(mean).min() > 1.9, (worst, mean)


@pytest.mark.parametrize("walls", WALLS)
def test_the_two_maps_are_inverse_for_every_wall(name, walls):
    passage = turned(name, 64, 12, walls)
    longest = np.linalg.norm(passage.to_end[0], axis=2).max()
    assert longest > 0.1 and passage.inconsistency().max() < 0.01 * longest


def test_inconsistency_detects_maps_of_different_flows(make_solver):
    """The inconsistency of shifts that differ by one cell is one cell everywhere."""
    solver = make_solver(24, 17, walls="periodic", viscosity=0.02)
    passage = flow_maps(solver, [Wind((0.9, -0.5))], Timeline(0.5, 12, 2))
    off = replace(passage, to_end=passage.to_end + np.float32([1 / 24, 0]))
    np.testing.assert_allclose(off.inconsistency(), 1 / 24, rtol=1e-5)


def test_particles_end_where_the_map_to_the_end_says(name):
    """From every frame, the animation's tracked points; the difference converges to second order."""
    points = np.random.default_rng(0).uniform(0.2, 0.55, (30, 2))
    to_end, to_start = [], []
    for cells, steps in FINER:
        passage, missed = turned(name, cells, steps), []
        picture, fluid = Picture(np.zeros((3, 4, 1), np.float32)), Fluid(viscosity=0.01)
        settings = {"cells": cells, "device": name, "points": [tuple(point) for point in points]}
        places = [
            frame.points for frame in Animation(picture, fluid, TURN, timeline(steps), **settings).frames()
        ]
        for step, here in enumerate(places):
            missed.append(passage.until_end(step / steps).source_at(here) - places[-1])
        to_end.append(np.abs(missed).max())
        to_start.append(np.abs(passage.since_start(1.0).source_at(places[-1]) - points).max())
    assert to_end[0] < 0.02 * np.linalg.norm(places[-1] - points, axis=1).max()
    assert falls(to_end).min() > 1.7 and falls(to_start).min() > 1.7, (to_end, to_start)


def test_the_map_since_the_start_is_the_animations_own(name):
    """At every step, bit for bit."""
    passage, steps = turned(name, 32, 6), 6
    picture, fluid = Picture(np.zeros((3, 4, 1), np.float32)), Fluid(viscosity=0.01)
    animation = Animation(picture, fluid, TURN, timeline(steps), cells=32, device=name)
    for step, frame in enumerate(animation.frames()):
        np.testing.assert_array_equal(passage.since_start(step / steps).displacement, frame.map.displacement)


def test_linear_interpolation_between_steps_is_of_second_order(name):
    """Every second and every fourth step of one flow, compared with the steps left out."""
    full, errors = turned(name, 32, 24), []
    for stride in (4, 2):
        some = replace(full, from_start=full.from_start[::stride], to_end=full.to_end[::stride])
        parts = np.arange(stride // 2, 24, stride) / 24
        errors.append(
            max(
                np.abs(one(part).displacement - other(part).displacement).max()
                for part in parts
                for one, other in ((some.since_start, full.since_start), (some.until_end, full.until_end))
            )
        )
    assert 1.6 < falls(errors)[0] < 2.4 and errors[1] < 0.003, errors


def test_maps_between_steps_converge_to_first_order_in_the_step(name):
    """Implicit diffusion and forces by steps are of first order; so are maps between steps."""
    runs, parts = [turned(name, 48, steps) for steps in (12, 24, 48)], (np.arange(12) + 0.5) / 12
    for way in ("since_start", "until_end"):
        differences = [
            max(
                np.abs(getattr(one, way)(part).displacement - getattr(two, way)(part).displacement).max()
                for part in parts
            )
            for one, two in pairwise(runs)
        ]
        assert 0.8 < falls(differences)[0] < 1.2, differences


def test_a_time_for_each_cell_equals_each_time_alone(name):
    """For both maps, with any times of the neighbours."""
    passage = turned(name, 32, 6)
    parts = np.random.default_rng(3).integers(0, 9, (24, 32)) / 8
    for way in (passage.since_start, passage.until_end):
        together = way(parts).displacement
        for part in np.unique(parts):
            np.testing.assert_array_equal(together[parts == part], way(part).displacement[parts == part])


def test_a_flow_that_is_not_finite_is_refused(make_solver, monkeypatch):
    solver = make_solver(16, 12)
    blown = lambda now, spare, *_, **__: solver.set_map(spare, np.full((12, 16, 2), np.nan))  # noqa: E731
    monkeypatch.setattr(solver, "step", blown)
    with pytest.raises(FloatingPointError, match="no longer finite"):
        flow_maps(solver, (), Timeline(0.5, 12, 1))
