"""Keyframes are reached: by particles, by the picture, without folds, and the same way every time.

Residuals are told in pixels of a picture of 512: a quarter of one is good enough.
"""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from keyframe_cases import ARROW, CASES, PAIR, SIDE, Case
from scipy.ndimage import map_coordinates
from viscous_media import disc

import wfluid.keyframes.match
import wfluid.keyframes.search
from wfluid import Freeze, Grid, Picture, Solver
from wfluid.domain.limits import TOLERANCE
from wfluid.fields.device import open_device
from wfluid.keyframes.keyframes import targets_of
from wfluid.keyframes.match import REACHED, STOPPED, UNREACHABLE
from wfluid.keyframes.ways import plan_ways

LONG = {
    "twenty at random",
    "pins around",
    "a long scene",
    "a stiff disc",
    "a stiff disc that moves",
    "crossing",
}
"""Cases whose search takes several seconds."""


def cases(names):
    """A test for each case; those of `LONG` are marked long."""
    marked = [pytest.param(name, marks=[pytest.mark.long] if name in LONG else []) for name in names]
    return pytest.mark.parametrize("name", marked)


GOOD = 0.25
"""Tolerance for residuals [px]."""


@cache
def matched(name, device):
    """A function that searches for the match of a case once."""
    return CASES[name].match(device)


@pytest.fixture
def match_of(request):
    """The match of a case by its name."""
    device = request.config.getoption("--device")
    return lambda name: matched(name, device)


@pytest.fixture
def device_name(request):
    return request.config.getoption("--device")


def steps_of(match):
    """Steps at whose ends the keyframes of a match are."""
    dt = match.animation.timeline.dt
    return [round(arrival.keyframe.time / dt) for arrival in match.arrivals]


@cases(CASES)
def test_keyframes_are_reached_without_a_fold(match_of, name):
    """Particles reach their destinations, the map leads back to their points; det J > 0 in all frames."""
    case, match = CASES[name], match_of(name)
    assert match.status == REACHED
    residuals = [SIDE * arrival.residual for arrival in match.arrivals]
    assert max(residuals) <= GOOD, np.round(residuals, 3)
    assert match.residual == max(arrival.residual for arrival in match.arrivals)
    assert 0 < match.jacobian[0] <= 1 <= match.jacobian[1]
    assert not any(arrival.reason for arrival in match.arrivals)
    moved = [one for one in match.arrivals if not one.pinned]
    assert sorted((one.keyframe.point, one.keyframe.time) for one in moved) == sorted(
        (one.point, one.time) for one in case.keyframes
    )


