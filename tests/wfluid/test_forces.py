"""Envelopes integrate exactly, forces have their shape, pushes carry as far as their arrow."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wfluid.forces import Arbitrary, Constant, GaussianForce, Instantaneous, Oscillator
from wfluid.push import Push

ENVELOPES = {
    "constant": Constant(0.2, 1.3),
    "samples": Arbitrary(times=(0.1, 0.4, 1.6), values=(1.0, -2.0, 3.0)),
    "cosine": Oscillator(amplitude=1.5, period=0.7, phase=0.25, centred=False),
    "centred": Oscillator(amplitude=0.7, period=0.9, start=0.3, end=1.7),
    "sine": Oscillator(period=0.31, phase=0.0, centred=False),
}


def value(name, t):
    """The same courses, written as plain functions of time."""
    if name == "constant":
        return np.where((t >= 0.2) & (t < 1.3), 1.0, 0.0)
    if name == "samples":
        return np.interp(t, (0.1, 0.4, 1.6), (1.0, -2.0, 3.0), left=0, right=0)
    if name == "cosine":
        return 1.5 * np.cos(2 * np.pi * t / 0.7)
    if name == "sine":
        return np.sin(2 * np.pi * t / 0.31)
    s = t - 0.3
    course = 0.7 * np.cos(2 * np.pi * s / 0.9) * np.where(s < 0.45, 0.5, 1.0)
    return np.where((t >= 0.3) & (t < 1.7), course, 0.0)


@pytest.mark.parametrize("name", ENVELOPES)
@pytest.mark.parametrize(("start", "end"), [(0.0, 2.0), (0.15, 0.25), (1.25, 1.9), (0.5, 0.5)])
def test_integrals_equal_fine_quadrature(name, start, end):
    t = start + (np.arange(200_000) + 0.5) * (end - start) / 200_000
    expected = value(name, t).mean() * (end - start)
    assert ENVELOPES[name].integral(start, end) == pytest.approx(expected, abs=3e-6)


@given(st.floats(-0.5, 2.5), st.lists(st.floats(0, 2), min_size=1, max_size=6))
def test_impulses_of_steps_add_up(at, cuts):
    """However the time is cut into steps, a blow strikes once and integrals add."""
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


@pytest.mark.parametrize("walls", ["free-slip", "periodic"])
def test_a_gaussian_force_has_its_shape_on_the_faces(make_solver, walls):
    """One small step from rest, before diffusion and projection: dt * vector * Gaussian."""
    solver = make_solver(40, 30, walls=walls)
    force = GaussianForce((0.9, 0.1), (2.0, -3.0), 0.06)
    controls_dt, state = 0.01, solver.rest()
    solver.step(state, solver.rest(), [force], 0.0, controls_dt)
    from wfluid.state import to_numpy

    u, v = (to_numpy(f, solver.layout) for f in solver._pushed)
    grid, periodic = solver.grid, walls == "periodic"

    def gaussian(x, y):
        dx, dy = x - 0.9, y - 0.1
        if periodic:
            dx, dy = (
                dx - np.round(dx / grid.width) * grid.width,
                dy - np.round(dy / grid.height) * grid.height,
            )
        return np.exp(-(dx**2 + dy**2) / (2 * 0.06**2))

    x_face, x = np.arange(40) * grid.hx, (np.arange(40) + 0.5) * grid.hx
    y_face, y = np.arange(30)[:, None] * grid.hy, (np.arange(30)[:, None] + 0.5) * grid.hy
    closed = slice(0 if periodic else 1, None)
    np.testing.assert_allclose(u[:, closed], (0.02 * gaussian(x_face, y))[:, closed], atol=1e-7)
    np.testing.assert_allclose(v[closed], (-0.03 * gaussian(x, y_face))[closed], atol=1e-7)


def carried(make_solver, force, duration, steps, n=128):
    """Path of the particle that starts at the force's center (velocity read bilinearly, Heun steps)."""
    solver = make_solver(n, n, stretch=1, viscosity=0.0)
    now, after = solver.rest(), solver.rest()
    place, path, dt = np.array(force.center), [], duration / steps

    def velocity(state):
        u, v = state.velocity
        i, j = place[0] * n, place[1] * n
        row, column = int(j), int(i)
        return np.array([u[row, column : column + 2].mean(), v[row : row + 2, column].mean()])

    for step in range(steps):
        solver.step(now, after, [force], step * dt, dt)
        place = place + dt * (velocity(now) + velocity(after)) / 2
        now, after = after, now
        path.append(place.copy())
    return np.array(path)


