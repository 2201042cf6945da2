"""The start of a search: ways pass their keyframes and keep apart; forces lie on them, in windows."""

import math
from itertools import combinations, pairwise

import numpy as np
import pytest

from wfluid import Timeline
from wfluid.keyframes.keyframes import ParticleKeyframe, targets_of
from wfluid.keyframes.search import Smoothness
from wfluid.keyframes.way_misfit import HOLD, WayMisfit, longest
from wfluid.keyframes.ways import (
    LEAST_STEPS,
    LEAST_WINDOWS,
    NARROWEST,
    WIDEST,
    Way,
    forces_along,
    plan_ways,
    radii_of,
    window_edges,
)

EXTENT = (1.0, 0.8)
TIMELINE = Timeline(1.0, fps=24, substeps=2)


def particles(*paths, pins=()):
    """Targets of points with destinations by time."""
    keyframes = [ParticleKeyframe(point, to, t) for point, stops in paths for t, to in stops.items()]
    return targets_of(keyframes, pins, EXTENT, TIMELINE.end)


PATH = ((0.3, 0.4), {0.25: (0.5, 0.3), 0.5: (0.6, 0.5), 1.0: (0.45, 0.45)})
SWAP = [((0.4, 0.4), {1.0: (0.6, 0.4)}), ((0.6, 0.4), {1.0: (0.4, 0.4)})]
CROSSING = [((0.3, 0.3), {1.0: (0.7, 0.5)}), ((0.3, 0.5), {1.0: (0.7, 0.3)})]
HEAD_ON = [((0.2, 0.39), {0.75: (0.8, 0.41)}), ((0.8, 0.4), {0.75: (0.2, 0.4)})]
MEETINGS = {"swap": SWAP, "crossing": CROSSING, "head-on": HEAD_ON}


@pytest.mark.parametrize("bend", [0.0, 0.25, -0.7])
def test_a_way_passes_its_keyframes_with_any_bend(bend):
    """x(0) = p and x(t_k) = K_k; the way is continuous, and constant after the last keyframe."""
    (own,) = particles(PATH)
    way = Way(own, bend)
    at = way.at(np.array([0.0, 0.25, 0.5, 1.0, 1.5]))
    np.testing.assert_allclose(at, [PATH[0], *PATH[1].values(), (0.45, 0.45)], rtol=0, atol=1e-12)
    np.testing.assert_allclose(way.at(0.25), (0.5, 0.3), rtol=0, atol=1e-12)
    steps = np.linalg.norm(np.diff(way.at(np.linspace(0, 1.2, 1201)), axis=0), axis=1)
    assert steps.max() < 0.01


def test_a_way_begins_at_rest_and_runs_evenly_from_keyframe_to_keyframe():
    """After a fraction p of a leg's time p^2 (2 - p) of the first distance is covered, then p of each."""
    (own,) = particles(PATH)
    way, (a, b, c) = Way(own, 0.0), np.array([(0.3, 0.4), (0.5, 0.3), (0.6, 0.5)])
    for part in (0.01, 0.3, 0.8):
        np.testing.assert_allclose(way.at(0.25 * part), a + part**2 * (2 - part) * (b - a), atol=1e-12)
        np.testing.assert_allclose(way.at(0.25 + 0.25 * part), b + part * (c - b), atol=1e-12)
    length = math.dist(a, b) + math.dist(b, c)
    assert way.length(0.0, 0.5) == pytest.approx(length, rel=1e-9)
    assert Way(own, 0.3).length(0.0, 0.5) > 1.1 * length


def test_a_bend_lies_to_the_left_of_the_way():
    """On the way from (0.2, 0.4) to (0.6, 0.4) left is up, towards lesser y: by a quarter of 0.4."""
    (own,) = particles(((0.2, 0.4), {0.5: (0.2, 0.4), 1.0: (0.6, 0.4)}))
    np.testing.assert_allclose(Way(own, 0.25).at(0.75), (0.4, 0.3), atol=1e-12)
    np.testing.assert_allclose(Way(own, -0.25).at(0.75), (0.4, 0.5), atol=1e-12)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
