"""Frames and steps of an animation: times, numbers, data."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wfluid.animation.animation import Animation, animate
from wfluid.animation.simulation import PoorSolveWarning
from wfluid.domain.envelopes import Arbitrary, Constant, Instantaneous
from wfluid.domain.timeline import Timeline
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.pictures.picture import Picture

PUSH = GaussianForce((0.5, 0.35), (3.0, 1.0), 0.1, Constant(0.0, 0.2))


def checkerboard(width=64, height=48):
    pattern = (np.arange(width) // 8 + np.arange(height)[:, None] // 8) % 2
    return Picture(np.repeat(pattern[..., None], 3, axis=2).astype(np.float32))


@given(st.floats(0.05, 30), st.sampled_from([12.0, 15.0, 23.976, 24.0, 25.0, 29.97, 60.0]))
def test_frames_lie_at_multiples_of_the_step(duration, fps):
    timeline = Timeline(duration, fps)
    assert timeline.fps == pytest.approx(fps, rel=2e-4)  # 29.97 is 30000/1001, 23.98 is 24000/1001
    assert timeline.frames == round(duration * timeline.fps) + 1
    assert timeline.dt <= 1 / 96 + 1e-12
    assert timeline.steps_per_frame * timeline.dt == pytest.approx(1 / timeline.fps)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((0.0, 24.0), "duration"),
        ((float("nan"), 24.0), "duration"),
        ((1.0, -3.0), "fps"),
        ((1.0, 24.0, 0), "substeps"),
        ((1e6, 24.0), "frames"),
        ((0.001, 24.0), "frames"),
    ],
)
def test_impossible_timelines_are_refused(arguments, says):
    with pytest.raises(ValueError, match=says):
        Timeline(*arguments)


def test_the_first_frame_is_the_untouched_picture(device):
    image = checkerboard()
    first = next(animate(image, Fluid(), [PUSH], 0.5, 10, cells=32, device=device.alias))
    np.testing.assert_array_equal(first.picture.pixels, image.pixels)
    assert first.time == 0 and first.solve is None
    assert np.all(first.map.displacement == 0)


def test_frames_are_computed_lazily_and_own_their_data(device):
    """Requesting two frames computes two; a frame does not change when the next one is computed."""
    frames = animate(checkerboard(), Fluid(), [PUSH], 1e3, 10, cells=32, device=device.alias)
    next(frames)
    second = next(frames)
    pixels, displacement = second.picture.pixels.copy(), second.map.displacement.copy()
    next(frames)
    np.testing.assert_array_equal(second.picture.pixels, pixels)
    np.testing.assert_array_equal(second.map.displacement, displacement)


def test_the_flow_preserves_area_and_keeps_sources_inside(device):
    """For a gentle push det J is within 1 +- 2 %, no source is outside, the divergence is near rounding."""
    *_, last = animate(checkerboard(), Fluid(), [PUSH], 0.5, 10, cells=64, device=device.alias)
    assert last.quality.displacement_max > 0.02
    assert 0.98 < last.quality.jacobian_min <= last.quality.jacobian_max < 1.02
    assert last.quality.outside_fraction == 0
    assert last.solve.divergence < 1e-2
    assert last.solve.pressure.relative < 1e-3
    assert last.solve.diffusion.relative < 2e-2


def test_the_same_animation_twice_gives_the_same_bits(device):
    if device.is_cuda:
        pytest.skip("atomic additions on CUDA have no fixed order")
    runs = [list(animate(checkerboard(), Fluid(), [PUSH], 0.3, 10, cells=32, device="cpu")) for _ in range(2)]
    for a, b in zip(*runs, strict=True):
        np.testing.assert_array_equal(a.picture.pixels, b.picture.pixels)


def test_a_dot_moves_with_the_arrow(device):
    """The centroid of a white dot on black moves right and down with the arrow; its mass is kept."""
    x, y = np.arange(80), np.arange(80)[:, None]
    dot = np.exp(-((x - 40) ** 2 + (y - 40) ** 2) / (2 * 3.0**2)).astype(np.float32)
    blow = GaussianForce((0.506, 0.506), (0.4, 0.2), 0.2, Instantaneous(0.0))
    *_, last = animate(Picture(dot[..., None]), Fluid(), [blow], 0.5, 10, cells=80, device=device.alias)
    seen = last.picture.pixels[..., 0].astype(float)
    moved = np.array([(seen * x).sum(), (seen * y).sum()]) / seen.sum() - 40
    assert moved[0] > 3 and moved[1] > 1.5, moved
    assert moved[1] / moved[0] == pytest.approx(0.5, abs=0.05)
    assert seen.sum() == pytest.approx(dot.sum(), rel=0.02)


@pytest.mark.parametrize("fps", [10, 12, 15, 23.976, 24, 25, 29.97, 30, 50, 60])
@pytest.mark.parametrize("substeps", [None, 1, 3, 7])
def test_an_instant_acts_exactly_once_at_any_time(fps, substeps):
    """The end of a step is bit-equal to the start of the next, so that no instant is lost or doubled."""
    timeline = Timeline(2.0, fps, substeps)
    steps = (timeline.frames - 1) * timeline.steps_per_frame
    edges = [timeline.time_of(step) for step in range(steps + 1)]
    for at in (*np.arange(0.0, 1.9, 0.05), *edges[:-1]):
        blow = Instantaneous(float(at))
        assert sum(blow.integral(a, b) for a, b in pairwise(edges)) == 1, at


def test_an_instant_between_frames_moves_the_picture(device):
    """At 0.6 s and 15 fps, where rounding once lost the instant."""
    blow = GaussianForce((0.5, 0.35), (0.2, 0.0), 0.1, Instantaneous(0.6))
    *_, last = animate(checkerboard(), Fluid(), [blow], 1.0, 15, cells=32, device=device.alias)
    assert last.quality.displacement_max > 0.01


def test_frames_never_share_memory(device):
    """Also for rows of pixels that fill the device's buffer without padding."""
    image = Picture(np.random.default_rng(0).random((1, 40, 4)).astype(np.float32), 3)
    frames = list(animate(image, Fluid(walls="periodic"), [PUSH], 0.3, 10, cells=32, device=device.alias))
    for frame in frames[1:]:
        assert not np.shares_memory(frame.picture.pixels, frames[0].picture.pixels)
    np.testing.assert_array_equal(frames[0].picture.pixels, image.pixels)


