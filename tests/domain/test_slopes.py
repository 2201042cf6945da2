"""Derivatives of the effect of forces over a step equal differences, for every parameter that may vary."""

import math
import re
from dataclasses import replace
from functools import reduce
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wfluid.domain.envelopes import Arbitrary, Constant, Envelope, Fade, Instantaneous, Product
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Path
from wfluid.model.densities import PaintedSource, Source
from wfluid.model.force import GaussianImpulse
from wfluid.model.gaussian_forces import GaussianForce, Growth, VortexForce
from wfluid.model.image_force import ImageForce
from wfluid.model.noise_force import NoiseForce
from wfluid.model.painted import Painted
from wfluid.model.stroke import Stroke
from wfluid.model.uniform_forces import Buoyancy, Wind

STEP = 3e-4
"""Tolerance of differences: their error, STEP^4 / 30 times a fifth derivative (below 3e7), is below 9e-9; the
rounding of a value below 10, 1.5 eps value / STEP, is below 2e-11."""

TOLERANCE = 1e-8

STEPS = {
    "the entire window": (0.0, 2.0),
    "the beginning": (0.15, 0.45),
    "the half period": (0.55, 0.95),
    "the end": (1.25, 1.9),
    "inside": (1.13, 1.17),
    "nothing": (0.5, 0.5),
    "before": (-1.0, -0.4),
    "after": (2.2, 2.9),
}
"""Steps with different parts of a centred oscillator from 0.3 to 1.7 s with a period of 0.65 … 0.95 s."""


def inner(thing, name):
    """The attribute, or the entry of a tuple, with a name."""
    return thing[int(name)] if name.isdigit() else getattr(thing, name)


def changed(thing, names, index, by):
    """A copy in which the parameter at a path of names, or one of its entries, is changed."""
    if not names:
        values = np.array(thing, dtype=np.float64)
        values[index] += by
        return values.tolist()
    name, new = names[0], changed(inner(thing, names[0]), names[1:], index, by)
    if name.isdigit():
        return (*thing[: int(name)], new, *thing[int(name) + 1 :])
    return replace(thing, **{name: new})


def differences(function, thing, path):
    """The derivative of function(thing) by each parameter at a path, by differences of fourth order."""
    names = re.findall(r"\w+", path)
    out = np.zeros(np.shape(reduce(inner, names, thing)))
    for index in np.ndindex(out.shape):
        near, far = (
            function(changed(thing, names, index, by)) - function(changed(thing, names, index, -by))
            for by in (STEP, 2 * STEP)
        )
        out[index] = (8 * near - far) / (12 * STEP)
    return out


def assert_slopes(got, names, function, thing):
    """All names are present, each with its parameter's shape and derivative."""
    assert set(got) == set(names)
    for name, slope in got.items():
        expected = differences(function, thing, name)
        assert isinstance(slope, np.ndarray) and slope.dtype == np.float64, name
        assert slope.shape == expected.shape, name
        np.testing.assert_allclose(slope, expected, rtol=TOLERANCE, atol=TOLERANCE, err_msg=name)


WAVE = ("amplitude", "period", "phase")


def oscillator(random, **more):
    amplitude, period, phase = random.uniform(0.5, 1.5), random.uniform(0.65, 0.95), random.uniform()
    return Oscillator(amplitude=amplitude, period=period, phase=phase, **more)


def centred(random):
    return oscillator(random, start=0.3, end=1.7)


def samples(random):
    return Arbitrary(times=(0.1, 0.4, 0.83, 1.6), values=random.uniform(-2, 2, 4))


def faded():
    """A break 0.1 s after the start of the oscillator: no piece is a multiple of a quarter period."""
    return Fade(rise=0.2, fall=0.5, start=0.2, end=1.8)


def of(n, names):
    return [f"factors[{n}].{name}" for name in names]


