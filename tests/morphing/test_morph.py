"""A morph begins with one picture and ends with the other; corresponding points coincide in between."""

import math

import numpy as np
import pytest
from morph_cases import (
    ANGLE,
    HEIGHT,
    POINTS,
    RING,
    SHIFT,
    SIDE,
    centroid,
    dots,
    going,
    of_pictures,
    psnr,
    rotated,
    round_picture,
    searched,
    waves,
)

from wfluid import Painted, Picture, Timeline, morph
from wfluid.domain.limits import MORPH_TOLERANCE as TOLERANCE
from wfluid.keyframes.match import REACHED
from wfluid.morphing.morph import LEAST_JACOBIAN
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.picture import resample

CASES = ("dots", "shift", "turn")

SPLIT = np.repeat((np.arange(120) < 60)[None, :], 80, axis=0).astype(float)
"""White on the left, black on the right."""


@pytest.fixture
def device_name(request):
    return request.config.getoption("--device")


@pytest.fixture
def morph_of(device_name):
    """The morph of a case by its name."""
    return lambda name: searched(name, device_name)


def noise(width, height, channels=3, seed=0, **settings):
    pixels = np.random.default_rng(seed).random((height, width, channels))
    return Picture(pixels.astype(np.float32), **settings)


def flatten(width, height, value):
    return Picture(np.full((height, width, 3), value, np.float32))


def quick(a, b, points=(((0.4, 0.3), (0.45, 0.3)),), **settings):
    """A morph whose search is stopped at once: only its residuals are large."""
    settings = {"cells": 24, "progress": lambda progress: True, **settings}
    return morph(a, b, points, 0.5, 8, **settings)


@pytest.mark.parametrize("name", CASES)
def test_the_first_and_last_frames_are_the_pictures_bit_for_bit(morph_of, name):
    found = morph_of(name)
    frames = list(found.frames())
    assert len(frames) == found.frame_count == found.settings.timeline.frames
    np.testing.assert_array_equal(frames[0].picture.pixels, found.pair.a.pixels)
    np.testing.assert_array_equal(frames[-1].picture.pixels, found.pair.b.pixels)
    assert not frames[0].map.displacement.any() and not frames[-1].to_map.displacement.any()
    assert [frame.index for frame in frames] == list(range(len(frames)))
    assert [frame.time for frame in frames] == [n / found.settings.timeline.fps for n in range(len(frames))]


@pytest.mark.parametrize("name", CASES)
def test_points_arrive_in_both_pictures_and_nothing_folds(morph_of, name):
    """Residuals within the tolerance; det J of both maps is positive in every frame."""
    found = morph_of(name)
    assert found.match.status == REACHED and found.match.residual <= TOLERANCE
    residuals = found.residuals_of_b()
    assert residuals.shape == (len(found.match.arrivals),)
    assert residuals.max() <= TOLERANCE * max(found.pair.size), residuals
    mean, most = found.inconsistency_px()
    assert 0 < mean < most < 0.5
    for frame in found.frames():
        for quality in (frame.quality, frame.to_quality):
            assert 0.5 < quality.jacobian_min <= 1 <= quality.jacobian_max < 2


