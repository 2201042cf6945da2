"""What holds of every gradient: it equals differences, and no way of computing it changes a bit of it."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from control_cases import (
    CASES,
    END,
    GRID,
    MAP,
    PARTICLES,
    PUSH,
    Case,
    begin,
    cells_of_traces,
    compared,
    paint,
)
from wfluid.kernels.cell.real import Real

import wfluid.gradient.functional
import wfluid.step.step
from wfluid import (
    Buoyancy,
    Constant,
    Density,
    Fluid,
    Freeze,
    GaussianForce,
    Grid,
    Growth,
    Oscillator,
    Painted,
    Source,
    Timeline,
    VortexForce,
    Wind,
)
from wfluid.fields.state import State
from wfluid.gradient.checkpoints import even_segments, least_room
from wfluid.gradient.functional import Functional
from wfluid.gradient.objectives import Effort, ParticleMisfit
from wfluid.gradient.recording import MEGABYTE
from wfluid.gradient.state_objectives import DensityMisfit, MapMisfit
from wfluid.gradient.step_loops import WORKING_STATES
from wfluid.gradient.variables import Free
from wfluid.step.tape import record, recording

FREE_SLIP, NO_SLIP, MOVES, DENSITIES, CHANGES = (
    CASES[name]
    for name in (
        "constant viscosity, free-slip",
        "painted viscosity, no-slip",
        "viscosity that moves, periodic",
        "densities, periodic and free-slip",
        "viscosity that changes, free-slip and periodic",
    )
)


LOOSE = {"diffusion_tolerance": 1e-4, "pressure_tolerance": 1e-4}
"""Solves that are quick to record: how far they go makes no difference to what is the same."""


def loosely(case, **changes):
    """A case with such solves."""
    return replace(case, fluid=case.fluid | LOOSE, **changes)


def some_way_off(functional, seed=0):
    """Controls a little beside where a functional starts."""
    return functional.start + 0.01 * np.random.default_rng(seed).standard_normal(functional.start.size)


def assert_same(found, expected):
    """Value and gradient are equal bit for bit."""
    assert found[0] == expected[0]
    np.testing.assert_array_equal(found[1], expected[1])


# Differences


STEP = 3e-5
"""Of the differences: their error is STEP^4 / 30 = 3e-20 of a fifth derivative, which would have to be 1e10
times the gradient to be seen; the rounding of a value, some 30 eps, is 30 eps / STEP = 2e-10 of it, and of a
gradient that is a tenth of the value 2e-9."""


@pytest.mark.float64
@pytest.mark.parametrize("name", [name for name in CASES if "least memory" not in name])
def test_the_gradient_equals_differences_of_fourth_order(device, name):
    """Of the six controls whose gradients are largest, one of each kind; where no trace changes its cell."""
    functional = CASES[name].functional(device)
    m = functional.start
    _, gradient = functional.value_and_gradient(m)
    cells, compared = cells_of_traces(functional), 0
    entries = [one.entries for one in functional.variables.slices]
    largest = [own.start + np.argmax(np.abs(gradient[own])) for own in entries]
    for n in sorted(largest, key=lambda n: -abs(gradient[n]))[:6]:
        values, crossed = {}, False
        for by in (-2, -1, 1, 2):
            changed = m.copy()
            changed[n] += by * STEP
            values[by] = functional.value(changed)
            crossed |= np.any(cells_of_traces(functional) != cells)
        if not crossed:
            expected = (8 * (values[1] - values[-1]) - values[2] + values[-2]) / (12 * STEP)
            assert gradient[n] == pytest.approx(expected, rel=1e-8), n
            compared += 1
    assert compared >= 3


@pytest.mark.float64
def test_forces_of_no_strength_have_gradients_with_respect_to_it(device):
    """As an optimisation from rest begins; where they are makes no difference to first order."""
    forces = [
        GaussianForce((0.4, 0.3), (0.0, 0.0), 0.15),
        VortexForce((0.6, 0.4), 0.0, 0.12),
        Growth((0.5, 0.2), 0.0, 0.15),
        Wind((0.0, 0.0), weight=Painted(paint(0, 1, 1))),
        Buoyancy("ink", (0.0, 0.0)),
        GaussianForce((0.6, 0.5), (3.0, 2.0), 0.15, Oscillator(amplitude=0.0, period=0.3)),
    ]
    fluid = {"densities": [Density(initial=Painted(paint(1, 2, 2)), sources=[Source((0.4, 0.4), 0.0, 0.1)])]}
    names = ["forces[*].vector", "forces[1].spin", "forces[2].rate", "forces[5].envelope.amplitude"]
    free = [*names, "fluid.densities[0].sources[0].rate", "forces[0].center", "forces[1].radius"]
    objective = PARTICLES + DensityMisfit("ink", paint(0, 1, 3), END)
    case = Case([*forces, PUSH], objective, free, fluid, begin())
    functional = case.functional(device)
    _, gradient = functional.value_and_gradient(functional.start)
    for one in functional.variables.slices:
        found = gradient[one.entries]
        if one.name in ("forces[0].center", "forces[1].radius", "forces[5].vector"):
            assert not np.any(found)
            continue
        for n in range(one.entries.start, one.entries.stop):
            near, far = (
                functional.value(functional.start + by * np.eye(functional.variables.size)[n])
                - functional.value(functional.start - by * np.eye(functional.variables.size)[n])
                for by in (1e-4, 2e-4)
            )
            expected = (8 * near - far) / 12e-4
            assert abs(expected) > 1e-7, one.name
            assert gradient[n] == pytest.approx(expected, rel=1e-6, abs=1e-11), one.name


@pytest.mark.float64
def test_a_force_outside_its_window_has_no_gradient(device):
    """Not even by rounding; nor has one after the last time that the objective looks at."""
    forces = [
        PUSH,
        replace(PUSH, envelope=Constant(END + 0.01)),
        replace(PUSH, envelope=Constant(0.15, 0.18)),
        VortexForce((0.5, 0.4), 20.0, 0.2, Oscillator(start=1.0)),
        Growth((0.5, 0.4), 2.0, 0.2, Constant(-1.0, 0.0)),
    ]
    early = ParticleMisfit(PARTICLES.points, PARTICLES.destinations, 6 / 48)
    free = ["forces[*].vector", "forces[*].center", "forces[*].radius", "forces[3].spin", "forces[4].rate"]
    functional = Case(forces, early, free, {}, begin()).functional(device)
    _, gradient = functional.value_and_gradient(functional.start)
    for one in functional.variables.slices:
        assert bool(np.any(gradient[one.entries])) == one.name.startswith("forces[0]"), one.name


# Bits


@pytest.mark.float64
@pytest.mark.parametrize(
    "case",
    [FREE_SLIP, NO_SLIP, MOVES, DENSITIES, CHANGES],
    ids=["constant", "painted", "moves", "ink", "changes"],
)
def test_memory_caps_do_not_change_a_bit(device, case):
    """Nor does it with segments that do not divide the 23 steps; and the states keep below the cap."""
    case = loosely(case)
    whole = case.functional(device, timeline=LONGER)
    least, most = case.least_memory(device, timeline=LONGER), whole.memory / MEGABYTE
    m = some_way_off(whole)
    expected, lengths = whole.value_and_gradient(m), set()
    for part in (0.0, 0.4, 0.99):
        cap = least + part * (most - least)
        capped = case.functional(device, timeline=LONGER, memory_mb=cap)
        schedule = capped._recording.schedule
        assert not schedule.keeps_all and capped.memory <= cap * MEGABYTE
        lengths |= {end - start for start, end in schedule.segments}
        assert_same(capped.value_and_gradient(m), expected)
        assert capped.value(m) == expected[0]
    assert len(lengths) > 2


LONGER = Timeline(23 / 48, fps=48, substeps=1)


@pytest.mark.parametrize("case", [FREE_SLIP, NO_SLIP, DENSITIES], ids=["constant", "painted", "ink"])
@pytest.mark.parametrize("steps", [7, 30, 101])
def test_memory_is_the_states_of_the_schedule(device, case, steps):
    """So many rooms, and those of the states and gradients that a step works with."""
    timeline = Timeline(steps / 48, fps=48, substeps=1)
    case = loosely(case, objective=ParticleMisfit(PARTICLES.points, PARTICLES.destinations, steps / 48))
    functional = case.functional(device, timeline=timeline)
    densities, coupled = (
        len(case.fluid.get("densities", ())),
        functional._recording.step.coefficients is not None,
    )
    cells = functional._recording.step.layout.size
    numbers = (4 + densities + coupled) * cells + 2 * len(PARTICLES.points)
    each = numbers * np.dtype(wp.dtype_to_numpy(Real)).itemsize

    def expected(functional):
        return (functional._recording.schedule.room + WORKING_STATES) * each

    assert functional.memory == expected(functional)
    assert functional._recording.schedule.room == steps + 1
    least = replace(case, capped=True).functional(device, timeline=timeline)
    assert least.memory == expected(least) < functional.memory
    assert least._recording.schedule.room == least_room(steps) <= 2 * steps**0.5 + 3
    cap = 0.5 * (least.memory + functional.memory)
    between = case.functional(device, timeline=timeline, memory_mb=cap / MEGABYTE)
    assert between.memory == expected(between) <= cap
    assert between._recording.schedule == even_segments(steps, int(cap / each) - WORKING_STATES)


@pytest.mark.float64
@pytest.mark.parametrize("capped", [False, True], ids=["", "capped"])
@pytest.mark.parametrize("case", [FREE_SLIP, NO_SLIP, DENSITIES], ids=["constant", "painted", "ink"])
def test_a_replay_computes_the_bits_of_a_fresh_recording(device, case, capped):
    """After other controls, and after a gradient or none."""
    case = loosely(case, capped=capped)
    used, fresh = case.functional(device), case.functional(device)
    m = some_way_off(used)
    first = used.value_and_gradient(used.start)
    used.value(some_way_off(used, 5))
    assert_same(used.value_and_gradient(m), fresh.value_and_gradient(m))
    assert_same(used.value_and_gradient(used.start), first)


SOLVES = {
    "one component apart from the other": (0.003, {}, 30.0),
    "both together": (paint(0.0002, 0.0004, 1), {"walls": "no-slip"}, 100.0),
    "both together, frozen": (
        paint(0.0002, 0.0004, 1),
        {"freeze": Freeze(paint(0, 0.3, 2), 1e3)},
        100.0,
    ),
}


@pytest.mark.float64
@pytest.mark.parametrize("name", SOLVES)
def test_a_viscosity_that_needs_another_solve_is_captured_again(device, name):
    """More sweeps or cycles, or conjugate gradients: recorded anew, and the old ones still there."""
    viscosity, settings, times = SOLVES[name]
    fluid = {"viscosity": viscosity, "diffusion_tolerance": 1e-5, **settings}
    case = Case([PUSH], PARTICLES + MAP, ["fluid.viscosity", "forces[0].vector"], fluid, begin())
    used, fresh = case.functional(device), case.functional(device)
    of_viscosity, thick = used.variables.slices[0], used.start.copy()
    thick[of_viscosity.entries] += np.log(times) / of_viscosity.scale
    first, plan = used.value_and_gradient(used.start), used._recording.loops.methods
    found, other_plan = used.value_and_gradient(thick), used._recording.loops.methods
    assert plan != other_plan
    assert_same(found, fresh.value_and_gradient(thick))
    assert fresh._recording.loops.methods == other_plan
    assert_same(used.value_and_gradient(used.start), first)
    assert_same(used.value_and_gradient(thick), found)


@pytest.mark.float64
@pytest.mark.parametrize("walls", ["free-slip", "no-slip"])
@pytest.mark.parametrize("viscosity", [0.003, 0.1])
def test_a_free_number_has_its_gradient_at_any_tolerance_that_is_allowed(device, walls, viscosity):
    """That of the function itself: the rates of sweeps and cycles change with the viscosity."""
    fluid = {"viscosity": viscosity, "walls": walls, "diffusion_tolerance": 1e-4}
    functional = Case([PUSH], PARTICLES, ["fluid.viscosity"], fluid, begin()).functional(device)
    m, step = functional.start, 1e-4
    _, slope = functional.value_and_gradient(m)
    difference = (functional.value(m + step) - functional.value(m - step)) / (2 * step)
    assert slope[0] == pytest.approx(difference, rel=3e-6)


LARGE = Grid(70, 52, 1.0, 0.7)
"""Rows enough to be shared."""

HILL = 0.01 + 0.02 * np.exp(-(np.linspace(-2, 2, 52)[:, None] ** 2) - np.linspace(-2, 2, 70) ** 2)
SHARED = {
    "constant": {"viscosity": 0.01},
    "paper": {"viscosity": 0.01, "scheme": "paper", "sweeps": 5},
    "painted": {"viscosity": HILL, "walls": "no-slip,periodic"},
    "moves": {"viscosity": HILL, "viscosity_moves": True},
    "frozen": {"viscosity": 0.01, "freeze": Freeze((HILL > 0.025).astype(float))},
}


@pytest.mark.parametrize("name", SHARED)
def test_two_threads_compute_the_bits_of_one(device, monkeypatch, name):
    """Of value and gradient, whatever the fluid, with every kind of force and a density."""
    if device.is_cuda:
        pytest.skip("strips are for CPU threads")
    monkeypatch.setattr(wfluid.step.step, "free_cores", lambda: 2)
    ink = Density(diffusion=0.05, initial=Painted(HILL * 50), sources=[Source((0.5, 0.4), 2.0, 0.1)])
    fluid = Fluid(densities=[ink], diffusion_tolerance=1e-4, **SHARED[name])
    forces = [
        PUSH,
        replace(PUSH, weight=Painted(HILL * 30)),
        VortexForce((0.3, 0.4), 20.0, 0.1),
        Growth((0.6, 0.4), 3.0, 0.1),
        Wind((2.0, 1.0)),
        Buoyancy("ink", (0.0, -3.0)),
    ]
    objective = PARTICLES_EARLY + MapMisfit(np.full((2, 52, 70), 0.01), 4 / 48) + 1e-3 * Effort()
    free = ["forces[*].vector", "forces[*].center", "forces[2].spin", "forces[3].rate", "velocity"]
    free += ["fluid.densities[0].sources[0].rate"] + ["fluid.viscosity"] * (name != "paper")
    found = []
    for least in (0, 10**9):
        monkeypatch.setattr(wfluid.step.step, "SHARED_ALONE", least)
        functional = Functional(
            LARGE, fluid, forces, FOUR_STEPS, objective, [Free(one) for one in free], device=str(device)
        )
        assert (functional._recording.loops.pool is not None) == (least == 0)
        found.append([functional.value_and_gradient(some_way_off(functional)) for _ in range(2)])
    (two, again), (one, _) = found
    assert_same(two, one)
    assert_same(again, one)
    assert np.all(np.isfinite(one[1])) and np.abs(one[1]).max() > 1e-6


FOUR_STEPS = Timeline(4 / 48, fps=48, substeps=1)
PARTICLES_EARLY = ParticleMisfit(PARTICLES.points, PARTICLES.destinations, 4 / 48)


# What is written over


class Collected:
    """A logger that keeps warnings."""

    def __init__(self):
        self.warnings = []

    def debug(self, message):
        pass

    info = error = debug

    def warning(self, message, category=None, stacklevel=1):
        self.warnings.append(str(message))


@pytest.fixture
def watched(device, monkeypatch):
    """Warp's watch over what is written after it was read: the warnings of some work."""
    logger, before = Collected(), wp.get_logger()
    monkeypatch.setattr(wp.config, "verify_autograd_array_access", True)
    monkeypatch.setattr(wp.config, "log_level", wp.LOG_WARNING)
    monkeypatch.setattr(wfluid.gradient.functional, "open_device", lambda name: device)  # it would raise it
    wp.set_logger(logger)

    def warnings(work):
        work()
        return [one for one in logger.warnings if "has already been read" in one]

    yield warnings
    wp.set_logger(before)


