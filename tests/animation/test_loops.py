"""Loops close: periods fit, the last frame meets the first, and the seam measures the difference."""

from dataclasses import replace

import numpy as np
import pytest

from wfluid.animation.animation import Animation
from wfluid.animation.loops import (
    acting_time,
    fit_to_loop,
    fitted_period,
    frames_of,
    laps_of,
    starting_impulses,
)
from wfluid.domain.envelopes import Constant, Fade
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Path
from wfluid.domain.timeline import Timeline
from wfluid.model.densities import Density, Source
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce, VortexForce
from wfluid.model.noise_force import NoiseForce
from wfluid.pictures.picture import Picture

SWING = Oscillator(period=0.53, phase=0.5, centred=False)


def animation(loop, forces, device, duration=1.0, fps=15.0, cells=64, **settings):
    pixels = np.random.default_rng(0).random((24, 32, 3)).astype(np.float32)
    fluid = settings.pop("fluid", Fluid(viscosity=0.003))
    return Animation(
        Picture(pixels, None, "uint8", None),
        fluid,
        forces,
        Timeline(duration, fps),
        cells=cells,
        loop=loop,
        device=device.alias,
        **settings,
    )


def maps(frames):
    return np.array([frame.map.displacement for frame in frames])


def test_periods_are_fitted_to_the_loop():
    """The nearest period that divides the loop; an oscillator's start becomes its phase."""
    assert fitted_period(0.53, 2.0) == 0.5 and fitted_period(5.0, 2.0) == 2.0
    force = GaussianForce(
        (0.5, 0.5), (1, 0), 0.1, Oscillator(period=0.52, phase=0.2, start=0.1) * Fade(rise=0.3)
    )
    swing, fade = fit_to_loop(force, 1.0).envelope.factors
    assert (swing.period, swing.start, swing.centred) == (0.5, 0.0, False) and fade == Fade(rise=0.3)
    full = Oscillator(period=0.5, phase=0.2, start=0.1, centred=False)
    assert swing.value(0.3) == pytest.approx(full.value(0.3))
    assert fit_to_loop(NoiseForce(strength=1.0, period=0.9), 2.0).period == 1.0


def test_starting_impulses_make_velocities_swing_about_zero():
    """A free particle under impulse and force has no mean velocity over the loop, for any phase."""
    for phase in (0.0, 0.1, 0.5, 0.8):
        swing = Oscillator(period=0.5, phase=phase, centred=False)
        (blow,) = starting_impulses([GaussianForce((0.5, 0.5), (2.0, 0.0), 0.1, swing)], 1.0, 400)
        t = np.linspace(0, 1, 4001)[:-1]
        velocity = blow.envelope.integral(0, 1) + np.array([swing.integral(0, s) for s in t])
        assert abs(velocity.mean()) < 1e-3 * np.abs(velocity).max(), phase
    assert starting_impulses([GaussianForce((0.5, 0.5), (2.0, 0.0), 0.1, Constant())], 1.0, 10) == []
    cosine = Oscillator(period=0.5, phase=0.25, centred=False)
    assert all(
        abs(b.envelope.gain) < 1e-12
        for b in starting_impulses([VortexForce((0.5, 0.5), 1.0, 0.1, cosine)], 1.0, 100)
    )


def test_an_oscillating_loop_returns_to_its_untouched_picture(device):
    """The first frame is the picture; the step across the seam is like its neighbours."""
    made = animation("oscillate", [GaussianForce((0.5, 0.4), (2.0, 1.0), 0.1, SWING)], device)
    run = made.frames()
    frames = list(run)
    assert len(frames) == 15 == made.frame_count
    np.testing.assert_array_equal(frames[0].picture.pixels, made.picture.pixels)
    shown = maps(frames)
    steps = np.abs(np.diff(shown, axis=0)).max(axis=(1, 2, 3))
    across = np.abs(shown[0] - shown[-1]).max()
    assert np.abs(shown).max() > 0.004
    assert across < 1.3 * steps.max(), (across, steps.max())
    seam = run.seam
    assert seam.position_max < 1e-6  # of the frame that would follow the last
    assert seam.velocity_max / 15 < 0.5 * steps.max(), (seam, steps.max())
    assert 0 < seam.drift_mean < seam.drift_max


HARD = GaussianForce((0.4, 0.35), (4.6, 2.3), 0.06, Oscillator(period=1.0, phase=0.5, centred=False))
"""A swing as long as its own radius: the fluid streams twice as far in a period."""


def sizes(displacements):
    """The longest displacement of each map."""
    return np.hypot(*np.moveaxis(np.asarray(displacements), -1, 0)).max(axis=(-2, -1))


def test_a_loop_of_long_swings_does_not_fold_and_its_seam_is_no_jump(device):
    """The fluid alone keeps areas to 2 %; so does the loop, and the step across its seam is no larger."""
    run = animation("oscillate", [HARD], device, fluid=Fluid(viscosity=0.001), cells=96).frames()
    frames = list(run)
    shown = maps(frames)
    steps = sizes(np.diff(shown, axis=0))
    assert sizes(shown).max() > 0.04
    assert sizes(shown[0] - shown[-1]) <= 1.001 * steps.max()
    assert min(frame.quality.jacobian_min for frame in frames) > 0.97
    assert max(frame.quality.log_strain for frame in frames) < 0.6
    assert run.seam.position_max < 1e-6


def test_a_loop_of_five_periods_is_five_times_the_same(device):
    """Swings stay about their place as long as they last: to the bit."""
    made = animation("oscillate", [HARD], device, duration=5.0, fluid=Fluid(viscosity=0.001))
    shown = maps(made.frames())
    assert len(shown) == 75 and sizes(shown).max() > 0.04
    for lap in range(1, 5):
        np.testing.assert_array_equal(shown[15 * lap : 15 * lap + 15], shown[:15])