def middle(found):
    """The frame in which points are half way, with linear curves."""
    frames = list(found.frames())
    return frames[len(frames) // 2].picture.pixels


def test_between_a_picture_and_its_copy_shifted_is_the_picture_half_shifted(morph_of):
    """A stiff fluid on periodic walls moves as one: both warped pictures are the half-shifted one.

    Cubic look-up of waves of 16 px and more errs by 6e-4 of them, about 1e-4 in all. Points within
    0.02 px of a slope of 0.05 / px err by 1e-3, which is 60 dB.
    """
    found = morph_of("shift")
    got, wanted = middle(found), waves((SHIFT[0] / 2, SHIFT[1] / 2)).pixels
    dissolve = (waves().pixels + waves(SHIFT).pixels) / 2
    assert psnr(got, wanted) > 55, psnr(got, wanted)
    assert psnr(dissolve, wanted) < 20


def test_between_a_picture_and_its_copy_turned_is_the_picture_half_turned(morph_of):
    """Stripes of 13 px, moved by up to half of that: a cross-dissolve shows two, a morph the one."""
    found = morph_of("turn")
    got, wanted = middle(found), round_picture(ANGLE / 2).pixels
    dissolve = (round_picture().pixels + round_picture(ANGLE).pixels) / 2
    assert psnr(got, wanted) > psnr(dissolve, wanted) + 8, (psnr(got, wanted), psnr(dissolve, wanted))
    np.testing.assert_allclose(found.match.tracks[-1], [rotated(point, ANGLE) for point in RING], atol=2e-3)


def test_stripes_keep_their_contrast_between_the_pictures(morph_of):
    """Where two copies lie beside one another contrast fades; a morph keeps it, whatever the time."""
    found = morph_of("turn")
    contrast = [frame.picture.pixels[32:96, 32:96].std() for frame in found.frames()]
    assert min(contrast) > 0.95 * contrast[0], contrast
    dissolve = (round_picture().pixels + round_picture(ANGLE).pixels) / 2
    assert dissolve[32:96, 32:96].std() < 0.85 * contrast[0]


def test_corresponding_points_coincide_in_both_warped_pictures(morph_of):
    """Dots at the points of A and at those of B: their centroids meet where the followed points are.

    Weights of 0 and of 1 show each warped picture alone. A residual is up to 0.5 / 512, 0.23 px, in each.
    """
    found = morph_of("dots")
    end, count = found.settings.timeline.end, found.settings.timeline.frames
    alone = []
    for weight in (0.0, 1.0):
        keys = {(n + 1) / (count - 1) * end: weight for n in range(count - 2)}
        alone.append(list(going(found, blend_curve=keys).frames()))
    for index in range(1, count - 1):
        for place in alone[0][index].points:
            one, other = (centroid(frames[index].picture, place) for frames in alone)
            assert np.linalg.norm(one - SIDE * place) < 0.3, (index, one, SIDE * place)
            assert np.linalg.norm(other - one) < 2 * SIDE * TOLERANCE, (index, one, other)
    moved = np.linalg.norm([np.subtract(to, start) for start, to in POINTS], axis=1)
    assert SIDE * moved.min() > 10


def test_maps_of_a_frame_lead_from_it_to_both_pictures(morph_of):
    """From where a followed point is, `map` leads to its point of A and `to_map` to that of B."""
    found = morph_of("dots")
    starts, ends = np.swapaxes(POINTS, 0, 1)
    for frame in found.frames():
        here = frame.points
        np.testing.assert_allclose(frame.map.source_at(here), starts, atol=TOLERANCE)
        np.testing.assert_allclose(frame.to_map.source_at(here), ends, atol=2 * TOLERANCE)


def test_with_a_linear_curve_points_move_at_constant_speed(morph_of):
    """All points move by equal distances from frame to frame."""
    found = morph_of("dots")
    steps = [
        np.linalg.norm(np.diff([frame.points for frame in one.frames()], axis=0), axis=2).sum(axis=1)
        for one in (found, going(found, warp_curve="ease"))
    ]
    assert np.ptp(steps[0]) < 0.02 * steps[0].mean(), steps[0]
    assert steps[1][0] < 0.5 * steps[0][0] and steps[1].max() > 1.3 * steps[0].max()
    first, *_, last = found.frames()
    np.testing.assert_allclose(first.points, [start for start, _ in POINTS], atol=1e-7)
    np.testing.assert_allclose(last.points, [to for _, to in POINTS], atol=TOLERANCE)


def test_a_morph_of_a_picture_into_itself_is_still(device_name):
    """A point that corresponds to itself: every frame is the picture, but for the look-up's rounding."""
    picture, points = waves(), [((0.3, 0.2), (0.3, 0.2))]
    found = morph(picture, picture, points, 0.5, 6, cells=16, device=device_name)
    assert found.match.evaluations == 0  # nothing is searched for
    for frame in found.frames():
        assert max(frame.quality.displacement_max, frame.to_quality.displacement_max) < 1e-6
        np.testing.assert_allclose(frame.picture.pixels, picture.pixels, rtol=0, atol=1e-5)


def test_the_blend_follows_its_curve_and_its_light(morph_of):
    """Black becomes white: every frame's grey is the curve's value, of light or of sRGB codes."""
    flats = of_pictures(morph_of("dots"), flatten(SIDE, HEIGHT, 0.0), flatten(SIDE, HEIGHT, 1.0))
    parts = np.linspace(0, 1, flats.frame_count)
    for light in ("linear", "display"):
        for curve, values in (("linear", parts), ("ease", 3 * parts**2 - 2 * parts**3)):
            frames = list(going(flats, blend_curve=curve, blend=light).frames())
            grey = np.array([frame.picture.pixels[40, 60, 0] for frame in frames])
            if light == "display":
                grey = np.where(grey > 0.0031308, 1.055 * grey ** (1 / 2.4) - 0.055, 12.92 * grey)
            np.testing.assert_allclose(grey, values, rtol=0, atol=2e-6)


def test_the_warp_follows_its_curve(morph_of):
    """The covered fraction of the nearly straight ways is the curve's value, for any blend curve."""
    found = going(morph_of("dots"), warp_curve={0.25: 0.8}, blend_curve="ease")
    starts, ends = np.swapaxes(POINTS, 0, 1)
    values = np.interp(np.linspace(0, 1, 7), [0, 0.5, 1], [0, 0.8, 1])
    for frame, value in zip(found.frames(), values, strict=True):
        way = np.linalg.norm(frame.points - starts, axis=1).sum()
        assert way == pytest.approx(value * np.linalg.norm(ends - starts, axis=1).sum(), abs=2e-3)


# A mask


def test_white_of_a_mask_shows_the_second_picture_while_black_shows_the_first(morph_of):
    """With a delay of half the time, white is complete half way and black has not started."""
    flats = of_pictures(morph_of("dots"), flatten(SIDE, HEIGHT, 0.25), flatten(SIDE, HEIGHT, 0.75))
    found = going(flats, mask=Painted(SPLIT), delay=0.5)
    frames = list(found.frames())
    half = frames[3]
    np.testing.assert_allclose(half.picture.pixels[:, : SIDE // 2 - 2], 0.75, atol=1e-6)
    np.testing.assert_allclose(half.picture.pixels[:, SIDE // 2 + 2 :], 0.25, atol=1e-6)
    assert (
        np.abs(half.to_map.displacement[:, :8]).max() < 1e-3 < np.abs(half.to_map.displacement[:, -8:]).max()
    )
    assert np.abs(half.map.displacement[:, -8:]).max() < 1e-3 < np.abs(half.map.displacement[:, :8]).max()
    np.testing.assert_array_equal(frames[0].picture.pixels, np.float32(0.25))
    np.testing.assert_array_equal(frames[-1].picture.pixels, np.float32(0.75))


@pytest.mark.parametrize("delay", [0.0, 0.3, 0.9])
def test_with_a_mask_the_ends_are_the_pictures_bit_for_bit(morph_of, delay):
    found = going(morph_of("dots"), mask=Painted(SPLIT), delay=delay)
    first, *_, last = found.frames()
    np.testing.assert_array_equal(first.picture.pixels, found.pair.a.pixels)
    np.testing.assert_array_equal(last.picture.pixels, found.pair.b.pixels)


def test_a_sharp_mask_is_softened_for_the_warp_with_a_note(morph_of):
    """A jump in timing across which the flow moves by 2.9 cells folds; the blend keeps the sharp mask."""
    upper = np.repeat((np.arange(80) < 40)[:, None], 120, axis=1).astype(float)
    found = going(morph_of("dots"), mask=Painted(upper), delay=0.5)
    frames = list(found.frames())
    (note,) = found.notes
    assert note.startswith("the timing mask is softened by ") and "px for the warp" in note
    least = min(min(f.quality.jacobian_min, f.to_quality.jacobian_min) for f in frames)
    assert least >= LEAST_JACOBIAN, least
    above, below = (np.abs(one.displacement) for one in (frames[3].to_map, frames[3].map))
    assert above[:4].max() < 0.2 * above[-4:].max() and below[-4:].max() < 0.2 * below[:4].max()
    sharp = found.passage.since_start(np.repeat((np.arange(32) < 16)[:, None], 48, axis=1).astype(float))
    slopes = np.diff(sharp.source_of[..., 1], axis=0) * 48
    assert slopes.min() < 0, "the sharp one does not fold: the test would say nothing"
    flats = of_pictures(found, flatten(SIDE, HEIGHT, 0.0), flatten(SIDE, HEIGHT, 1.0))
    *_, half, _, _, _ = flats.frames()
    assert half.picture.pixels[78].min() > 1 - 1e-6 and half.picture.pixels[81].max() < 1e-6


def test_a_soft_mask_or_one_without_delay_is_not_changed(morph_of):
    soft = Painted(np.linspace(1, 0, 120)[None, :] * np.ones((80, 1)))
    for settings in ({"mask": soft, "delay": 0.3}, {"mask": Painted(SPLIT), "delay": 0.0}):
        found = going(morph_of("dots"), **settings)
        list(found.frames())
        assert found.notes == ()


def test_without_a_delay_a_mask_changes_nothing(morph_of):
    masked = going(morph_of("dots"), mask=Painted(SPLIT), delay=0.0)
    for one, other in zip(masked.frames(), morph_of("dots").frames(), strict=True):
        np.testing.assert_array_equal(one.picture.pixels, other.picture.pixels)


# The order of frames


def pixels_of(found):
    return [frame.picture.pixels for frame in found.frames()]


@pytest.mark.parametrize("mask", [None, Painted(SPLIT)])
def test_reverse_is_the_frames_in_reverse_bit_for_bit(morph_of, mask):
    there = going(morph_of("dots"), mask=mask)
    back = going(there, reverse=True)
    for one, other in zip(pixels_of(there)[::-1], pixels_of(back), strict=True):
        np.testing.assert_array_equal(one, other)
    assert [frame.index for frame in back.frames()] == list(range(7))
    assert [frame.time for frame in back.frames()] == [n / 12 for n in range(7)]


@pytest.mark.parametrize("reverse", [False, True])
def test_pingpong_goes_back_without_showing_an_end_twice(morph_of, reverse):
    """0 1 2 … n - 1 … 2 1: repeated, no frame is shown twice in a row."""
    plain = going(morph_of("dots"), reverse=reverse)
    fit_to_loop = going(plain, pingpong=True)
    frames, once = pixels_of(fit_to_loop), pixels_of(plain)
    assert len(frames) == fit_to_loop.frame_count == 12
    for n, pixels in enumerate(frames):
        np.testing.assert_array_equal(pixels, once[n if n < 7 else 12 - n])


@pytest.mark.parametrize(
    ("reverse", "pingpong", "order"),
    [
        (False, False, [0, 1, 2, 3]),
        (True, False, [3, 2, 1, 0]),
        (False, True, [0, 1, 2, 3, 2, 1]),
        (True, True, [3, 2, 1, 0, 1, 2]),
    ],
)
def test_frames_are_in_order(reverse, pingpong, order):
    assert MorphSettings(Timeline(1, 3), reverse=reverse, pingpong=pingpong).order == order


def test_two_frames_are_both_pictures():
    """The shortest morph; with pingpong it has the same two frames."""
    assert (
        MorphSettings(Timeline(0.1, 10)).order
        == MorphSettings(Timeline(0.1, 10), pingpong=True).order
        == [0, 1]
    )


# Pictures of other kinds and sizes


@pytest.mark.parametrize("fit", ["fill", "fit", "stretch"])
def test_pictures_of_another_size_and_aspect_end_fitted(device_name, fit):
    """The last frame is the visible part of B, resampled by OpenImageIO; its points are those of B."""
    a, (x, y) = dots([(0.4, 0.4)], width=96, height=64), (0.5, 0.4)
    b = dots([(x, y)], spread=3.0, width=100, height=80)
    found = quick(a, b, [((0.4, 0.4), (x, y))], fit=fit, device=device_name)
    *_, last = found.frames()
    assert last.picture.pixels.shape == a.pixels.shape
    seen = {"fill": b.pixels[6:73], "fit": np.pad(b.pixels, ((0, 0), (10, 10), (0, 0))), "stretch": b.pixels}
    wanted = resample(seen[fit], 96, 64, filter="cubic")
    assert psnr(last.picture.pixels, wanted) > 40, psnr(last.picture.pixels, wanted)
    place = found.match.arrivals[0].keyframe.destination
    assert np.linalg.norm(centroid(last.picture, place) - np.multiply(place, 96)) < 0.1
    left = {"fill": (96 * 0.5, 64 * 34 / 67), "fit": (96 * 0.5, 32.0), "stretch": (96 * 0.5, 32.0)}[fit]
    np.testing.assert_allclose(np.multiply(place, 96), left, rtol=0.01)


def test_small_frames_begin_and_end_with_the_reduced_pictures(device_name):
    a, b = dots([(0.4, 0.3)], 6.0), dots([(0.45, 0.3)], 6.0)
    first, *_, last = quick(a, b, width=120, height=80, device=device_name).frames()
    for frame, picture in ((first, a), (last, b)):
        assert psnr(frame.picture.pixels, resample(picture.pixels, 120, 80, filter="cubic")) > 40


def test_grey_becomes_coloured(device_name):
    grey, colours = noise(48, 32, 1), noise(48, 32)
    found = quick(grey, colours, device=device_name)
    first, *_, last = found.frames()
    np.testing.assert_array_equal(first.picture.pixels, np.repeat(grey.pixels, 3, axis=2))
    np.testing.assert_array_equal(last.picture.pixels, colours.pixels)
    assert found.pair.notes == ("the first picture is grey, the other has colours: it is shown as colours",)


@pytest.mark.parametrize("light", ["linear", "display"])
def test_an_opaque_picture_becomes_a_transparent_one(device_name, light):
    """Alpha falls from 1 to 0 by the curve; transparent pixels have no colour."""
    solid, clear = noise(48, 32), Picture(np.zeros((32, 48, 4), np.float32), alpha=3)
    frames = list(quick(solid, clear, blend=light, blend_curve="linear", device=device_name).frames())
    for frame, part in zip(frames, np.linspace(0, 1, len(frames)), strict=True):
        assert frame.picture.alpha == 3
        np.testing.assert_allclose(frame.picture.pixels[..., 3], 1 - part, atol=1e-5)
        np.testing.assert_array_less(frame.picture.pixels[..., :3].max(), 1.2 * (1 - part) + 1e-5)
    np.testing.assert_array_equal(frames[0].picture.pixels[..., :3], solid.pixels)


def test_a_transparent_edge_gives_both_pictures_their_alpha(device_name):
    a, b = noise(48, 32), noise(48, 32, seed=1)
    for frame in quick(a, b, edge="transparent", device=device_name).frames():
        assert frame.picture.alpha == 3 and frame.picture.pixels.shape == (32, 48, 4)


# Refusals


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([], "points: expected x, y"),
        ([(0.1, 0.2, 0.3)], "for at least one"),
        ([((0.1, 0.2), (0.3, 0.4)), ((0.1, 0.2), (0.3,))], "points: expected x, y"),
        ([("a", "b", "c", "d")], "points: expected x, y"),
        ([((0.5, 0.9), (0.5, 0.3))], "outside the picture"),
        ([((0.5, 0.3), (0.5, 0.9))], "of the second picture lies outside it"),
        ([((0.5, 0.3), (float("nan"), 0.3))], "of the second picture lies outside it"),
        ([((0.5, 0.3), (0.5, 0.01))], "of the second picture is cut off"),
        ([((0.5, 0.3), (0.5, 0.3)), ((0.5, 0.3), (0.6, 0.3))], "two destinations"),
    ],
)
def test_invalid_points_are_refused(points, says):
    with pytest.raises(ValueError, match=says):
        quick(noise(60, 40), noise(60, 50), points)


def test_points_may_be_rows_of_four_numbers(device_name):
    found = quick(noise(48, 32), noise(48, 32), np.array([[0.4, 0.3, 0.45, 0.3]]), device=device_name)
    keyframe = found.match.arrivals[0].keyframe
    np.testing.assert_allclose((keyframe.point, keyframe.destination), ((0.4, 0.3), (0.45, 0.3)))


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"warp_curve": "fast"}, "curve 'fast'"),
        ({"blend_curve": {0.2: 3}}, "values 0 … 1"),
        ({"blend": "gamma"}, "'gamma' light"),
        ({"delay": 0.95}, "delay 0.95"),
        ({"delay": math.nan}, "delay nan"),
        ({"delay": -0.1}, "delay -0.1"),
        ({"mask": Painted(np.full((2, 2), 1.5))}, "a timing mask: expected values 0 … 1"),
    ],
)
def test_invalid_settings_are_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        MorphSettings(Timeline(0.5, 8), **settings)


def test_a_fit_that_does_not_exist_is_refused_before_the_search():
    with pytest.raises(ValueError, match="fit 'cover'"):
        quick(noise(6, 4), noise(6, 4), fit="cover", progress=None)


def test_the_same_seed_gives_the_same_frames(device_name):
    """Bit for bit, on a CPU."""
    a, b = dots([(0.4, 0.3)], width=48, height=32), dots([(0.45, 0.3)], width=48, height=32)
    one, other = (quick(a, b, device=device_name, seed=3) for _ in range(2))
    for frame, again in zip(one.frames(), other.frames(), strict=True):
        np.testing.assert_array_equal(frame.picture.pixels, again.picture.pixels)


def test_a_mask_may_be_an_array(morph_of):
    """The frames equal those with the array as `Painted`."""
    found = going(morph_of("dots"), mask=np.array(SPLIT))
    painted = going(morph_of("dots"), mask=Painted(SPLIT))
    for one, other in zip(found.frames(), painted.frames(), strict=True):
        np.testing.assert_array_equal(one.picture.pixels, other.picture.pixels)