@pytest.mark.float64
@pytest.mark.parametrize("capped", [False, True], ids=["", "capped"])
@pytest.mark.parametrize("case", [FREE_SLIP, MOVES, DENSITIES], ids=["constant", "moves", "ink"])
def test_no_array_is_overwritten_that_the_backward_pass_reads(device, watched, case, capped):
    def evaluate():
        functional = loosely(case).functional(device, memory_mb=least_mb if capped else None)
        functional.value_and_gradient(functional.start)
        assert wp.config.log_level == wp.LOG_WARNING

    least_mb = loosely(case).least_memory(device)
    assert not watched(evaluate)


@pytest.mark.float64
def test_a_tape_over_steps_that_alternate_between_two_states_warns(device, watched):
    """What the last test would see: the second step writes the state that the first read."""
    a, b = (State.at_rest(GRID, device, points=1) for _ in range(2))
    for state in (a, b):
        state.take_gradient(State.at_rest(GRID, device, points=1))
    with recording():
        assert not watched(lambda: record(print, a.arrays, b.arrays))
        warnings = watched(lambda: record(print, b.arrays, a.arrays))
    assert len(warnings) == len(a.arrays) and all("a stage" in one for one in warnings)


# Precision


@pytest.fixture(scope="module")
def in_double_precision(device):
    """Gradients by case and slice, from a process of double precision."""
    folder = Path(__file__).parents[1] / "support"
    paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    environment = dict(os.environ, WFLUID_PRECISION="float64", PYTHONPATH=paths)
    code = f"import json, control_cases; print(json.dumps(control_cases.compared({str(device)!r})))"
    result = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout.strip().splitlines()[-1])


def test_single_precision_gives_the_gradient_of_double_to_a_thousandth(device, in_double_precision):
    """Of each slice, in norm."""
    for name, slices in compared(str(device)).items():
        for one, gradient in slices.items():
            expected = np.array(in_double_precision[name][one])
            error = np.linalg.norm(gradient - expected)
            assert 0 < error <= 1e-3 * np.linalg.norm(expected), (name, one)
