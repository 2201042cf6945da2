"""Envelopes and their products integrate exactly over steps of any length."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wfluid.domain.envelopes import Arbitrary, Constant, Fade, Instantaneous, product
from wfluid.domain.oscillator import Oscillator

ENVELOPES = {
    "constant": Constant(0.2, 1.3),
    "samples": Arbitrary(times=(0.1, 0.4, 1.6), values=(1.0, -2.0, 3.0)),
    "cosine": Oscillator(amplitude=1.5, period=0.7, phase=0.25, centred=False),
    "centred": Oscillator(amplitude=0.7, period=0.9, start=0.3, end=1.7),
    "sine": Oscillator(period=0.31, phase=0.0, centred=False),
    "fade": Fade(rise=0.3, fall=0.5, start=0.2, end=1.8),
    "faded sine": Oscillator(period=0.31, phase=0.0, centred=False) * Fade(0.3, 0.5, 0.2, 1.8),
    "twice the fade in a window": 2 * (Fade(rise=0.3, fall=0.5, start=0.2, end=1.8) * Constant(0.4, 1.1)),
    "samples of a cosine": Oscillator(amplitude=1.5, period=0.7, centred=False)
    * Arbitrary(times=(0.1, 0.4, 1.6), values=(1.0, -2.0, 3.0)),
}


def value(name, t):
    """The same envelopes, written as plain functions of time."""
    if name == "constant":
        return np.where((t >= 0.2) & (t < 1.3), 1.0, 0.0)
    if name == "samples":
        return np.interp(t, (0.1, 0.4, 1.6), (1.0, -2.0, 3.0), left=0, right=0)
    if name == "cosine":
        return 1.5 * np.cos(2 * np.pi * t / 0.7)
    if name == "sine":
        return np.sin(2 * np.pi * t / 0.31)
    if name == "fade":
        ramp = np.clip((t - 0.2) / 0.3, 0, 1), np.clip((1.8 - t) / 0.5, 0, 1)
        return np.prod([3 * r**2 - 2 * r**3 for r in ramp], axis=0)
    if name == "faded sine":
        return value("sine", t) * value("fade", t)
    if name == "samples of a cosine":
        return value("cosine", t) * value("samples", t)
    if name == "twice the fade in a window":
        return np.where((t >= 0.4) & (t < 1.1), 2 * value("fade", t), 0.0)
    s = t - 0.3
    factor = 0.7 * np.cos(2 * np.pi * s / 0.9) * np.where(s < 0.45, 0.5, 1.0)
    return np.where((t >= 0.3) & (t < 1.7), factor, 0.0)


@pytest.mark.parametrize("name", ENVELOPES)
@pytest.mark.parametrize(("start", "end"), [(0.0, 2.0), (0.15, 0.25), (1.25, 1.9), (0.5, 0.5)])
def test_integrals_equal_fine_quadrature(name, start, end):
    t = start + (np.arange(200_000) + 0.5) * (end - start) / 200_000
    expected = value(name, t).mean() * (end - start)
    assert ENVELOPES[name].integral(start, end) == pytest.approx(expected, abs=3e-6)


@given(st.floats(-0.5, 2.5), st.lists(st.floats(0, 2), min_size=1, max_size=6))
def test_impulses_of_steps_add_up(at, cuts):
    """For any steps, an instant acts once and integrals add up."""
    edges = [0.0, *sorted(cuts), 2.0]
    for envelope in (*ENVELOPES.values(), Instantaneous(at)):
        parts = sum(envelope.integral(a, b) for a, b in itertools.pairwise(edges))
        assert parts == pytest.approx(envelope.integral(0.0, 2.0), abs=1e-9)


def test_a_function_is_integrated_to_fourth_order():
    """Simpson's rule: the error of exp(t) over steps of h falls as h^4."""
    errors = []
    for steps in (4, 8, 16):
        total = sum(Arbitrary(math.exp).integral(n / steps, (n + 1) / steps) for n in range(steps))
        errors.append(abs(total - (math.e - 1)))
    assert np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > 3.9), errors


def test_a_value_is_the_derivative_of_the_integral():
    """The derivative of the integral by differences, away from the breaks."""
    for name, envelope in ENVELOPES.items():
        for t in (0.237, 0.551, 0.93, 1.409, 1.93):
            slope = envelope.integral(t - 1e-4, t + 1e-4) / 2e-4
            assert envelope.value(t) == pytest.approx(slope, abs=1e-5), (name, t)


def test_an_instant_takes_the_value_of_the_other_factors_at_its_time():
    blow = Instantaneous(0.45) * Oscillator(amplitude=1.5, period=0.7, centred=False) * 3
    assert blow.integral(0.4, 0.5) == pytest.approx(3 * value("cosine", 0.45))
    assert blow.integral(0.5, 0.6) == 0
    with pytest.raises(ValueError, match="two instants"):
        Instantaneous(1.0) * Instantaneous(1.0)
    with pytest.raises(TypeError, match="expected an envelope or a number"):
        product(Constant(), "loud")