@pytest.mark.parametrize(
    ("changes", "fluid", "laps"),
    [
        ({}, {}, 4),
        ({"envelope": Oscillator(period=2.0)}, {}, 2),
        ({"envelope": Oscillator(period=1.0) * Fade(rise=0.3)}, {}, 1),
        ({"center": Path((0, 1), ((0.4, 0.4), (0.5, 0.4)))}, {}, 1),
        ({}, {"densities": [Density()]}, 1),
    ],
)
def test_laps_are_counted_where_all_is_periodic(changes, fluid, laps):
    force = replace(HARD, **changes)
    assert laps_of([HARD, force], 4.0, 60, Fluid(**fluid)) == laps
    assert laps_of([HARD], 4.0, 62, Fluid()) == 2  # laps are of whole frames


def test_points_of_a_loop_are_where_the_map_has_them(device):
    """Each frame's map leads from a tracked point to its place in the picture."""
    start = (0.42, 0.36)
    made = animation("oscillate", [HARD], device, fluid=Fluid(viscosity=0.001), points=[start])
    frames = list(made.frames())
    assert max(np.linalg.norm(frame.points[0] - start) for frame in frames) > 0.02
    for frame in frames:
        np.testing.assert_allclose(frame.map.source_at(frame.points)[0], start, atol=1e-4)


def test_forces_of_a_pingpong_act_on_the_way_out_by_default():
    """An even number of frames: 0.9 s at 15 a second are 14, which turn after 7."""
    assert acting_time("pingpong", Timeline(0.9, 15)) == pytest.approx(7 / 15)
    assert acting_time("crossfade", Timeline(0.9, 15)) == acting_time(None, Timeline(0.9, 15)) == 0.9


def test_a_pingpong_returns_the_same_way(device):
    made = animation("pingpong", [VortexForce((0.5, 0.4), 6.0, 0.1)], device, duration=0.9)
    run = made.frames()
    frames = list(run)
    shown = maps(frames)
    assert len(frames) == 14 == made.frame_count  # an even number of 0.9 s at 15 a second
    for n in range(1, 7):
        np.testing.assert_array_equal(shown[n], shown[14 - n])
    assert run.seam.position_max == 0
    turn = np.hypot(*np.moveaxis(2 * (shown[7] - shown[6]), -1, 0)).max() * 15
    assert run.seam.velocity_max == pytest.approx(turn, rel=1e-4)


def test_a_crossfade_has_small_steps_across_its_seam(device):
    """All steps are small, also across the seam; the middle equals the plain run."""
    force = NoiseForce(strength=2.0, scale=0.4, seed=1)
    run = animation("crossfade", [force], device).frames()
    shown = maps(run)
    steps = np.abs(np.diff(np.concatenate([shown, shown[:1]]), axis=0)).max(axis=(1, 2, 3))
    assert len(shown) == 15 and steps.max() < 0.5 * np.abs(shown).max()
    assert run.seam.position_max < 1e-6
    plain = maps(animation(None, [force], device).frames())
    np.testing.assert_allclose(shown[:11], plain[4:15], atol=1e-6)


def test_densities_and_points_loop_with_the_picture(device):
    fluid = Fluid(densities=[Density(sources=[Source((0.5, 0.4), 2.0, 0.1, Constant(0, 0.5))])])
    force = VortexForce((0.5, 0.4), 6.0, 0.1)
    for loop in ("pingpong", "crossfade"):
        made = animation(loop, [force], device, fluid=fluid, points=[(0.55, 0.4)])
        frames = list(made.frames())
        ends = [frames[0], frames[-1]]
        inks = np.array([frame.densities["ink"] for frame in frames])
        step = np.abs(np.diff(inks, axis=0)).max()
        assert np.abs(inks[0] - inks[-1]).max() <= 1.01 * step, loop
        moved = np.abs(np.diff([frame.points[0] for frame in frames], axis=0)).max()
        assert np.abs(ends[0].points - ends[1].points).max() <= 1.01 * moved, loop


def test_density_added_late_is_visible_in_an_oscillating_loop(device):
    """The end of densities is blended into their beginning; nothing is subtracted, so none is negative."""
    source = Source((0.5, 0.4), 5.0, 0.1, Constant(0.4, 0.6))
    fluid = Fluid(densities=[Density(sources=[source])])
    force = GaussianForce((0.5, 0.4), (2.0, 1.0), 0.1, SWING)
    inks = np.array(
        [f.densities["ink"] for f in animation("oscillate", [force], device, fluid=fluid).frames()]
    )
    assert inks.min() >= 0 and inks.max() > 0.9
    assert inks[0].max() == 0 and inks[-1].max() < 0.2 * inks.max()


def test_invalid_loops_are_refused(device):
    force = GaussianForce((0.5, 0.5), (1, 0), 0.1)
    with pytest.raises(ValueError, match="expected one of oscillate, pingpong, crossfade"):
        animation("spin", [force], device)
    with pytest.raises(ValueError, match="no force oscillates"):
        animation("oscillate", [force], device)
    assert frames_of("pingpong", 1) == 2 and frames_of("crossfade", 7) == 7


def test_a_loop_of_few_frames_runs(device):
    """Loops of one or two frames run."""
    swing = GaussianForce((0.5, 0.4), (2.0, 1.0), 0.1, SWING)
    for loop in ("oscillate", "pingpong", "crossfade"):
        for frames in (1, 2, 3):
            made = animation(loop, [swing], device, duration=frames / 15)
            assert len(list(made.frames())) == made.frame_count