@pytest.mark.parametrize(
    ("text", "course"),
    [
        ("256,256:6,3:radius=40", "end"),
        ("256,256:6,3:radius=40,at=0", "end"),
        ("256,256:6,3:radius=40,period=0.5", "swing"),
        ("256,256:-6,-3:radius=40,period=0.5,phase=0.75", "swing"),
    ],
)
def test_a_push_carries_its_centre_by_its_arrow(make_solver, text, course):
    """Inviscid, arrow short beside the radius: within 10 % (walls, and the blob moves off its force)."""
    force = Push.parse(text).force(512, 512, 1.0)
    way = (carried(make_solver, force, 1.0, 96) - force.center) * 512
    reached = way[-1] if course == "end" else (way[48:].max(axis=0) - way[48:].min(axis=0)) / 2
    np.testing.assert_allclose(reached, (6, 3), rtol=0.1)


def test_an_oscillators_drift_per_period_is_bounded(make_solver):
    """Centred: after four periods the swing's middle is within half an amplitude of the place.

    The paper's sine walks away by about 2 pi amplitudes a period.
    """
    drift = {}
    for phase in (0.25, 0.0):
        text = f"256,256:5,0:radius=50,period=0.5,phase={phase}"
        way = (carried(make_solver, Push.parse(text).force(512, 512, 2.0), 2.0, 192) - 0.5) * 512
        last = way[-48:, 0]
        drift[phase] = abs(last.max() + last.min()) / 2 / 5
    assert drift[0.25] < 0.5, drift
    assert drift[0.0] > 5, drift


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("3,4", "expected X,Y:DX,DY"),
        ("3:4,5", "the point X,Y needs two numbers"),
        ("3,4:5", "the arrow DX,DY needs two numbers"),
        ("3,x:1,1", "'x' is not a number"),
        ("3,4:1,nan", "not finite"),
        ("3,4:1,1:mass=3", "'mass=3' is not key=value"),
        ("3,4:1,1:radius", "'radius' is not key=value"),
        ("3,4:1,1:radius=0", "radius 0 is not positive"),
        ("3,4:1,1:radius=1,radius=2", "given twice"),
        ("3,4:1,1:phase=0.2", "phase= needs period="),
        ("3,4:1,1:at=0,period=1", "at= is one blow"),
        ("3,4:1,1:start=2,end=1", "end 1 is not after start 2"),
        ("3,4:1,1:at=-1", "before the animation"),
    ],
)
def test_a_malformed_push_is_refused_by_its_part(text, says):
    with pytest.raises(ValueError, match=says):
        Push.parse(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [("900,4:1,1", "outside the picture"), ("3,4:1,1:at=5", "lasts 1 s"), ("3,4:1,1:start=1", "lasts 1 s")],
)
def test_a_push_that_does_not_fit_is_refused(text, says):
    with pytest.raises(ValueError, match=says):
        Push.parse(text).force(100, 100, 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: GaussianForce((0.1, math.nan), (1, 1), 0.1),
        lambda: GaussianForce((0.1, 0.1), (2e4, 1), 0.1),
        lambda: GaussianForce((0.1, 0.1), (1, 1), 0.0),
        lambda: GaussianForce((0.1,), (1, 1), 0.1),
        lambda: Constant(1.0, 0.5),
        lambda: Arbitrary(),
        lambda: Arbitrary(times=(0, 1), values=(1,)),
        lambda: Arbitrary(times=(1, 0), values=(1, 2)),
        lambda: Oscillator(period=0),
        lambda: Instantaneous(math.inf),
    ],
)
def test_impossible_forces_are_refused(wrong):
    with pytest.raises(ValueError):
        wrong()