@pytest.mark.parametrize("name", MEETINGS)
def test_ways_bend_where_straight_lines_would_meet(name, seed):
    """Their distance is always at least half the least one at their ends; that of straight lines is not."""
    own = particles(*MEETINGS[name])
    ends = min(
        min(math.dist(a.point, b.point), math.dist(a.destinations[-1], b.destinations[-1]))
        for a, b in combinations(own, 2)
    )
    assert nearest([Way(one, 0.0) for one in own]) < 0.1 * ends
    assert nearest(plan_ways(own, EXTENT, seed)) > 0.5 * ends


def nearest(ways):
    """The least distance of two ways at one time, over independent samples of time."""
    times = np.linspace(0, 1, 501)
    places = [way.at(times) for way in ways]
    return min(np.linalg.norm(a - b, axis=1).min() for a, b in combinations(places, 2))


def test_a_way_goes_round_a_pin():
    own = particles(((0.3, 0.4), {1.0: (0.6, 0.4)}), pins=[(0.45, 0.4)])
    assert nearest([Way(one, 0.0) for one in own]) < 0.001
    ways = plan_ways(own, EXTENT, 0)
    assert nearest(ways) > 0.5 * 0.15
    np.testing.assert_array_equal(ways[1].at(np.linspace(0, 1, 5)), [(0.45, 0.4)] * 5)


@pytest.mark.parametrize("y", [0.03, 0.77])
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_ways_bend_away_from_walls_for_any_seed(y, seed):
    """A single way comes no nearer to the wall than its start; ways that swap stay in the picture."""
    arrow, swap = ((0.3, y), {1.0: (0.7, y)}), [((0.3, y), {1.0: (0.6, y)}), ((0.6, y), {1.0: (0.3, y)})]
    for paths in ([arrow], swap):
        for way in plan_ways(particles(*paths), EXTENT, seed):
            heights = way.at(np.linspace(0, 1, 201))[:, 1]
            room = np.minimum(heights, EXTENT[1] - heights)
            assert room.min() > (0.029 if len(paths) == 1 else 0.0)


def test_the_seed_chooses_the_side():
    """The same seed gives the same ways; different seeds give both sides, as mirror images."""
    own = particles(*SWAP)
    found = {tuple(way.bend for way in plan_ways(own, EXTENT, seed)) for seed in range(8)}
    assert len(found) == 2
    one, other = found
    np.testing.assert_array_equal(one, np.negative(other))
    for seed in range(8):
        again = [[way.bend for way in plan_ways(own, EXTENT, seed)] for _ in range(2)]
        assert again[0] == again[1]


def test_radii_are_half_the_distance_of_ways_within_their_limits():
    apart = particles(((0.3, 0.3), {1.0: (0.4, 0.3)}), ((0.3, 0.4), {1.0: (0.4, 0.4)}))
    ways = [Way(one, 0.0) for one in apart]
    np.testing.assert_allclose(radii_of(ways), [0.05, 0.05])
    np.testing.assert_allclose(radii_of(ways, 0.5), [0.025, 0.025])
    assert radii_of(ways[:1]) == [WIDEST]
    close = particles(((0.3, 0.3), {1.0: (0.4, 0.3)}), ((0.3, 0.302), {1.0: (0.4, 0.302)}))
    assert radii_of([Way(one, 0.0) for one in close]) == [NARROWEST] * 2
    far = particles(((0.1, 0.3), {1.0: (0.1, 0.4)}), ((0.9, 0.3), {1.0: (0.9, 0.4)}), pins=[(0.1, 0.34)])
    radii = radii_of([Way(one, 0.0) for one in far])
    assert radii[0] == radii[2] == NARROWEST and radii[1] == WIDEST  # the first runs over the pin


def test_windows_begin_at_0_and_end_at_keyframes():
    """Edges increase and include every keyframe, the last one as the end; no window is too short."""
    own = particles(PATH, ((0.7, 0.6), {0.75: (0.8, 0.7)}))
    for radius in (0.01, 0.05, 0.12):
        ways = [Way(one, 0.1) for one in own]
        edges = window_edges(ways, [radius] * 2, TIMELINE)
        assert edges[0] == 0 and edges[-1] == 48
        assert {12, 24, 36} <= set(edges)
        lengths = np.diff(edges)
        assert lengths.min() >= LEAST_STEPS and len(lengths) >= LEAST_WINDOWS
        for way, (first, last) in ((way, pair) for way in ways for pair in pairwise([0, 12, 24, 36, 48])):
            count = edges.index(last) - edges.index(first)
            long = way.length(TIMELINE.time_of(first), TIMELINE.time_of(last))
            assert long <= 1.01 * count * radius or count == (last - first) // LEAST_STEPS


