"""L-BFGS finds the minima that SciPy finds, as fast, and ends with the right status."""

import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from more_garbow_hillstrom import PROBLEMS
from scipy.optimize import least_squares

from wfluid.optimize.lbfgs import Iterate, Minimum, descent_direction, minimise
from wfluid.optimize.line_search import Ending, Rules, Sample, search
from wfluid.optimize.settings import Settings, Status

LIMITS = {"iterations": 10_000, "evaluations": 10_000}
"""Limits that no test reaches."""

BY_NAME = {problem.name: problem for problem in PROBLEMS}

every_problem = pytest.mark.parametrize("problem", PROBLEMS, ids=BY_NAME)

SUPPORT = Path(__file__).parents[1] / "support"

SCIPY = """
import json
from more_garbow_hillstrom import PROBLEMS
from scipy.optimize import minimize
options = {"maxcor": 10, "gtol": 1e-6, "ftol": 0, "maxiter": 10_000, "maxfun": 10_000}
found = {}
for problem in PROBLEMS:
    one = minimize(problem.value_and_gradient, problem.start, method="L-BFGS-B", jac=True, options=options)
    found[problem.name] = one.fun, one.nfev, "PROJECTED GRADIENT" in one.message
print(json.dumps(found))
"""


class Recorded:
    """A function that records its arguments and results."""

    def __init__(self, function):
        self.function, self.points = function, []

    def __call__(self, x):
        value, gradient = self.function(x)
        self.points.append((x.copy(), value, np.array(gradient)))
        return value, gradient

    @property
    def lowest(self):
        return min(value for _, value, _ in self.points if np.isfinite(value))


def rosenbrock(x):
    return BY_NAME["Rosenbrock"].value_and_gradient(x)


def quadratic(x):
    return float(x @ x), 2 * x


def same(a, b):
    """Whether two states or minima are the same to the last bit."""
    a, b = (s.state if isinstance(s, Minimum) else s for s in (a, b))
    arrays = zip((a.x, a.gradient, a.best.x, *a.steps, *a.differences),
                 (b.x, b.gradient, b.best.x, *b.steps, *b.differences), strict=True)  # fmt: skip
    return (a.values, a.slopes, a.evaluations) == (b.values, b.slopes, b.evaluations) and all(
        np.array_equal(one, other) for one, other in arrays
    )


# The problems


@every_problem
def test_problems_have_the_jacobians_of_their_residuals(problem):
    """dr/dx_j = Im r(x + i h e_j) / h, exact to rounding for tiny h."""
    random = np.random.default_rng(1)
    x = problem.start + 0.05 * random.uniform(-1, 1, problem.start.size) * (0.2 + np.abs(problem.start))
    step = 1e-30
    oracle = np.stack([problem.residuals(x + 1j * step * e).imag / step for e in np.eye(x.size)], axis=1)
    error = np.abs(problem.jacobian(x) - oracle).max(axis=0) / np.maximum(np.abs(oracle).max(axis=0), 1e-12)
    assert error.max() < 1e-12, f"{problem.name}: {error}"


@every_problem
def test_problems_have_the_published_minima(problem):
    """Levenberg and Marquardt's method from the standard start ends at a value of the paper.

    For two problems it does not; these are evaluated at the zeros that the paper gives.
    """
    known = {"Biggs EXP6": np.array([1.0, 10.0, 1.0, 5.0, 4.0, 3.0]), "Trigonometric 10": np.zeros(10)}
    start = known.get(problem.name, problem.start)
    tight = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
    found = least_squares(
        problem.residuals, start, problem.jacobian, method="lm", x_scale="jac", max_nfev=20_000, **tight
    )
    value = 2 * found.cost
    assert any(value == pytest.approx(least, rel=5e-6, abs=1e-18) for least in problem.minima), value


# The method against another