def test_animations_in_two_threads_do_not_interfere(device):
    def run(_):
        *_, last = animate(checkerboard(), Fluid(), [PUSH], 0.3, 10, cells=32, device=device.alias)
        return last.picture.pixels

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(run, range(6)))
    for pixels in results[1:]:
        np.testing.assert_allclose(pixels, results[0], atol=1e-5)


def test_a_force_that_is_not_finite_is_refused_with_its_place(device):
    force = GaussianForce((0.5, 0.35), (1.0, 0.0), 0.1, Arbitrary(lambda _: float("nan")))
    with pytest.raises(ValueError, match=r"force at \(0.5, 0.35\) would add"):
        list(animate(checkerboard(), Fluid(), [force], 0.2, 10, cells=16, device=device.alias))


def test_a_poor_solve_warns_with_its_residual_and_the_remedy(device):
    fluid = Fluid(solver="jacobi", sweeps=2)
    with pytest.warns(PoorSolveWarning, match=r"left .*e-0.*multigrid"):
        list(animate(checkerboard(), fluid, [PUSH], 0.2, 10, cells=48, device=device.alias))


def test_smaller_frames_are_filtered_not_aliased(device):
    """A one-pixel checkerboard at half size is grey, also under the identity map."""
    image = Picture(((np.arange(64) + np.arange(64)[:, None]) % 2)[..., None].astype(np.float32))
    frame = next(animate(image, Fluid(), [], 0.2, 10, cells=16, width=32, height=32, device=device.alias))
    inner = frame.picture.pixels[4:-4, 4:-4]
    assert inner.shape == (24, 24, 1)
    np.testing.assert_allclose(inner, 0.5, atol=0.02)


@pytest.mark.parametrize(
    "settings", [{"cells": 2}, {"cells": 9000}, {"width": 0}, {"filter": "x"}, {"edge": "x"}]
)
def test_impossible_settings_are_refused(device, settings):
    with pytest.raises(ValueError, match=next(iter(settings))):
        list(animate(checkerboard(), Fluid(), [], 0.2, 10, **settings))


def test_a_run_measures_its_own_frames_only(device):
    """Neither another run of the animation nor one of a copy of it adds to the times of a run."""
    animation = Animation(checkerboard(), Fluid(), (PUSH,), Timeline(0.2, 10), cells=32, device=device.alias)
    run = animation.frames()
    assert len(list(run)) == run.frame_count == 3
    times = replace(run.seconds)
    assert times.simulate > 0 and times.lookup > 0
    list(animation.frames())
    list(replace(animation, width=4).frames())
    assert run.seconds == times
    assert run.seam is None


def test_a_copy_of_an_animation_shares_no_results():
    """`dataclasses.replace` copies every field, so that no field may hold data that a run changes."""
    animation = Animation(checkerboard(), Fluid(), (PUSH,), Timeline(0.2, 10), loop="pingpong")
    values = {one.name: getattr(animation, one.name) for one in fields(animation) if one.init}
    written = [
        name
        for name, value in values.items()
        if is_dataclass(value) and not type(value).__dataclass_params__.frozen
    ]
    assert written == []