def test_windows_end_with_the_last_keyframe():
    own = particles(((0.3, 0.4), {0.5: (0.5, 0.3)}))
    edges = window_edges([Way(own[0], 0.1)], [0.12], TIMELINE)
    assert edges[0] == 0 and edges[-1] == 24 and len(edges) == LEAST_WINDOWS + 1
    one_step = particles(((0.3, 0.4), {1 / 48: (0.31, 0.4)}))
    assert window_edges([Way(one_step[0], 0.1)], [0.006], TIMELINE) == [0, 1]


def test_forces_lie_on_the_way_in_windows_that_cover_its_time():
    """Each lies at the expected position of its point in the middle of its window; windows are contiguous."""
    path, short = particles(PATH, ((0.7, 0.6), {0.5: (0.8, 0.7)}))
    edges = window_edges([Way(path, 0.2), Way(short, 0.2)], [0.05, 0.05], TIMELINE)
    for one, end in ((path, 1.0), (short, 0.5)):
        way = Way(one, 0.2)
        forces = list(forces_along(way, 0.05, edges, TIMELINE))
        assert [window for window, _ in forces] == list(range(len(forces)))
        windows = [(force.envelope.start, force.envelope.end) for _, force in forces]
        assert windows[0][0] == 0 and windows[-1][1] == end
        assert all(before[1] == after[0] for before, after in pairwise(windows))
        for (window, force), (start, stop) in zip(forces, windows, strict=True):
            assert (start, stop) == tuple(TIMELINE.time_of(edge) for edge in edges[window : window + 2])
            np.testing.assert_array_equal(force.center, way.at((start + stop) / 2))
            assert force.vector == (0.0, 0.0) and force.radius == 0.05


def journey_of(paths, moments, pins=(), **more):
    """The misfit of ways without a bend."""
    own = particles(*paths, pins=pins)
    return WayMisfit(
        [Way(one, 0.0) for one in own], np.array([one.point for one in own]), moments, 0.1, **more
    )


@pytest.mark.parametrize("led", [1.0, 0.0])
def test_the_misfit_is_half_the_sum_of_squares_in_units_of_a_radius(led):
    """Weights are those of keyframes; between them 1 for guided points and `HOLD` for pins."""
    paths, pin = [((0.3, 0.4), {0.5: (0.5, 0.3)}), ((0.3, 0.6), {1.0: (0.5, 0.6)})], (0.7, 0.7)
    off = np.array([(0.03, 0.04), (0.0, -0.02), (0.06, 0.08)])
    squares = np.sum((off / 0.1) ** 2, axis=1)
    journey = journey_of(paths, (0.25, 0.5, 0.75, 1.0), [pin], guided=[bool(led)] * 3)
    ways = [Way(one, 0.0) for one in particles(*paths, pins=[pin])]
    places = {t: np.array([way.at(t) for way in ways]) + off for t in journey.times}
    for t, weights in {
        0.25: (led, led, HOLD),
        0.5: (1.0, led, 1.0),
        0.75: (0.0, led, HOLD),
        1.0: (0.0, 1.0, 1.0),
    }.items():
        value, slope = journey.at(t, places[t])
        assert value == pytest.approx(0.5 * np.dot(weights, squares), rel=1e-9)
        np.testing.assert_allclose(slope, np.array(weights)[:, None] * off / 0.1**2, rtol=1e-9)
    assert longest(journey.misfits(places)) == pytest.approx(0.1)  # of the pin, at its keyframes