@pytest.fixture(scope="module")
def scipys():
    """Value, evaluations and whether it converged, by problem, of SciPy's L-BFGS-B.

    Computed in a separate process with one thread, because the threads of its linear algebra wait seconds
    for each other on a busy core.
    """
    environment = os.environ | {"PYTHONPATH": str(SUPPORT), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", SCIPY], env=environment, capture_output=True, check=True)
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def ours():
    return {p.name: minimise(p.value_and_gradient, p.start, Settings(**LIMITS)) for p in PROBLEMS}


@every_problem
def test_the_minimum_equals_that_of_scipy(problem, ours, scipys):
    """Same memory, start and tolerance: f = f_SciPy where SciPy converges, f <= f_SciPy where it gives up.

    From the standard starts SciPy gives up on Powell's badly scaled problem and Meyer's before the minimum,
    on Jennrich and Sampson's far from it, and on Brown and Dennis's at it. The largest slope of Meyer's
    problem cannot fall below 1e-6 (f near 100, x near 6000): rounding ends the search at the paper's value.
    Where a problem has two minima, both methods find the same one: the higher one of Freudenstein and Roth's
    and of Biggs's problem, and a local one of the trigonometric problem, 2.8e-5, that the paper omits.
    """
    found, (value, _, converged) = ours[problem.name], scipys[problem.name]
    room = 3e-5 * value + 2e-8
    assert found.value <= value + room, f"{problem.name}: {found.message}, SciPy {value}"
    assert not converged or found.value >= value - room, f"{problem.name}: {found.message}, SciPy {value}"
    if problem.name == "Meyer":
        assert found.status is Status.FLAT
        assert found.value == pytest.approx(problem.minima[0], rel=2e-6)
    else:
        assert found.status is Status.CONVERGED
        assert np.abs(found.gradient).max() <= 1e-6


def test_it_takes_about_as_few_evaluations_as_scipy(ours, scipys):
    """The geometric mean of the ratios over all problems is at most 1.1."""
    ratios = {name: found.evaluations / scipys[name][1] for name, found in ours.items()}
    print(f"\n{'problem':28}{'ours':>6}{'SciPy':>6}{'ratio':>7}{'value':>14}{'SciPy':>14}")
    for name, ratio in ratios.items():
        found, (value, evaluations, converged) = ours[name], scipys[name]
        gave_up = "" if converged else "  SciPy gave up"
        print(
            f"{name:28}{found.evaluations:6}{evaluations:6}{ratio:7.2f}{found.value:14.6g}{value:14.6g}",
            end="",
        )
        print(gave_up)
    mean = math.exp(np.mean(np.log(list(ratios.values()))))
    print(f"geometric mean {mean:.3f}, worst {max(ratios.values()):.2f}")
    assert mean <= 1.1, f"{mean:.3f}"


def test_two_loops_are_the_inverse_hessian_of_bfgs():
    """H <- (1 - rho s y') H (1 - rho y s') + rho s s', from H_0 = s.y / y.y of the last pair (eq. 6.17)."""
    random = np.random.default_rng(2)
    n, pairs = 9, 6
    steps = tuple(random.standard_normal((pairs, n)))
    differences = tuple(s * random.uniform(0.5, 4, n) + 0.1 * random.standard_normal(n) for s in steps)
    assert min(s @ y for s, y in zip(steps, differences, strict=True)) > 0
    gradient = random.standard_normal(n)
    before = gradient.copy()

    inverse = np.eye(n) * (steps[-1] @ differences[-1]) / (differences[-1] @ differences[-1])
    for s, y in zip(steps, differences, strict=True):
        left = np.eye(n) - np.outer(s, y) / (s @ y)
        inverse = left @ inverse @ left.T + np.outer(s, s) / (s @ y)
    np.testing.assert_allclose(
        descent_direction(gradient, steps, differences), -inverse @ gradient, atol=1e-10
    )
    assert np.array_equal(gradient, before)


def test_iterates_on_a_quadratic_are_those_of_conjugate_gradients():
    """With exact searches the iterates of f = x'A x / 2 - b.x are those of conjugate gradients, which end in
    as many iterations as A has different eigenvalues (Nocedal and Wright, section 7.2 and theorem 5.4).
    """
    random = np.random.default_rng(3)
    basis = np.linalg.qr(random.standard_normal((8, 8)))[0]
    matrix = basis @ np.diag([1.0, 1, 2, 2, 5, 5, 9, 9]) @ basis.T
    b = random.standard_normal(8)

    x, iterates = np.zeros(8), []
    residual = direction = b
    for _ in range(4):
        length = residual @ residual / (direction @ matrix @ direction)
        x = x + length * direction
        new = b - matrix @ x
        direction = new + new @ new / (residual @ residual) * direction
        residual = new
        iterates.append(x)

    seen = []
    settings = Settings(decrease=1e-12, curvature=1e-10, gradient_tolerance=1e-8, first_step=0.1)
    found = minimise(
        lambda x: (float(x @ matrix @ x / 2 - b @ x), matrix @ x - b), np.zeros(8), settings,
        lambda state: seen.append(state.x),
    )  # fmt: skip
    assert found.status is Status.CONVERGED and found.iterations == 4, found.message
    np.testing.assert_allclose(seen, iterates, atol=1e-8)


# The line search


def sampled(function):
    """A function of a step that returns value and slope in the form of the search."""
    return lambda step: Sample(step, *map(float, function(step)))


def strong_wolfe(start, end, decrease, curvature):
    return end.value <= start.value + decrease * end.step * start.slope and abs(end.slope) <= curvature * abs(
        start.slope
    )


def rational(a):
    return -a / (a**2 + 2), (a**2 - 2) / (a**2 + 2) ** 2


def quintic(a):
    b = a + 0.004
    return b**5 - 2 * b**4, 5 * b**4 - 8 * b**3


def wavy_corner(a, rounding=0.01, waves=39):
    if abs(a - 1) < rounding:
        value, slope = (a - 1) ** 2 / (2 * rounding) + rounding / 2, (a - 1) / rounding
    else:
        value, slope = abs(a - 1), math.copysign(1, a - 1)
    phase = waves * math.pi * a / 2
    height = 2 * (1 - rounding) / (waves * math.pi)
    return value + height * math.sin(phase), slope + (1 - rounding) * math.cos(phase)


def bends(one, other):
    """Two bends: one near 0, one near 1."""

    def function(a):
        left, right = math.hypot(a, one), math.hypot(1 - a, other)
        weight_right, weight_left = math.hypot(1, one) - one, math.hypot(1, other) - other
        return (
            weight_right * right + weight_left * left,
            weight_right * (a - 1) / right + weight_left * a / left,
        )

    return function


@pytest.mark.parametrize(
    ("function", "decrease", "curvature", "trials", "steps"),
    [
        (rational, 1e-3, 0.1, (6, 3, 1, 4), "1.4 1.4 10 37"),
        (quintic, 0.1, 0.1, (12, 8, 8, 11), "1.6 1.6 1.6 1.6"),
        (wavy_corner, 0.1, 0.1, (12, 12, 10, 13), "1.0 1.0 1.0 1.0"),
        (bends(0.001, 0.001), 1e-3, 1e-3, (4, 1, 3, 4), "0.08 0.10 0.35 0.83"),
        (bends(0.01, 0.001), 1e-3, 1e-3, (6, 3, 7, 8), "0.075 0.078 0.073 0.076"),
        (bends(0.001, 0.01), 1e-3, 1e-3, (13, 11, 8, 11), "0.93 0.93 0.92 0.92"),
    ],
    ids=["table I", "table II", "table III", "table IV", "table V", "table VI"],
)
def test_the_search_takes_the_published_trials(function, decrease, curvature, trials, steps):
    """Moré and Thuente (1994), section 5: trials and steps from first steps 1e-3, 0.1, 10 and 1000."""
    rules = Rules(decrease, curvature, width=1e-10)
    for first, count, step in zip((1e-3, 0.1, 10.0, 1000.0), trials, steps.split(), strict=True):
        line = Recorded(lambda x: function(x.item()))
        start = sampled(function)(0.0)
        along = sampled(lambda a, line=line: line(np.array(a)))
        found = search(along, start, -math.inf, first=first, rules=rules)
        assert found.ending is Ending.WOLFE
        assert strong_wolfe(start, found.sample, decrease, curvature)
        assert len(line.points) == count, f"first step {first}: {len(line.points)} trials"
        digits = len(step.partition(".")[2])
        assert abs(found.sample.step - float(step)) <= 0.55 * 10**-digits, f"first step {first}"


@given(
    waves=st.lists(st.tuples(st.floats(-2, 2), st.floats(0.1, 9), st.floats(0, 6)), max_size=4),
    bowl=st.floats(1e-3, 10),
    first=st.floats(1e-3, 1e3),
    curvature=st.floats(0.01, 0.9),
)
def test_the_search_meets_the_strong_wolfe_conditions(waves, bowl, first, curvature):
    """On random smooth functions that are bounded below and have slope -1 at 0."""

    def function(a):
        value = bowl * a**2 + sum(h * math.sin(k * a + p) for h, k, p in waves)
        return value - down * a, 2 * bowl * a + sum(h * k * math.cos(k * a + p) for h, k, p in waves) - down

    down = 0.0
    down = function(0.0)[1] + 1
    start = sampled(function)(0.0)
    found = search(sampled(function), start, -math.inf, first=first, rules=Rules(1e-3, curvature, 0.0, 100))
    assert found.ending is Ending.WOLFE, found
    assert strong_wolfe(start, found.sample, 1e-3, curvature)
    assert sampled(function)(found.sample.step) == found.sample


def test_the_search_shortens_steps_beyond_the_domain():
    """phi(a) = -log(1 - a / edge) - 20 a / edge has its minimum at 0.95 edge; the first trial lies beyond."""
    edge = 1e-8
    trials = []

    def along(a):
        trials.append(a)
        inside = 1 - a / edge
        return Sample(
            a, -math.log(inside) - 20 * a / edge if inside > 0 else math.nan, 1 / inside / edge - 20 / edge
        )

    found = search(along, along(0.0), -math.inf, first=1e8, rules=Rules(1e-3, 0.1, 0.0))
    assert found.ending is Ending.WOLFE
    assert found.sample.step == pytest.approx(0.95 * edge, rel=0.01)
    assert len(trials) < 20
    too_far = [a for a in trials if a >= edge]
    assert len(too_far) > 1 and too_far == sorted(too_far, reverse=True)
    assert all(after < a for n, a in enumerate(trials) if a >= edge for after in trials[n + 1 :])


def test_the_search_ends_at_the_edge_of_the_domain():
    """Decreasing up to a = 1 and not finite beyond: the search ends within the width from a = 1."""
    found = search(lambda a: Sample(a, -a if a < 1 else math.nan, -1.0), Sample(0.0, 0.0, -1.0), first=7.0)
    assert found.ending is Ending.NARROW
    assert 0.9 <= found.sample.step < 1


def test_the_search_skips_a_gap_in_the_domain():
    """(a - 1)^2, not finite between 0.4 and 1.1, where the first interpolation lies."""
    trials = []

    def along(a):
        trials.append(a)
        return Sample(a, math.nan if 0.4 < a < 1.1 else (a - 1) ** 2, 2 * (a - 1))

    found = search(along, along(0.0), first=3.0)
    assert any(0.4 < a < 1.1 for a in trials)
    assert found.ending is Ending.WOLFE and 0 < found.sample.step <= 0.4


def test_the_search_of_an_unbounded_line_ends():
    found = search(lambda a: Sample(a, -a, -1.0), Sample(0.0, 0.0, -1.0))
    assert found.ending is Ending.EXHAUSTED
    assert found.sample.step > 1e9


def test_steps_grow_until_the_minimum_is_bracketed():
    """Interpolation finds the minimum of a parabola, 5.5, at once. The next advance is at most 4 times and at
    least 1.1 times the one before, as the proof of convergence requires (Moré and Thuente, section 2).
    """
    trials = []

    def along(a):
        trials.append(a)
        return Sample(a, (a - 5.5) ** 2, 2 * (a - 5.5))

    found = search(along, along(0.0), -math.inf, rules=Rules(1e-9, 1e-8))
    np.testing.assert_allclose(trials, [0, 1, 5, 9.4, 5.5])
    assert found.ending is Ending.WOLFE


def test_the_search_shortens_steps_without_sufficient_decrease():
    """phi(a) = (exp(-100 a) - 1) / 100 - a / 10^5 falls for ever, below a slope of -1/1000 only to a = 10."""

    def along(a):
        return Sample(a, math.expm1(-100 * a) / 100 - 1e-5 * a, -math.exp(-100 * a) - 1e-5)

    found = search(along, along(0.0), -math.inf, first=1000.0)
    assert found.ending is Ending.WOLFE and 0 < found.sample.step < 11


def test_slopes_decide_where_values_are_rounding():
    """phi = 1e6 + (a - 1)^2 / 1e11: values are constant to rounding, the slope identifies the step."""
    start = Sample(0.0, 1e6, -2e-11)
    found = search(lambda a: Sample(a, 1e6 + 1e-10, 2e-11 * (a - 1)), start, 1e6 * (1 + 1e-15), first=0.5)
    assert found.ending is Ending.APPROXIMATE_WOLFE
    assert abs(found.sample.slope) <= 0.9 * abs(start.slope)
    found = search(lambda a: Sample(a, 1e6 + 1e-4, 2e-11 * (a - 1)), start, 1e6 * (1 + 1e-15), first=0.5)
    assert found.sample is None, "the ceiling is no limit"

    def overshot(a):
        return Sample(a, 1e6 + 1e-10, 2e-11 * (a - 1))

    assert search(overshot, start, 1e6 * (1 + 1e-15), first=1.5).ending is Ending.APPROXIMATE_WOLFE
    rules = Rules(decrease=0.4, evaluations=1)
    assert search(overshot, start, 1e6 * (1 + 1e-15), first=1.5, rules=rules).ending is Ending.EXHAUSTED


# Functions that misbehave


def barrier(x):
    """x'x / 2 - sum log x: minimum at 1, not defined for x <= 0."""
    if (x <= 0).any():
        return math.nan, np.full(x.shape, math.nan)
    return float(x @ x / 2 - np.log(x).sum()), x - 1 / x


def raising_barrier(x):
    with np.errstate(all="raise"):
        return float(x @ x / 2 - np.log(x).sum()), x - 1 / x


def infinite_barrier(x):
    return barrier(x) if (x > 0).all() else (math.inf, np.zeros(x.shape))


def barrier_without_gradient(x):
    value, gradient = barrier(np.abs(x))
    return -100.0 if (x <= 0).any() else value, np.where(x <= 0, math.nan, gradient)


def barrier_below(x):
    return barrier(x) if (x > 0).all() else (-math.inf, np.zeros(x.shape))


@pytest.mark.parametrize(
    "function", [barrier, raising_barrier, infinite_barrier, barrier_without_gradient, barrier_below]
)
def test_steps_to_points_that_are_not_finite_are_shortened(function):
    """NaN, infinite, an exception, or a gradient that is not finite: the minimum is still found."""
    for first_step in (1.0, 1e3, 1e9):
        found = minimise(function, np.array([0.01, 3.0, 17.0]), Settings(first_step=first_step))
        assert found.status is Status.CONVERGED, found.message
        np.testing.assert_allclose(found.x, 1, atol=1e-6)
        assert found.evaluations < 60
        for limit in range(1, found.evaluations):
            recorded = Recorded(function) if function is not raising_barrier else Recorded(barrier)
            part = minimise(
                recorded, np.array([0.01, 3.0, 17.0]), Settings(first_step=first_step, evaluations=limit)
            )
            assert part.value == min(
                v for _, v, g in recorded.points if np.isfinite(v) and np.isfinite(g).all()
            )


def test_the_callers_numpy_error_settings_hold_in_the_function():
    """The minimiser ignores its own floating-point errors; the function's follow the caller's settings."""
    raised = []

    def function(x):
        try:
            return float(x @ x / 2 - np.log(x).sum()), x - 1 / x
        except FloatingPointError as error:
            raised.append(error)
            raise

    with np.errstate(all="raise"):
        found = minimise(function, np.array([0.01, 3.0, 17.0]), Settings(first_step=1e3))
    assert found.status is Status.CONVERGED and raised


def test_steps_that_overflow_are_shortened():
    """Linear descent, so steep or with steps so long that the next x or slope overflows."""

    def slope(x):
        return -float(x[0]), -np.ones(1)

    def cliff(x):
        return -1e300 * float(np.tanh(x[0])), np.array([-1e300])

    with np.errstate(all="raise"):
        found = minimise(slope, np.ones(1), Settings(first_step=1e305, iterations=3))
        assert found.status is Status.ITERATIONS and 1e307 < found.x[0] < math.inf
        found = minimise(cliff, np.ones(1), Settings(first_step=1e10))
        assert found.status is Status.NO_PROGRESS and found.evaluations == 1


def raising(x):
    raise FloatingPointError


@pytest.mark.parametrize("function", [raising, lambda x: (math.nan, x), lambda x: (1.0, x + math.inf)])
def test_a_start_that_is_not_finite_has_its_status(function):
    found = minimise(function, np.ones(2))
    assert found.status is Status.NOT_FINITE
    assert (found.evaluations, found.iterations) == (1, 0)
    assert np.array_equal(found.x, np.ones(2))


@pytest.mark.parametrize("tolerance", [1e-6, 0.0])
def test_a_flat_function_is_at_its_minimum(tolerance):
    found = minimise(lambda x: (7.0, np.zeros(3)), np.ones(3), Settings(gradient_tolerance=tolerance))
    assert found.status is Status.CONVERGED
    assert (found.evaluations, found.iterations, found.value) == (1, 0, 7.0)


@pytest.mark.parametrize("function", [lambda x: (7.0, np.ones(3)), lambda x: (float(x @ x), -2 * x)])
def test_a_gradient_that_contradicts_the_values_makes_no_progress(function):
    """Values that are constant or rise along -g: the start is returned after few evaluations."""
    found = minimise(function, np.ones(3))
    assert found.status is Status.NO_PROGRESS
    assert found.evaluations <= 41
    assert np.array_equal(found.x, np.ones(3))


def test_a_memory_without_descent_is_dropped():
    """With pairs of another function, the next point is that of a first iteration; the memory is reset."""
    state = minimise(rosenbrock, np.array([-1.2, 1.0]), Settings(iterations=0)).state
    bad = replace(state, steps=(np.array([1.0, 2.0]),), differences=(np.array([-3.0, -1.0]),))
    found = minimise(rosenbrock, bad, Settings(iterations=1))
    plain = minimise(rosenbrock, state, Settings(iterations=1))
    assert np.array_equal(found.x, plain.x)
    assert found.evaluations == plain.evaluations, "it went along a direction that does not fall"
    assert len(found.state.steps) == 1 and found.state.steps[0] @ found.state.differences[0] > 0


@pytest.mark.parametrize(
    ("function", "start", "tolerance"),
    [
        (lambda x: (1e12 * float(x @ x), 2e12 * x), np.array([3.0, -5.0]), 1e4),
        (lambda x: (1e200 * float(x @ x), 2e200 * x), np.array([3.0, -5.0]), 1e192),
        (lambda x: (1e-200 * float(x @ x), 2e-200 * x), np.array([3.0, -5.0]), 1e-208),
        (lambda x: (float(np.cosh(40 * x).sum()), 40 * np.sinh(40 * x)), np.array([1.0, -12.0]), 1e-6),
    ],
    ids=["1e12", "1e200", "1e-200", "cosh"],
)
def test_steep_functions_end_at_their_minimum(function, start, tolerance):
    """Scaled by 1e200 or 1e-200, or growing as exp(40 x): x converges to 0 without warnings."""

    def quiet(x):
        with np.errstate(all="ignore"):
            return function(x)

    with np.errstate(all="raise"):
        found = minimise(quiet, start, Settings(gradient_tolerance=tolerance, **LIMITS))
    assert found.status is Status.CONVERGED, found.message
    assert np.abs(found.x).max() < 1e-6, found.message
    assert found.evaluations < 200


@pytest.mark.parametrize("name", ["Rosenbrock", "Bard", "Wood", "Meyer", "Osborne 2", "Powell badly scaled"])
def test_single_precision_ends_within_its_noise(name):
    """With value and gradient rounded to float32, f is within 1e-5 of the minimum, after about as many
    evaluations as without rounding.
    """
    problem = BY_NAME[name]

    def rounded(x):
        value, gradient = problem.value_and_gradient(x)
        return float(np.float32(value)), gradient.astype(np.float32)

    exact = minimise(problem.value_and_gradient, problem.start, Settings(**LIMITS))
    found = minimise(rounded, problem.start, Settings(noise=1e-6, gradient_tolerance=1e-9, **LIMITS))
    assert found.evaluations <= 1.5 * exact.evaluations + 40, found.message
    assert found.status not in (Status.ITERATIONS, Status.EVALUATIONS)
    assert problem.value_and_gradient(found.x)[0] == pytest.approx(exact.value, rel=1e-5, abs=1e-9)


def test_the_gradient_converges_beyond_the_precision_of_values():
    """Brown and Dennis's f is 85822 at its minimum, with rounding errors of 1e-11, above the changes due to
    slopes of 1e-5: the noise setting lets the slopes converge to 1e-6.
    """
    problem = BY_NAME["Brown-Dennis"]
    assert minimise(problem.value_and_gradient, problem.start).status is Status.CONVERGED
    found = minimise(problem.value_and_gradient, problem.start, Settings(noise=0.0))
    assert found.status in (Status.FLAT, Status.NO_PROGRESS)
    assert found.point.steepness > 1e-5


def test_only_pairs_of_positive_curvature_are_kept():
    """On an unbounded ridge s.y is negative: such pairs would make H indefinite."""

    def ridge(x):
        return x[0] ** 2 - x[1] ** 2, np.array([2 * x[0], -2 * x[1]])

    seen = []
    start = np.array([1.0, 1e-3])
    minimise(ridge, start, Settings(iterations=3), seen.append)
    x = np.array([start, *(state.x for state in seen)])
    products = [
        s @ (ridge(b)[1] - ridge(a)[1]) for s, a, b in zip(np.diff(x, axis=0), x, x[1:], strict=False)
    ]
    assert min(products) < 0, "the test shows nothing"
    for state in seen:
        assert all(s @ y > 0 for s, y in zip(state.steps, state.differences, strict=True))


# What it gives back


def test_a_callback_stops_at_the_point_of_one_evaluation():
    """x, value and gradient belong to one evaluation: that of the iteration at which the callback stops."""
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), callback=lambda state: state.iteration == 7)
    assert found.status is Status.STOPPED
    assert found.iterations == 7 and len(found.history) == 8
    value, gradient = rosenbrock(found.x)
    assert found.value == value and np.array_equal(found.gradient, gradient)


