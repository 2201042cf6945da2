"""Objectives add, keep what they were made of and leave nothing behind; recordings survive interruptions."""

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.real import Real

from wfluid import (
    Effort,
    Fluid,
    Free,
    Freeze,
    Functional,
    GaussianForce,
    Grid,
    Instantaneous,
    ParticleMisfit,
    Timeline,
    WarpObjective,
)
from wfluid.gradient.objectives import Sum, terms_of
from wfluid.gradient.step_loops import StepLoops

GRID = Grid(17, 12, 1.0, 0.7)
FORCES = [GaussianForce((0.4, 0.3), (1.5, 0.5), 0.12)]
POINTS = np.array([[0.42, 0.33], [0.6, 0.2]])
MISFIT = ParticleMisfit(POINTS, POINTS + 0.03, 0.125)


@pytest.fixture
def make(request):
    device = request.config.getoption("--device")

    def build(objective, fluid=None, free=("forces[0].vector",), **more):
        free = [Free(one) for one in free]
        timeline = Timeline(0.125, fps=24, substeps=2)
        return Functional(GRID, fluid or Fluid(), FORCES, timeline, objective, free, device=device, **more)

    return build


def test_objectives_follow_the_rules_of_sums(make):
    """a - b / 2 + 3 (a + c) is 4 a - b / 2 + 3 c, whatever way it is written."""
    a, b, c = MISFIT, Effort(), ParticleMisfit(POINTS[:1], POINTS[:1], 0.0625)
    whole = a - b / 2 + 3 * (a + c)
    assert [weight for weight, _ in terms_of(whole)] == [1, -0.5, 3, 3]
    assert terms_of(sum([a, b])) == terms_of(a + b)
    assert terms_of(Sum(((2.0, Sum(((3.0, a), (1.0, b)))),))) == ((6.0, a), (2.0, b))
    assert terms_of(-a) == ((-1.0, a),)
    m = np.array([1.0, 0.2])
    parts = [make(part).value(m) for part in (a, b, c)]
    assert make(whole).value(m) == pytest.approx(np.dot([4, -0.5, 3], parts), rel=1e-6)


def test_an_objective_keeps_its_numbers_when_the_arrays_it_was_made_of_change(make):
    destinations, weights = POINTS + 0.02, np.array([1.0, 2.0])
    functional = make(ParticleMisfit(POINTS, destinations, 0.125, weights))
    before = functional.value(functional.start)
    destinations[:], weights[:] = 0, 0
    assert functional.value(functional.start) == before
    with pytest.raises(ValueError, match="read-only"):
        functional.start[0] = 7.0


def test_a_misfit_counts_every_particle_by_its_weight(make):
    """1/2 sum of weight |x - destination|^2; where the particles rest that is known beforehand."""
    off = np.array([(0.03, 0.04), (0.03, 0.04)])
    misfit = ParticleMisfit(POINTS, POINTS + off, 0.125, [5.0, 0.5])
    functional = make(misfit)
    value, _ = functional.value_and_gradient(np.zeros(2))
    assert value == pytest.approx(0.5 * (5.0 + 0.5) * 0.05**2, rel=1e-5)
    by = np.array([(0.0, 0.01), (0.02, 0.0)])
    value, slope = misfit.at(0.125, POINTS + by)
    assert value == pytest.approx(0.5 * (5.0 * 0.0018 + 0.5 * 0.0017))
    np.testing.assert_allclose(slope, [(-0.15, -0.15), (-0.005, -0.02)])


@pytest.mark.parametrize("step", [8, 11, 5, 14])
def test_a_blow_where_two_steps_meet_costs_its_effort_once(request, step):
    """1/2 |V|^2 pi sigma^2 for a blow V, by a step: whichever way rounding moves the step's start."""
    timeline = Timeline(17 / 48, fps=24, substeps=2)
    blow = GaussianForce((0.5, 0.35), (0.3, -0.2), 0.06, Instantaneous(timeline.time_of(step)))
    misfit, device = Effort(), request.config.getoption("--device")
    functional = Functional(
        Grid(48, 34, 1.0, 0.7), Fluid(), [blow], timeline, misfit, [Free("forces[0].vector")], device=device
    )
    value, _ = functional.value_and_gradient(functional.start)
    expected = 0.5 * (0.3**2 + 0.2**2) * np.pi * 0.06**2 / timeline.dt
    assert value == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((np.zeros((2, 3)), np.zeros((2, 3)), 0.1), r"points of shape \(2, 3\): expected \(n, 2\)"),
        (([0.1, 0.2], [0.1, 0.2], 0.1), r"points of shape \(2,\): expected \(n, 2\)"),
        ((POINTS, POINTS, 0.1, [1.0, 2.0, 3.0]), r"weights of shape \(3,\) for 2 particles"),
    ],
)
def test_places_and_weights_of_other_shapes_are_refused(arguments, says):
    with pytest.raises(ValueError, match=says):
        ParticleMisfit(*arguments)