def test_a_keyframe_counts_as_much_as_its_weight():
    """phi = 1/2 sum of weight |q - K|^2 / r^2, and its gradient; misfits are not weighted."""
    keyframes = [
        ParticleKeyframe((0.3, 0.4), (0.5, 0.3), 0.5, weight=7.0),
        ParticleKeyframe((0.3, 0.4), (0.6, 0.3), 1.0, weight=0.25),
        ParticleKeyframe((0.3, 0.6), (0.5, 0.6), 1.0, weight=3.0),
    ]
    own = targets_of(keyframes, [], EXTENT, TIMELINE.end)
    journey = WayMisfit([Way(one, 0.0) for one in own], np.array([one.point for one in own]), (0.5, 1.0), 0.1)
    off = np.array([(0.03, 0.04), (0.0, -0.02)])
    at_half, at_end = np.array([(0.5, 0.3), (0.4, 0.6)]) + off, np.array([(0.6, 0.3), (0.5, 0.6)]) + off
    assert journey.at(0.5, at_half)[0] == pytest.approx(0.5 * 7.0 * 0.0025 / 0.01)
    assert journey.at(1.0, at_end)[0] == pytest.approx(0.5 * (0.25 * 0.0025 + 3.0 * 0.0004) / 0.01)
    np.testing.assert_allclose(journey.at(0.5, at_half)[1], [(21.0, 28.0), (0, 0)])
    np.testing.assert_allclose(journey.at(1.0, at_end)[1], [(0.75, 1.0), (0.0, -6.0)])
    assert longest(journey.misfits({1.0: at_end})) == pytest.approx(0.05)


def test_the_misfit_guides_only_the_selected_points():
    paths = [((0.3, 0.4), {1.0: (0.5, 0.3)}), ((0.3, 0.6), {1.0: (0.5, 0.6)})]
    journey = journey_of(paths, (0.5, 1.0), guided=[False, True])
    slope = journey.at(0.5, np.zeros((2, 2)))[1]
    assert not slope[0].any() and slope[1].any()
    assert journey.at(1.0, np.zeros((2, 2)))[1].all()


def test_corrections_and_multipliers_shift_the_aims_of_the_misfit():
    """A correction moves the target; a multiplier moves only the aim and keeps the misfit."""
    by = {1.0: np.array([[0.02, -0.02]])}
    for kind, left in (("corrections", 0.0), ("multipliers", np.hypot(0.02, 0.02))):
        journey = journey_of([((0.3, 0.4), {1.0: (0.5, 0.3)})], (0.5, 1.0), **{kind: by})
        value, slope = journey.at(1.0, np.array([[0.52, 0.28]]))
        assert value == pytest.approx(0, abs=1e-12) and np.abs(slope).max() < 1e-9
        misfits = journey.misfits({1.0: np.array([[0.52, 0.28]])})
        assert longest(misfits) == pytest.approx(left, abs=1e-12)
        assert journey.at(1.0, np.array([[0.5, 0.3]]))[0] == pytest.approx(0.5 * 0.08)


def test_smoothness_is_half_the_sum_of_squared_deviations_from_expected_changes():
    """1/2 w sum |(m_k+1 - e_k+1) - (m_k - e_k)|^2, chain by chain; its gradient by differences."""
    rng = np.random.default_rng(0)
    entries = [np.array([[0, 1], [4, 5], [2, 3]]), np.array([[6, 8], [9, 7]])]
    expected = [rng.normal(size=rows.shape) for rows in entries]
    smooth, m = Smoothness(list(zip(entries, expected, strict=True)), 0.3), rng.normal(size=11)
    given = rng.normal(size=11)
    value, gradient = smooth.added(2.0, given, m)
    terms = [
        (m[rows[n + 1, c]] - aims[n + 1, c]) - (m[rows[n, c]] - aims[n, c])
        for rows, aims in zip(entries, expected, strict=True)
        for n in range(len(rows) - 1)
        for c in (0, 1)
    ]
    assert value == pytest.approx(2.0 + 0.15 * sum(term**2 for term in terms), rel=1e-12)
    for n, unit in enumerate(np.eye(11)):
        ahead, behind = (smooth.added(2.0, given, m + h * unit)[0] for h in (1e-4, -1e-4))
        assert gradient[n] - given[n] == pytest.approx((ahead - behind) / 2e-4, abs=1e-7)
