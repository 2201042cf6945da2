"""Swings that last stay about their place, without folds; other motion is left as it is."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from wfluid.animation.animation import Animation
from wfluid.animation.swings import swing_period
from wfluid.domain.envelopes import Constant, Fade, product
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.timeline import Timeline
from wfluid.model.densities import Density
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.pictures.picture import Picture

START = (0.4, 0.35)
SWING = GaussianForce(START, (4.6, 2.3), 0.06, Oscillator(period=1.0))
"""An arrow of 0.065, as long as its radius."""


def maps(device, balanced, duration=4.0):
    picture = Picture(np.random.default_rng(0).random((24, 36, 3)).astype(np.float32), dtype="uint8")
    settings = {"cells": 96, "points": [START], "device": device.alias, "balanced": balanced}
    made = Animation(picture, Fluid(viscosity=0.001), [SWING], Timeline(duration, 15), **settings)
    return list(made.frames())


def test_swings_stay_about_their_place_as_long_as_they_last(device):
    """Every period after the first ends where that ended; left alone, the picture drifts away and folds."""
    free, held = maps(device, False), maps(device, True)
    assert min(frame.quality.jacobian_min for frame in free) < 0.5
    assert max(frame.quality.displacement_max for frame in free) > 0.15
    assert min(frame.quality.jacobian_min for frame in held) > 0.85
    assert max(frame.quality.displacement_max for frame in held) < 0.1
    for lap in (2, 3, 4):
        gap = held[15 * lap].map.displacement - held[15].map.displacement
        assert np.abs(gap).max() < 1e-4
        np.testing.assert_allclose(held[15 * lap].points, held[30].points, atol=1e-4)
    steps = [np.abs(b.map.displacement - a.map.displacement).max() for a, b in pairwise(held)]
    seams = [steps[n] for n in (15, 30, 45)]  # the first step of each period
    assert max(seams) <= max(step for n, step in enumerate(steps) if n % 15)


def test_points_are_where_the_maps_have_them(device):
    """Also in a last period that is cut short."""
    frames = maps(device, True, duration=2.6)
    assert np.linalg.norm(frames[20].points[0] - START) > 0.01
    for frame in frames[16:]:
        np.testing.assert_allclose(frame.map.source_at(frame.points)[0], START, atol=1e-4)


@pytest.mark.parametrize(
    ("envelopes", "fluid", "period"),
    [
        ([Oscillator(period=0.5)], {}, 1.0),
        ([product(2.0, Oscillator(period=1.0, start=0.25))], {}, 1.0),
        ([Oscillator(period=0.7)], {}, 0.0),
        ([Oscillator(period=3.0)], {}, 0.0),
        ([Oscillator(period=1.0, centred=False)], {}, 0.0),
        ([Oscillator(period=1.0, start=2.0)], {}, 0.0),
        ([Oscillator(period=1.0, end=2.0)], {}, 0.0),
        ([Oscillator(period=1.0) * Fade(rise=0.3)], {}, 0.0),
        ([Constant()], {}, 0.0),
        ([], {"densities": [Density()]}, 0.0),
    ],
)
def test_only_swings_all_the_time_have_a_period(envelopes, fluid, period):
    forces = [SWING, *(replace(SWING, envelope=envelope) for envelope in envelopes)]
    assert swing_period(forces, Fluid(**fluid), Timeline(4.0, 15)) == period
    assert swing_period([SWING], Fluid(), Timeline(1.4, 15)) == 0.0