ENVELOPES = {
    "constant": (lambda random: Constant(0.2, 1.3), []),
    "fade": (lambda random: faded(), []),
    "blow": (lambda random: Instantaneous(0.7), []),
    "function": (lambda random: Arbitrary(np.exp), []),
    "samples": (samples, ["values"]),
    "wave": (lambda random: oscillator(random, centred=False), WAVE),
    "centred": (centred, WAVE),
    "short": (lambda random: oscillator(random, start=0.3, end=0.55), WAVE),
    "times a number": (lambda random: random.uniform() * centred(random), ["gain", *of(0, WAVE)]),
    "number": (lambda random: Product((), random.uniform()), ["gain"]),
    "in windows": (
        lambda random: Constant(0.35, 1.4) * centred(random) * Constant(0.2, 1.5) * random.uniform(),
        ["gain", *of(1, WAVE)],
    ),
    "faded": (lambda random: faded() * centred(random) * random.uniform(), ["gain", *of(1, WAVE)]),
    "waves": (
        lambda random: oscillator(random, centred=False) * oscillator(random, centred=False) * Constant(0.37),
        ["gain", *of(0, WAVE), *of(1, WAVE)],
    ),
    "all": (
        lambda random: centred(random) * samples(random) * faded() * random.uniform(0.5, 1.5),
        ["gain", *of(0, WAVE), *of(1, ["values"])],
    ),
    "blow of all": (
        lambda random: samples(random) * Instantaneous(0.7) * centred(random) * random.uniform(0.5, 1.5),
        ["gain", *of(0, ["values"]), *of(2, WAVE)],
    ),
    "nested": (
        lambda random: Product((Product((centred(random), faded()), 1.3), samples(random)), 0.7),
        ["gain", "factors[0].gain", *of(0, of(0, WAVE)), *of(1, ["values"])],
    ),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", ENVELOPES)
def test_slopes_of_an_envelope_are_those_of_its_integral(name, step, seed):
    make, names = ENVELOPES[name]
    envelope = make(np.random.default_rng(seed))
    start, end = STEPS[step]
    assert_slopes(envelope.slopes(start, end), names, lambda changed: changed.integral(start, end), envelope)


@pytest.mark.parametrize("name", ENVELOPES)
def test_value_slopes_of_an_envelope_are_those_of_its_value(name):
    make, names = ENVELOPES[name]
    envelope = make(np.random.default_rng(4))
    for t in (0.05, 0.351, 0.5, 0.92, 1.55, 1.9):
        assert_slopes(envelope.value_slopes(t), names, lambda changed, t=t: changed.value(t), envelope)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0, 2), max_size=4))
@pytest.mark.parametrize("name", ENVELOPES)
def test_slopes_of_steps_add_up(name, cuts):
    """For any steps, also with jumps of the value: each jump counts in one step."""
    envelope = ENVELOPES[name][0](np.random.default_rng(0))
    jumps = [t for t, _, _ in envelope.jumps(0.0, 2.0)]
    edges = sorted([0.0, *cuts, *jumps, 2.0])
    total = envelope.slopes(0.0, 2.0)
    for key, slope in total.items():
        parts = sum(envelope.slopes(a, b)[key] for a, b in pairwise(edges))
        np.testing.assert_allclose(parts, slope, atol=TOLERANCE, err_msg=key)


def test_a_function_is_not_called_outside_the_window_that_multiplies_it():
    arch = Constant(1.0, 2.0) * Arbitrary(lambda t: math.sqrt((t - 1) * (2 - t))) * Oscillator(centred=False)
    assert not any(arch.slopes(2.5, 3.0).values())
    assert all(arch.slopes(0.5, 2.5).values())


def test_an_envelope_of_a_user_has_no_slopes():
    class Ramp(Envelope):
        def value(self, t):
            return t

    assert Ramp().slopes(0.0, 1.0) == {}
    assert set((Ramp() * 2).slopes(0.0, 1.0)) == {"gain"}
    assert (Ramp() * 2).slopes(0.0, 1.0)["gain"] == pytest.approx(0.5)


def numbers(blob):
    return np.array([*blob.center, blob.radius, *blob.push, blob.turn, blob.swell, blob.amount])


def random_blob(random):
    center, push = random.normal(size=(2, 2))
    return GaussianImpulse(tuple(center), random.normal(), tuple(push), *random.normal(size=3))


CENTERS = {
    "a place": (lambda random: random.uniform(size=2), ["center"]),
    "a path": (lambda random: Path((0.2, 0.5, 0.61, 1.4), random.uniform(size=(4, 2))), ["center.places"]),
    "a function": (lambda random: lambda t: (t, 1 - t), []),
}