@pytest.mark.parametrize("memory_mb", [np.inf, np.nan, -1.0])
def test_a_cap_that_is_no_number_of_megabytes_is_refused(make, memory_mb):
    with pytest.raises(ValueError, match="expected a positive number of megabytes"):
        make(MISFIT, memory_mb=memory_mb)


def test_names_alone_are_no_free_numbers_and_indices_no_mask():
    for free, error, says in [
        (["forces[0].vector"], TypeError, "a list of Free"),
        (Free("forces[0].vector"), TypeError, "a list of Free"),
        ([Free("forces[0].vector", parts=[0, 1])], ValueError, "a mask of True and False"),
    ]:
        with pytest.raises(error, match=says):
            Functional(GRID, Fluid(), FORCES, Timeline(0.125, fps=24), MISFIT, free)


@wp.kernel
def squared(x: wp.array[Real], total: wp.array[Real]):
    wp.atomic_add(total, 0, x[wp.tid()] * x[wp.tid()])


@wp.kernel
def halved(total: wp.array[Real], value: wp.array[Real]):
    wp.atomic_add(value, 0, Real(0.5) * total[0] * total[0])


def test_intermediate_gradients_of_a_warp_objective_do_not_accumulate(make, device):
    """The same numbers give the same gradient, however often they are asked for."""
    total = wp.zeros(1, dtype=Real, device=device, requires_grad=True)

    def program(state, value):
        total.zero_()
        wp.launch(squared, len(state.p_x), [state.p_x, total], device=device)
        wp.launch(halved, 1, [total, value], device=device)

    functional = make(WarpObjective(program, 0.125, POINTS))
    first, again = (functional.value_and_gradient(functional.start)[1] for _ in range(2))
    np.testing.assert_array_equal(again, first)
    assert np.abs(first).max() > 0


def test_a_warp_objective_that_launches_nothing_is_refused(make):
    functional = make(WarpObjective(lambda state, value: None, 0.125))
    with pytest.raises(ValueError, match="launched no kernel"):
        functional.value(functional.start)


@pytest.mark.parametrize("interrupted", ["record_forward", "record_backward"])
def test_an_interrupted_capture_is_repeated(make, monkeypatch, interrupted):
    """A stiffer fluid asks for other solves; interrupted there, the next evaluation captures them anew."""
    fluid = Fluid(viscosity=0.01, diffusion_tolerance=1e-4)
    functional = make(MISFIT, fluid, ["fluid.viscosity"])
    functional.value_and_gradient(functional.start)
    stiff = functional.start + np.log(300)

    def stop(loops):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(StepLoops, interrupted, stop)
        with pytest.raises(KeyboardInterrupt):
            functional.value_and_gradient(stiff)
    found, expected = functional.value_and_gradient(stiff), make(MISFIT, fluid, ["fluid.viscosity"])
    value, gradient = expected.value_and_gradient(stiff)
    assert found[0] == value
    np.testing.assert_array_equal(found[1], gradient)


def test_with_frozen_parts_the_tolerance_of_solves_is_lowered_for_gradients(make):
    """Conjugate gradients are their own transpose only as far as they go: here to 1e-4 at least."""
    freeze = Freeze((np.arange(17) > 11)[None, :] * np.ones((12, 1)))
    functional = make(MISFIT, Fluid(viscosity=0.01, freeze=freeze))
    diffusion, projection, *_ = functional._recording.loops.methods
    assert projection.name == "conjugate gradients" and projection.tolerance <= 1e-4
    assert diffusion.name != "conjugate gradients" or diffusion.tolerance <= 1e-4
