"""Keyframes that contradict, or that nothing could be computed for, are refused in one line each."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from wfluid import Animation, Fluid, Timeline
from wfluid.keyframes.keyframes import COINCIDENT, ParticleKeyframe, targets_of
from wfluid.keyframes.match import match_keyframes
from wfluid.pictures.picture import Picture

EXTENT, END = (1.0, 0.75), 1.0

A, B, C, D = (0.3, 0.4), (0.5, 0.6), (0.7, 0.2), (0.2, 0.7)

NEAR = COINCIDENT / 2
"""Places so far apart are one."""


def beside(place, by=NEAR):
    return place[0] + by, place[1]


def refuses(message, build, *arguments, **more):
    """It raises ValueError with one line that contains the message."""
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        build(*arguments, **more)
    assert "\n" not in str(caught.value)


def particles(*keyframes, pins=(), end=END, side=1.0):
    return targets_of([ParticleKeyframe(*one) for one in keyframes], pins, EXTENT, end, side)


def test_keyframes_of_one_point_make_a_path_in_the_order_of_their_times():
    """Points keep the order in which they first appear; those nearer than a hair are one; pins come last."""
    found = particles(
        (B, C, 0.5),
        (A, B, 0.75, 2.0),
        (beside(B), A, 0.25, 3.0),
        pins=[D, list(D), beside(D)],
    )
    assert [one.point for one in found] == [B, A, D]
    assert [one.times for one in found] == [(0.25, 0.5), (0.75,), (0.25, 0.5, 0.75)]
    assert [one.weights for one in found] == [(3.0, 1.0), (2.0,), (1.0, 1.0, 1.0)]
    assert [one.pinned for one in found] == [False, False, True]
    np.testing.assert_array_equal(found[0].destinations, [A, C])
    np.testing.assert_array_equal(found[1].destinations, [B])
    np.testing.assert_array_equal(found[2].destinations, [D, D, D])


def test_what_may_stand_beside_one_another_is_not_refused():
    """A point sent to where another starts; two to one place at two times; two points hairs apart."""
    particles((A, B, 1.0), (B, A, 1.0))
    particles((A, C, 0.5), (A, B, 1.0), (B, C, 1.0))
    particles((A, B, 1.0), (beside(A, 3 * COINCIDENT), beside(B, 3 * COINCIDENT), 1.0))
    particles((A, A, 1.0))
    particles(((0.0, 0.0), EXTENT, END * (1 + 1e-12)))


@pytest.mark.parametrize(
    ("keyframes", "pins", "says"),
    [
        ([], [], "no keyframes: say where at least one point should be"),
        ([], [A], "no keyframes: say where at least one point should be"),
        ([(A, B, 1.0), (A, C, 1.0)], [], "the point 0.3,0.4 has two destinations at 1 s"),
        ([(A, B, 1.0), (beside(A), C, 1.0)], [], "the point 0.3,0.4 has two destinations at 1 s"),
        ([(A, B, 1.0), (A, B, 1.0)], [], "the point 0.3,0.4 has the same keyframe twice at 1 s"),
        (
            [(A, C, 1.0), (B, beside(C), 1.0)],
            [],
            "the points 0.3,0.4 and 0.5,0.6 have one destination, 0.7,0.2, at 1 s",
        ),
        (
            [(A, B, 0.5), (A, C, 1.0), (B, B, 0.25), (B, beside(C), 1.0)],
            [],
            "the points 0.3,0.4 and 0.5,0.6 have one destination, 0.7,0.2, at 1 s",
        ),
        (
            [(A, C, 0.5), (B, C, 0.5), (B, D, 1.0)],
            [],
            "the points 0.3,0.4 and 0.5,0.6 have one destination, 0.7,0.2, at 0.5 s",
        ),
        ([((1.01, 0.4), B, 1.0)], [], "the point 1.01,0.4 lies outside the picture, 1 x 0.75"),
        ([(A, (0.5, 0.76), 1.0)], [], "the destination 0.5,0.76 lies outside the picture, 1 x 0.75"),
        ([(A, (-0.01, 0.5), 1.0)], [], "the destination -0.01,0.5 lies outside the picture, 1 x 0.75"),
        ([(A, B, 1.0)], [(0.5, 0.8)], "the pin 0.5,0.8 lies outside the picture, 1 x 0.75"),
        ([(A, B, 1.01)], [], "a keyframe at 1.01 s: expected at most the duration, 1 s"),
        ([(A, B, 1.0)], [beside(A)], "is pinned and moved"),
        ([(A, B, 1.0)], [A], "the point 0.3,0.4 is pinned and moved"),
        ([(A, B, 0.5), (A, C, 1.0)], [beside(B)], "the point 0.3,0.4 is sent to 0.5,0.6, which is pinned"),
    ],
)
def test_keyframes_that_contradict_are_refused(keyframes, pins, says):
    refuses(says, particles, *keyframes, pins=pins)


def test_refusals_speak_of_pixels_if_the_side_is_in_pixels():
    refuses("the point 120,160 has two destinations at 1 s", particles, (A, B, 1.0), (A, C, 1.0), side=400)
    says = "the destination 200,304 lies outside the picture, 400 x 300"
    refuses(says, particles, (A, (0.5, 0.76), 1.0), side=400)
    says = "the point 120,160 is sent to 200,240, which is pinned"
    refuses(says, particles, (A, B, 1.0), pins=[B], side=400)
    refuses("the point 120,160 is pinned and moved", particles, (A, B, 1.0), pins=[A], side=400)
    says = "the points 120,160 and 200,240 have one destination, 280,80, at 1 s"
    refuses(says, particles, (A, C, 1.0), (B, C, 1.0), side=400)


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        (((math.nan, 0.5), B, 1.0), "ParticleKeyframe.point (nan, 0.5): expected two finite numbers"),
        ((A, (0.5, math.inf), 1.0), "ParticleKeyframe.destination (0.5, inf): expected two finite numbers"),
        (((0.1, 0.2, 0.3), B, 1.0), "ParticleKeyframe.point (0.1, 0.2, 0.3): expected two finite numbers"),
        ((A, B, 0.0), "ParticleKeyframe.time 0.0: expected a positive number"),
        ((A, B, -1.0), "ParticleKeyframe.time -1.0: expected a positive number"),
        ((A, B, math.inf), "ParticleKeyframe.time inf: expected a positive number"),
        ((A, B, 1.0, 0.0), "ParticleKeyframe.weight 0.0: expected a positive number"),
        ((A, B, 1.0, math.nan), "ParticleKeyframe.weight nan: expected a positive number"),
    ],
)
def test_numbers_that_no_keyframe_has_are_refused(numbers, says):
    refuses(says, ParticleKeyframe, *numbers)


def test_places_may_be_any_pairs_of_numbers():
    keyframe = ParticleKeyframe([0, 1], np.array([0.25, 0.5]), 1)
    assert keyframe.point == (0.0, 1.0) and keyframe.destination == (0.25, 0.5)
    assert keyframe == ParticleKeyframe((0, 1), (0.25, 0.5), 1)


@pytest.fixture
def animation():
    """A picture of 40 x 30, a second long, in steps of 1/48 s, which no test here computes."""
    picture = Picture(np.zeros((30, 40, 3), np.float32))
    return Animation(picture, Fluid(), [], Timeline(1.0, fps=24, substeps=2), cells=16)


@pytest.mark.parametrize(
    ("change", "settings", "says"),
    [
        ({}, {"tolerance": 0.0}, "tolerance 0.0: expected a positive number"),
        ({}, {"tolerance": -1e-3}, "tolerance -0.001: expected a positive number"),
        ({}, {"tolerance": math.nan}, "tolerance nan: expected a positive number"),
        ({}, {"tolerance": math.inf}, "tolerance inf: expected a positive number"),
        (
            {"loop": "pingpong"},
            {},
            "a loop (pingpong) goes without keyframes: its end is its beginning",
        ),
        ({}, {"pins": [A], "side": 40}, "the point 12,16 is pinned and moved"),
    ],
)
def test_what_cannot_be_searched_is_refused(animation, change, settings, says):
    keyframes = [ParticleKeyframe(A, B, 1.0)]
    refuses(says, match_keyframes, replace(animation, **change), keyframes, **settings)


def test_a_keyframe_between_two_steps_is_told_them(animation):
    """At 0.51 s, steps end at 24/48 s and 25/48 s; before the first step, at 1/48 s."""
    for time, says in [
        (0.51, "a keyframe at 0.51 s falls between two steps, at 0.5, 0.520833 s"),
        (0.005, "a keyframe at 0.005 s falls between two steps, at 0, 0.0208333 s"),
    ]:
        refuses(says, match_keyframes, animation, [ParticleKeyframe(A, B, time)])
    refuses("no keyframes", match_keyframes, animation, [])
    says = "a keyframe at 1.1 s: expected at most the duration, 1 s"
    refuses(says, match_keyframes, animation, [ParticleKeyframe(A, B, 1.1)])


def test_times_that_differ_by_rounding_are_one(animation):
    """0.1 + 0.2 is 0.30000000000000004; both are when the twelfth step of 1/40 s ends."""
    animation = replace(animation, timeline=Timeline(1.0, fps=20, substeps=2))
    keyframes = [ParticleKeyframe(A, B, 0.3), ParticleKeyframe(A, C, 0.1 + 0.2)]
    refuses("the point 0.3,0.4 has two destinations at 0.3 s", match_keyframes, animation, keyframes)
    keyframes = [ParticleKeyframe(A, C, 0.3), ParticleKeyframe(B, C, 0.1 + 0.2)]
    refuses("have one destination, 0.7,0.2, at 0.3 s", match_keyframes, animation, keyframes)