FORCE_ENVELOPES = {
    "constant": (lambda random: Constant(0.2, 1.3), []),
    "centred": (centred, [f"envelope.{name}" for name in WAVE]),
    "all": (ENVELOPES["all"][0], [f"envelope.{name}" for name in ENVELOPES["all"][1]]),
}

GAUSSIANS = {
    "push": (GaussianForce, "vector"),
    "vortex": (VortexForce, "spin"),
    "growth": (Growth, "rate"),
    "source": (Source, "rate"),
}


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("timing", FORCE_ENVELOPES)
@pytest.mark.parametrize("center", CENTERS)
@pytest.mark.parametrize("kind", GAUSSIANS)
def test_a_gaussian_pulls_back_through_its_impulse(kind, center, timing, step):
    """With random weights of all entries of the impulse, the gradient of their sum."""
    random = np.random.default_rng([len(kind), len(center), len(step)])
    (make, name), (place, center_names), (envelope, names) = (
        GAUSSIANS[kind],
        CENTERS[center],
        FORCE_ENVELOPES[timing],
    )
    number = random.uniform(-2, 2, 2) if name == "vector" else random.uniform(-2, 2)
    force = make(place(random), number, random.uniform(0.1, 0.3), envelope(random))
    bar, (start, end) = random_blob(random), STEPS[step]
    assert_slopes(
        force.pull_back(start, end, bar),
        [name, "radius", *center_names, *names],
        lambda changed: numbers(bar) @ numbers(changed.impulse(start, end)),
        force,
    )


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("timing", FORCE_ENVELOPES)
def test_a_stroke_pulls_back_to_its_strength_radius_and_envelope(timing, step):
    random = np.random.default_rng(len(step))
    path = Path((0.2, 0.5, 0.61, 1.4), random.uniform(size=(4, 2)))
    stroke = Stroke(path, 0.2, random.uniform(0.5, 1.5), FORCE_ENVELOPES[timing][0](random))
    bar, (start, end) = random_blob(random), STEPS[step]
    assert_slopes(
        stroke.pull_back(start, end, bar),
        ["strength", "radius", *FORCE_ENVELOPES[timing][1]],
        lambda changed: numbers(bar) @ numbers(changed.impulse(start, end)),
        stroke,
    )


def buoyant(force, start, end):
    """The contribution of each component of the vector times the density."""
    return np.multiply(force.vector, force.envelope.integral(start, end))


RAMP = np.arange(20.0).reshape(4, 5)
FIELDS = {
    "wind": (lambda random, envelope: Wind(random.normal(size=2), envelope), Wind.integrals, ["vector"]),
    "buoyancy": (
        lambda random, envelope: Buoyancy("ink", random.normal(size=2), envelope),
        buoyant,
        ["vector"],
    ),
    "noise": (lambda random, envelope: NoiseForce(strength=1, envelope=envelope), NoiseForce.integrals, []),
    "picture": (lambda random, envelope: ImageForce(RAMP, envelope=envelope), ImageForce.integrals, []),
}


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("timing", FORCE_ENVELOPES)
@pytest.mark.parametrize("kind", FIELDS)
def test_a_field_pulls_back_through_its_integrals(kind, timing, step):
    random, (make, integrals, names) = np.random.default_rng(len(step)), FIELDS[kind]
    force = make(random, FORCE_ENVELOPES[timing][0](random))
    bar = random.normal(size=np.shape(integrals(force, *STEPS[step])))
    assert_slopes(
        force.pull_back(*STEPS[step], bar),
        [*names, *FORCE_ENVELOPES[timing][1]],
        lambda changed: bar @ integrals(changed, *STEPS[step]),
        force,
    )


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("timing", FORCE_ENVELOPES)
def test_a_painted_source_pulls_back_to_its_envelope(timing, step):
    source = PaintedSource(Painted(RAMP), FORCE_ENVELOPES[timing][0](np.random.default_rng(1)))
    assert_slopes(
        source.pull_back(*STEPS[step], -0.7),
        FORCE_ENVELOPES[timing][1],
        lambda changed: -0.7 * changed.envelope.integral(*STEPS[step]),
        source,
    )


def test_noise_that_changes_pulls_nothing_back():
    noise = NoiseForce(strength=1.0, period=0.5, envelope=Oscillator())
    assert noise.pull_back(0.0, 0.1, noise.integrals(0.0, 0.1)) == {}
