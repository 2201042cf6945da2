"""Timing curves rise from 0 to 1; a mask lets some places start before others."""

import numpy as np
import pytest

from wfluid.domain.curves import Curve, curve_of, delayed_part
from wfluid.domain.limits import DELAY_LIMIT
from wfluid.domain.piecewise import ease, hats, lerp_at

PARTS = np.linspace(0, 1, 41)

KEYED = {0.5: 0.2, 1.5: 0.9}
"""Keys of a morph of 2 s: progress by time [s]."""

CURVES = {
    "linear": lambda s: s,
    "ease": lambda s: 3 * s**2 - 2 * s**3,
    "keyed": lambda s: np.interp(2 * s, [0, 0.5, 1.5, 2], [0, 0.2, 0.9, 1]),
}


def curve(name):
    return curve_of(KEYED if name == "keyed" else name, 2.0)


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_equals_its_formula(name):
    np.testing.assert_allclose(curve(name).at(PARTS), CURVES[name](PARTS), rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_is_monotonic_from_exactly_0_to_exactly_1(name):
    """Before the start and after the end the curve is constant."""
    at = curve(name).at(np.array([-1.0, 0.0, 1.0, 3.0]))
    np.testing.assert_array_equal(at, [0, 0, 1, 1])
    assert np.all(np.diff(curve(name).at(PARTS)) > 0)


def test_ease_has_no_speed_at_the_ends_and_is_symmetric():
    """The slope is 0 at both ends and 3/2 in the middle; at(s) + at(1 - s) = 1."""
    ease, h = curve("ease"), 1e-6
    at = ease.at(np.array([h, 1 - h, 0.5 - h, 0.5 + h]))
    assert at[0] / h < 1e-5 and (1 - at[1]) / h < 1e-5
    assert (at[3] - at[2]) / (2 * h) == pytest.approx(1.5)
    np.testing.assert_allclose(ease.at(PARTS) + ease.at(1 - PARTS), 1, atol=1e-15)


def test_an_eased_curve_with_keys_stops_at_each_of_them():
    eased, h = Curve(((0, 0), (0.25, 0.5), (1, 1)), eased=True), 1e-5
    np.testing.assert_allclose(eased.at(np.array([0.125, 0.25, 0.625])), [0.25, 0.5, 0.75])
    np.testing.assert_allclose(eased.at(np.array([0.25 - h, 0.25 + h])), 0.5, atol=1e-8)


def test_numbers_and_arrays_give_the_same_values():
    parts = PARTS.reshape(1, -1)
    for name in CURVES:
        values = curve(name).at(parts)
        assert values.shape == parts.shape
        assert [float(curve(name).at(part)) for part in PARTS] == values.ravel().tolist()


def test_keys_may_be_close_together_and_include_the_ends():
    """Keys at the start and at the end replace the default ones."""
    assert curve_of({0.0: 0.0, 1.0: 0.3, 2.0: 1.0}, 2.0) == curve_of({1.0: 0.3}, 2.0)
    kept = Curve(((0, 0), (1, 1)))
    assert curve_of(kept, 5.0) is kept


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("easy", "curve 'easy': expected linear, ease or keys"),
        ("", "expected linear, ease or keys"),
        ({2.5: 0.5}, "expected times within the morph"),
        ({-0.1: 0.5}, "expected times within the morph"),
        ({1.0: 1.2}, "values 0 … 1"),
        ({1.0: -0.1}, "values 0 … 1"),
        ({1.0: float("nan")}, "values 0 … 1"),
        ({float("nan"): 0.5}, "expected times within the morph"),
        ({0.0: 0.5}, "expected 0 at the start and 1 at the end"),
        ({2.0: 0.5}, "expected 0 at the start and 1 at the end"),
    ],
)
def test_invalid_curves_are_refused(what, says):
    with pytest.raises(ValueError, match=says):
        curve_of(what, 2.0)


@pytest.mark.parametrize("keys", [(), ((0, 0), (0.5, 0.2), (0.5, 0.4), (1, 1)), ((1, 1), (0, 0)), ((0, 0),)])
def test_invalid_keys_are_refused(keys):
    with pytest.raises(ValueError, match="a curve's keys"):
        Curve(keys)


@pytest.mark.parametrize("delay", [0.0, 0.3, DELAY_LIMIT])
def test_white_is_ahead_of_black_by_the_delay(delay):
    """White at time s equals black at time s + delay; both take 1 - delay of the duration."""
    white, black = (delayed_part(PARTS, np.float64(one), delay) for one in (1, 0))
    np.testing.assert_allclose(white, np.minimum(PARTS / (1 - delay), 1), atol=1e-12)
    np.testing.assert_allclose(delayed_part(PARTS + delay, np.float64(0), delay), white, atol=1e-12)
    assert np.all(white >= black) and black[0] == white[0] == 0 and black[-1] == white[-1] == 1


def test_grey_lies_between_white_and_black():
    ahead = np.array([[0.0, 0.25], [0.5, 1.0]])
    begins, ends = 0.4 * (1 - ahead), 0.4 * (1 - ahead) + 0.6
    for part in PARTS:
        wanted = np.clip((part - begins) / (ends - begins), 0, 1)
        np.testing.assert_allclose(delayed_part(part, ahead, 0.4), wanted, atol=1e-12)


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_without_a_delay_a_mask_has_no_effect(value):
    np.testing.assert_array_equal(delayed_part(PARTS, np.full(PARTS.shape, value), 0.0), PARTS)


def test_linear_interpolation_passes_through_the_samples():
    """Interpolation is constant before the first and after the last sample; hats are its weights."""
    times, values = (0.5, 1.0, 3.0), (2.0, -1.0, 4.0)
    for t in (-1.0, 0.5, 0.7, 1.0, 2.9, 3.0, 9.0):
        assert lerp_at(times, values, t) == pytest.approx(np.interp(t, times, values), abs=1e-15)
        assert hats(times, t) @ values == pytest.approx(np.interp(t, times, values), abs=1e-15)
        assert hats(times, t).sum() == pytest.approx(1.0, abs=1e-15)
    assert lerp_at((1.0,), (5.0,), 0.0) == 5.0


def test_a_ramp_has_no_slope_at_both_ends():
    s = np.array([0.0, 0.5, 1.0])
    np.testing.assert_array_equal(ease(s), [0.0, 0.5, 1.0])
    assert ease(1e-4) < 3.1e-8 and 1 - ease(1 - 1e-4) < 3.1e-8