@pytest.mark.parametrize("name", ["a path, one pinned", "not square"])
def test_arrivals_are_those_of_another_run_of_the_animation(match_of, name):
    """Positions of points, sources and extremes of det J of an independent run of `Animation`."""
    match = match_of(name)
    places = list(dict.fromkeys(arrival.keyframe.point for arrival in match.arrivals))
    frames = list(replace(match.animation, points=places).frames())
    per_frame = match.animation.timeline.steps_per_frame
    for arrival, step in zip(match.arrivals, steps_of(match), strict=True):
        frame = frames[step // per_frame]
        assert frame.time == pytest.approx(arrival.keyframe.time)
        n = places.index(arrival.keyframe.point)
        np.testing.assert_allclose(frame.points[n], arrival.particle, rtol=0, atol=1e-7)
        np.testing.assert_array_equal(frame.points, match.tracks[step])
        source = frame.map.source_at(np.array([arrival.keyframe.destination]))[0]
        np.testing.assert_allclose(source, arrival.source, rtol=0, atol=1e-7)
    extremes = [(frame.quality.jacobian_min, frame.quality.jacobian_max) for frame in frames]
    assert match.jacobian[0] == min(least for least, _ in extremes)
    assert match.jacobian[1] == max(greatest for _, greatest in extremes)


@pytest.mark.parametrize("name", ["one arrow", "a smile", "opposite, side by side", "a swap", "periodic"])
def test_points_stay_near_their_planned_ways(match_of, name):
    """Points are near their planned positions at all times: no late start, no rush at the end."""
    match = match_of(name)
    timeline, grid = match.animation.timeline, match.animation.grid
    particles = targets_of(CASES[name].keyframes, (), (grid.width, grid.height), timeline.end)
    for n, way in enumerate(plan_ways(particles, (grid.width, grid.height), 0)):
        times = np.array([timeline.time_of(step) for step in range(timeline.steps + 1)])
        aside = np.linalg.norm(match.tracks[:, n] - way.at(times), axis=1)
        assert aside.max() < 0.04 * way.length(0.0, timeline.end), aside.max()


def dots(places, height, spread=1.5):
    """A black picture with a white dot of a few pixels at each place."""
    x, y = np.arange(SIDE) + 0.5, (np.arange(height) + 0.5)[:, None]
    squares = [(x - SIDE * a) ** 2 + (y - SIDE * b) ** 2 for a, b in places]
    values = sum(np.exp(-0.5 * square / spread**2) for square in squares)
    return Picture(np.repeat(values[:, :, None], 3, axis=2).astype(np.float32))


def centroid(picture, near, reach=8):
    """Centroid of the light around a place [px]."""
    values = picture.pixels[..., 0].astype(np.float64)
    x, y = np.arange(values.shape[1]) + 0.5, (np.arange(values.shape[0]) + 0.5)[:, None]
    values = np.where(np.hypot(x - SIDE * near[0], y - SIDE * near[1]) < reach, values, 0)
    return np.array([(values * x).sum(), (values * y).sum()]) / values.sum()


@pytest.mark.parametrize("name", ["one arrow", "a smile", "not square", "a path, one pinned", "periodic"])
def test_a_dot_painted_at_a_point_appears_at_its_keyframes(match_of, name):
    """The oracle is the rendered frame: the centroid of a dot at the keyframe's time."""
    match = match_of(name)
    points = list(dict.fromkeys(arrival.keyframe.point for arrival in match.arrivals))
    pictures = [
        frame.picture for frame in replace(match.animation, picture=dots(points, CASES[name].height)).frames()
    ]
    per_frame = match.animation.timeline.steps_per_frame
    for arrival, step in zip(match.arrivals, steps_of(match), strict=True):
        destination = np.array(arrival.keyframe.destination)
        missed = centroid(pictures[step // per_frame], destination) - SIDE * destination
        assert np.linalg.norm(missed) <= 0.3, (arrival.keyframe, missed)


def velocity_at(state, places):
    """The velocity between faces by SciPy's cubic splines, for places inside the picture."""
    grid = state.grid
    (u, v), (x, y) = state.velocity, (places / (grid.hx, grid.hy)).T
    return np.stack(
        [map_coordinates(u, [y - 0.5, x], order=3), map_coordinates(v, [y, x - 0.5], order=3)], axis=1
    )


@cases(["one arrow", "crossing", "a third of the picture", "no-slip"])
def test_particles_traced_by_an_independent_integrator_arrive(match_of, device_name, name):
    """dx/dt = v(x, t): classical Runge-Kutta steps through the solver's fields, each kept for a step."""
    match = match_of(name)
    animation, timeline = match.animation, match.animation.timeline
    solver = Solver(animation.grid, animation.fluid, open_device(device_name))
    now, then = solver.rest(), solver.rest()
    places = np.array([arrival.keyframe.point for arrival in match.arrivals])
    assert set(steps_of(match)) == {timeline.steps}
    for step in range(timeline.steps):
        dt = timeline.dt
        k1 = velocity_at(now, places)
        k2 = velocity_at(now, places + dt / 2 * k1)
        k3 = velocity_at(now, places + dt / 2 * k2)
        k4 = velocity_at(now, places + dt * k3)
        places = places + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        t, until = timeline.time_of(step), timeline.time_of(step + 1)
        solver.step(now, then, animation.forces, t, dt, until=until)
        now, then = then, now
    wanted = np.array([arrival.keyframe.destination for arrival in match.arrivals])
    missed = SIDE * np.linalg.norm(places - wanted, axis=1)
    assert missed.max() <= 0.5, np.round(missed, 3)


@cases(["pins around", "a path, one pinned"])
def test_pins_stay_in_place_until_the_last_keyframe(match_of, name):
    """Within 1.5 px at every step until the last keyframe, not only at keyframes."""
    match = match_of(name)
    pins = np.array(CASES[name].pins)
    strayed = SIDE * np.linalg.norm(match.tracks[:, -len(pins) :] - pins, axis=2)
    assert strayed.max() <= 1.5, np.round(strayed.max(axis=0), 2)
    assert sum(arrival.pinned for arrival in match.arrivals) == len(pins) * len(set(steps_of(match)))


def test_only_free_parameters_of_the_users_forces_vary(match_of):
    """No force is added; parameters that are not free stay bit-equal."""
    case, match = CASES["the user's own forces"], match_of("the user's own forces")
    assert match.found == () and len(match.animation.forces) == 2
    (one, other), (given, same) = match.animation.forces, case.forces
    assert replace(one, vector=given.vector, center=given.center) == given and other == same
    assert one.vector != given.vector and one.center != given.center


def test_the_users_forces_act_beside_those_found(match_of, device_name):
    """An animation's own forces are kept, before the forces found; all keyframes are reached."""
    wind = CASES["the user's own forces"].forces[1]
    match = Case(arrows=[ARROW], forces=[wind], cells=64, duration=0.5).match(device_name)
    assert match.status == REACHED and match.animation.forces == (wind, *match.found)


def test_the_same_seed_finds_the_same_bits(match_of, device_name):
    match, again = match_of("one arrow"), CASES["one arrow"].match(device_name)
    np.testing.assert_array_equal(numbers_of(again), numbers_of(match))
    np.testing.assert_array_equal(again.tracks, match.tracks)
    assert again.evaluations == match.evaluations and again.history == match.history


def numbers_of(match):
    """All parameters found, as one vector."""
    return np.array([[*force.vector, *force.center, force.radius] for force in match.found]).ravel()


@pytest.mark.long
def test_points_pass_one_another_on_the_side_that_the_seed_chooses(device_name):
    """Two points that swap, stopped after the march: another seed sends both to the other side."""
    swap, sides = replace(CASES["a swap"], cells=48, duration=0.5), {}
    for seed in range(4):
        match = swap.match(device_name, seed=seed, progress=lambda progress: progress.stage != "march")
        assert match.status == STOPPED
        one, other = match.tracks[match.tracks.shape[0] // 2, :, 1] - 0.5
        assert abs(one) > 0.01 and one * other < 0
        sides.setdefault(one > 0, []).append(numbers_of(match))
    assert set(sides) == {True, False}
    for found in sides.values():
        assert all(np.array_equal(numbers, found[0]) for numbers in found)


def test_a_search_resumes_from_forces_found_before(match_of, device_name):
    """With one more arrow: fewer evaluations than from no forces, both arrive, none is added for the old."""
    before = match_of("one arrow")
    case = replace(CASES["one arrow"], arrows=PAIR)
    match, anew = case.match(device_name, start=before.found), case.match(device_name)
    assert match.status == REACHED and SIDE * match.residual <= GOOD and match.jacobian[0] > 0
    assert match.evaluations < 0.8 * anew.evaluations, (match.evaluations, anew.evaluations)
    added = match.found[len(before.found) :]
    assert len(added) == len(before.found)
    distances = [np.linalg.norm(np.subtract(force.center, PAIR[1][0])) for force in added]
    assert max(distances) < 0.2


def test_a_search_that_starts_at_its_result_keeps_it(match_of, device_name):
    before = match_of("one arrow")
    match = CASES["one arrow"].match(device_name, start=before.found)
    assert match.status == REACHED and len(match.found) == len(before.found)
    assert match.evaluations <= 4
    np.testing.assert_allclose(numbers_of(match), numbers_of(before), rtol=0, atol=0.02)


@pytest.mark.long
def test_a_long_scene_is_searched_span_by_span(match_of):
    """Windows end at keyframes; the forces of a span act within it, those of the next start at its end."""
    match = match_of("a long scene")
    windows = sorted({(force.envelope.start, force.envelope.end) for force in match.found})
    edges = sorted({edge for window in windows for edge in window})
    assert windows == list(pairwise(edges)) and edges[0] == 0 and edges[-1] == 5.5
    assert {2.0, 4.0} <= set(edges)
    stages = [progress.stage for progress in match.history]
    begun = [n for n, stage in enumerate(stages) if stage == "march" and (n == 0 or stages[n - 1] != "march")]
    assert len(begun) == 3


def test_a_search_reports_its_progress(match_of):
    """Iterations and evaluations are counted over all stages, in order."""
    match = match_of("a smile")
    order = ["march", "coarse", "fine"]
    assert [one.iteration for one in match.history] == list(range(1, match.iterations + 1))
    evaluations = [one.evaluations for one in match.history]
    assert evaluations == sorted(evaluations) and evaluations[-1] <= match.evaluations
    stages = [order.index(one.stage) for one in match.history]
    assert stages == sorted(stages) and set(stages) >= {0, 2}
    assert SIDE * match.history[-1].worst <= GOOD
    seconds = match.seconds
    assert seconds["total"] == pytest.approx(
        seconds["simulation"] + seconds["adjoint"] + seconds["optimiser"]
    )
    assert min(seconds.values()) > 0


@pytest.mark.parametrize("after", [1, 12, 17])
def test_a_stopped_search_keeps_its_best_forces(device_name, after):
    """The search ends at that iteration; its result is that of another run with its forces."""
    told = []

    def heed(progress):
        told.append(progress)
        return len(told) == after

    match = replace(CASES["a smile"], cells=48, duration=0.5).match(device_name, progress=heed)
    assert match.status == STOPPED and match.history == tuple(told) and len(told) == after
    points = [arrival.keyframe.point for arrival in match.arrivals]
    *_, last = replace(match.animation, points=points).frames()
    for arrival, place in zip(match.arrivals, last.points, strict=True):
        destination = np.array(arrival.keyframe.destination)
        source = last.map.source_at(destination[None])[0]
        missed = [place - destination, source - arrival.keyframe.point]
        assert arrival.residual == pytest.approx(max(map(np.linalg.norm, missed)), abs=1e-7)
    assert len(match.found) > 0


SMALL = {"cells": 24, "duration": 0.25}

HOPELESS = {
    "on a no-slip wall": (
        Case(arrows=[((0.5, 0.0), (0.55, 0.1))], fluid={"walls": "no-slip"}, **SMALL),
        "it lies on a no-slip wall, where the picture stays",
    ),
    "along a no-slip wall": (
        Case(arrows=[((0.5, 1.0), (0.6, 1.0))], fluid={"walls": "no-slip"}, **SMALL),
        "it lies on a no-slip wall, where the picture stays",
    ),
    "in a corner": (
        Case(arrows=[((0.0, 0.0), (0.0, 0.1))], **SMALL),
        "it lies in a corner, which the fluid cannot leave",
    ),
    "away from a wall": (
        Case(arrows=[((0.5, 1.0), (0.5, 0.9))], **SMALL),
        "it lies on a wall, along which the fluid can slide but not leave it",
    ),
    "onto a wall": (
        Case(arrows=[((0.1, 0.5), (0.0, 0.52))], **SMALL),
        "its destination lies on a wall, which nothing from within reaches",
    ),
    "frozen": (
        Case(
            arrows=[((0.5, 0.5), (0.6, 0.5))],
            fluid={"freeze": Freeze(disc(Grid(64, 64), radius=0.2).astype(float))},
            **SMALL,
        ),
        "it lies where the picture is frozen",
    ),
    "beside another": (
        Case(arrows=[((0.4, 0.5), (0.5, 0.5)), ((0.6, 0.5), (0.502, 0.5))], **SMALL),
        "another point has a destination within two cells of its own; use more cells",
    ),
}


@pytest.fixture
def briefly(monkeypatch):
    """Shorten searches that cannot succeed: one weight, one factor on radii, few evaluations."""
    monkeypatch.setattr(wfluid.keyframes.search, "LEAST_WEIGHT", wfluid.keyframes.search.WEIGHT)
    monkeypatch.setattr(
        wfluid.keyframes.search, "EVALUATIONS", dict.fromkeys(wfluid.keyframes.search.EVALUATIONS, 8)
    )
    monkeypatch.setattr(wfluid.keyframes.match, "FACTORS", wfluid.keyframes.match.FACTORS[:1])


@pytest.mark.usefixtures("briefly")
@pytest.mark.parametrize("name", HOPELESS)
def test_unreachable_keyframes_are_reported_with_reason_and_residual(device_name, name):
    """No error is raised: the best result is returned, with finite residuals."""
    case, reason = HOPELESS[name]
    match = case.match(device_name)
    assert match.status == UNREACHABLE
    assert {arrival.reason for arrival in match.arrivals} == {reason}
    assert TOLERANCE < match.residual < 1
    assert np.all(np.isfinite(match.tracks)) and np.all(np.isfinite(numbers_of(match)))


@pytest.mark.usefixtures("briefly")
def test_reachable_keyframes_come_near_beside_unreachable_ones(device_name):
    """The unreachable keyframe has a reason; the other one has none and is almost reached."""
    case = Case(arrows=[((0.5, 0.0), (0.5, 0.1)), ((0.4, 0.6), (0.48, 0.56))], cells=48, duration=0.5)
    wall, free = case.match(device_name).arrivals
    assert wall.reason and SIDE * wall.residual > 20
    assert not free.reason and SIDE * free.residual < 2