@pytest.mark.parametrize("limit", [1, 2, 3, 5, 8, 13, 21, 34, 55, 89])
@pytest.mark.parametrize("name", ["Rosenbrock", "Meyer", "Brown badly scaled", "Watson 9"])
def test_a_limit_of_evaluations_is_kept_and_the_lowest_point_returned(name, limit):
    """Also if the limit is reached within a line search."""
    problem = BY_NAME[name]
    function = Recorded(problem.value_and_gradient)
    found = minimise(function, problem.start, Settings(evaluations=limit))
    assert len(function.points) == found.evaluations <= limit
    if found.status is not Status.CONVERGED:
        assert found.status is Status.EVALUATIONS and found.evaluations == limit
        assert found.value == function.lowest
    value, gradient = problem.value_and_gradient(found.x)
    assert found.value == value and np.array_equal(found.gradient, gradient)


@pytest.mark.parametrize("name", ["Wood", "Osborne 2", "Meyer"])
def test_resuming_equals_an_uninterrupted_minimisation(name):
    """Bit-equal, from any iteration, after a limit of iterations, or one within a line search."""
    problem = BY_NAME[name]
    states = []
    settings = Settings(iterations=60, evaluations=1000)
    complete = minimise(problem.value_and_gradient, problem.start, settings, states.append)
    for state in states[:: len(states) // 6]:
        assert same(minimise(problem.value_and_gradient, state, settings), complete)
    for stop in ({"iterations": 7}, {"evaluations": 11}, {"evaluations": 12}, {"evaluations": 13}):
        part = minimise(problem.value_and_gradient, problem.start, replace(settings, **stop))
        going_on = minimise(problem.value_and_gradient, part.state, settings)
        assert same(going_on, complete) and going_on.evaluations == complete.evaluations
        assert going_on.history == complete.history and going_on.status is complete.status


def test_a_state_keeps_the_lowest_point():
    """A point that a line search tried but did not end at is returned unless a lower one is found."""
    state = minimise(rosenbrock, np.array([-1.2, 1.0]), Settings(iterations=3)).state
    lower = minimise(rosenbrock, np.array([-1.2, 1.0]), Settings(iterations=20)).point
    found = minimise(rosenbrock, replace(state, best=lower), Settings(iterations=5))
    assert found.point is lower and found.state.best is lower
    assert minimise(rosenbrock, found.state).value < lower.value


def test_limits_of_iterations_are_kept():
    for limit in (0, 1, 5):
        found = minimise(rosenbrock, np.array([-1.2, 1.0]), Settings(iterations=limit))
        assert found.status is Status.ITERATIONS and found.iterations == limit


def test_a_small_change_ends_the_minimisation():
    """The last relative decrease is at most the tolerance, all earlier ones exceed it."""
    settings = Settings(change_tolerance=1e-3, gradient_tolerance=0.0)
    found = minimise(BY_NAME["Brown-Dennis"].value_and_gradient, BY_NAME["Brown-Dennis"].start, settings)
    assert found.status is Status.SMALL_CHANGE
    values = np.array(found.history)
    changes = (values[:-1] - values[1:]) / np.maximum(np.abs(values[:-1]), np.abs(values[1:]))
    assert changes[-1] <= 1e-3 < changes[:-1].min()


def test_the_memory_holds_the_last_pairs():
    """s = x_(k+1) - x_k and y = g_(k+1) - g_k, for the last three iterations."""
    seen = []
    minimise(rosenbrock, np.array([-1.2, 1.0]), Settings(memory=3), seen.append)
    for position, state in enumerate(seen[3:20], start=3):
        x = np.array([one.x for one in seen[position - 3 : position + 1]])
        gradients = np.array([one.gradient for one in seen[position - 3 : position + 1]])
        np.testing.assert_array_equal(state.steps, np.diff(x, axis=0))
        np.testing.assert_array_equal(state.differences, np.diff(gradients, axis=0))


@pytest.mark.parametrize("length", [1e-4, 0.5])
def test_the_first_trial_is_a_step_of_first_step_along_the_negative_gradient(length):
    function = Recorded(rosenbrock)
    minimise(function, np.array([-1.2, 1.0]), Settings(first_step=length, evaluations=2))
    (start, _, gradient), (trial, _, _) = function.points
    np.testing.assert_allclose(trial - start, -length * gradient / np.linalg.norm(gradient), rtol=1e-9)


def test_arrays_are_not_shared_with_the_function():
    """A function that overwrites its argument and reuses one array for all gradients has the same minimum;
    the start is unchanged; a callback cannot write to the state.
    """
    buffer = np.zeros(2)

    def careless(x):
        value, buffer[:] = rosenbrock(x)
        x[:] = math.nan
        return value, buffer

    def meddling(state):
        for array in (state.x, state.gradient, state.steps[-1], state.differences[-1], state.best.x):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0

    start = np.array([-1.2, 1.0])
    assert same(minimise(careless, start, callback=meddling), minimise(rosenbrock, start))
    assert np.array_equal(start, [-1.2, 1.0]) and start.flags.writeable


def test_an_interrupt_propagates():
    def interrupted(x):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        minimise(interrupted, np.ones(2))


def test_the_message_names_the_status():
    assert minimise(quadratic, np.array([3.0, 4.0])).message.startswith("converged after ")


@pytest.mark.parametrize(
    ("setting", "rule"),
    [
        ({"memory": 0}, "memory is 0, must be a whole number, at least 1"),
        ({"memory": 2.5}, "memory is 2.5, must be a whole number"),
        ({"gradient_tolerance": -1e-3}, "gradient_tolerance is -0.001, must be at least 0"),
        ({"gradient_tolerance": math.nan}, "gradient_tolerance is nan"),
        ({"change_tolerance": 1.0}, "change_tolerance is 1.0, must be at least 0, below 1"),
        ({"iterations": -1}, "iterations is -1, must be at least 0"),
        ({"evaluations": 0}, "evaluations is 0, must be at least 1"),
        ({"decrease": 0.5}, "decrease is 0.5, must be above 0, below 1/2"),
        ({"curvature": 1e-4}, "curvature is 0.0001, must be above decrease, below 1"),
        ({"curvature": 1.0}, "curvature is 1.0"),
        ({"noise": -1e-9}, "noise is -1e-09"),
        ({"first_step": 0.0}, "first_step is 0.0, must be above 0"),
        ({"first_step": math.inf}, "first_step is inf"),
    ],
)
def test_settings_outside_their_range_are_refused(setting, rule):
    with pytest.raises(ValueError) as refusal:
        Settings(**setting)
    assert rule in str(refusal.value)


@pytest.mark.parametrize("start", [np.ones((2, 2)), np.ones(0), np.array([1.0, math.nan]), 3.0])
def test_starts_that_are_not_vectors_are_refused(start):
    with pytest.raises(ValueError, match="the start must be a vector of finite numbers, not"):
        minimise(quadratic, start)


def test_gradients_of_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"the gradient has shape \(3,\), the start \(2,\)"):
        minimise(lambda x: (0.0, np.ones(3)), np.ones(2))


def test_a_state_gives_its_point():
    states: list[Iterate] = []
    minimise(quadratic, np.array([3.0, 4.0]), callback=states.append)
    for number, state in enumerate(states, start=1):
        assert state.iteration == number and state.value == state.values[-1] == quadratic(state.x)[0]
        assert state.slopes[-1] == np.abs(state.gradient).max()
