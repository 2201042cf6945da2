"""What cannot be optimised is refused at once, in one clear line that says what would do."""

import math
import re

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.real import Real

from wfluid import Density, Fluid, GaussianForce, Grid, Keyed, Painted, Source, Timeline, VortexForce
from wfluid.gradient.functional import Functional
from wfluid.gradient.objectives import Effort, Objective, ParticleFunction, ParticleMisfit, Sum
from wfluid.gradient.state_objectives import DensityMisfit, MapMisfit, WarpObjective
from wfluid.gradient.variables import Free
from wfluid.model.densities import PaintedSource

GRID = Grid(13, 10, 1.0, 0.7)
TIMELINE = Timeline(0.125, fps=24, substeps=2)
"""Six steps of 1/48 s."""

SURE = {"diffusion_tolerance": 1e-6}
POINT = [(0.4, 0.3)]


def at(time):
    return ParticleMisfit(POINT, [(0.5, 0.3)], time)


@pytest.fixture
def make(request):
    """A functional; by default of a push's vector, for one particle at the end."""
    device = request.config.getoption("--device")

    def build(objective=None, free=("forces[0].vector",), forces=None, fluid=None, **more):
        objective = at(0.125) if objective is None else objective
        forces = [GaussianForce((0.4, 0.4), (1.0, 0.5), 0.1)] if forces is None else forces
        free = [Free(one) if isinstance(one, str) else one for one in free]
        fluid = Fluid(**(fluid or {}))
        return Functional(GRID, fluid, forces, TIMELINE, objective, free, device=device, **more)

    return build


def refuses(message, build, *arguments, error=ValueError, **more):
    """It raises the error with one line that contains the message."""
    with pytest.raises(error, match=re.escape(message)) as caught:
        build(*arguments, **more)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_run_that_is_in_order_is_not_refused(make):
    """What the other tests change one thing of."""
    functional = make(at(0.125) + at(1 / 48) + Effort())
    value, gradient = functional.value_and_gradient(functional.start)
    assert np.isfinite(value) and gradient.shape == (2,)


@pytest.mark.parametrize("time", [0.0, -0.1, 0.126, 7.0, math.nan, math.inf])
def test_an_objective_outside_the_run_is_refused_with_the_end_of_the_run(make, time):
    refuses(f"an objective at {time:g} s: expected a time after 0 and up to 0.125 s", make, at(time))


def test_an_objective_between_steps_is_refused_with_the_nearest_steps(make):
    for time in (0.05, 0.001):
        step = int(time * 48)
        beside = f"between steps, at {step / 48:.6g} s and {(step + 1) / 48:.6g} s"
        assert "fps and substeps" in refuses(beside, make, at(time))
    for objective in (
        MapMisfit(np.zeros((2, 10, 13)), 0.05),
        WarpObjective(print, 0.05),
        ParticleFunction(POINT, print, (1 / 48, 0.05)),
        2.0 * at(0.05) + Effort(),
    ):
        refuses("falls between steps", make, objective)


def test_times_within_rounding_of_a_step_are_that_step(make):
    make(at(3 / 48 * (1 + 1e-12)) + at(0.125 * (1 + 1e-10)))


def test_nothing_free_is_refused(make):
    refuses("nothing is free", make, free=())
    refuses("nothing is free", make, free=[Free("forces[0].vector", parts=[False, False])])


NAMES = [
    "forces[0].vector", "forces[0].radius", "forces[0].center", "forces[1].spin", "forces[1].radius",
    "fluid.densities[0].sources[0].rate", "fluid.densities[0].sources[0].center",
    "fluid.viscosity", "velocity",
]  # fmt: skip


@pytest.mark.parametrize(
    "name", ["force[0].vector", "forces[2].vector", "forces[0].spin", "forces", "fluid.sweeps", "", "[*]"]
)
def test_an_unknown_name_is_refused_with_all_names(make, name):
    forces = [GaussianForce((0.4, 0.4), (1.0, 0.5), 0.1), VortexForce((0.6, 0.2), 3.0, 0.1)]
    ink = Density(sources=[Source((0.5, 0.2), 1.0, 0.1), PaintedSource(Painted(np.eye(3)))])
    message = refuses(
        f"{name} cannot vary here", make, free=[name], forces=forces, fluid={"densities": [ink]}
    )
    for known in NAMES:
        assert known in message


def test_a_name_twice_is_refused(make):
    refuses("forces[0].vector is free twice", make, free=["forces[0].vector", "forces[0].vector"])
    refuses("forces[0].center is free twice", make, free=["forces[*].center", "forces[0].center"])


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan, math.inf])
def test_a_scale_that_is_not_positive_is_refused(scale):
    refuses("scale of velocity", Free, "velocity", scale)


def test_a_mask_of_another_shape_is_refused(make):
    refuses("parts of shape (3,), expected (2,)", make, free=[Free("forces[0].vector", parts=[True] * 3)])


def test_memory_too_small_names_the_least_that_works(make):
    refused = refuses("6 steps on 13 x 10 cells need at least ", make, memory_mb=0.01)
    least = float(refused.rpartition(" ")[2])
    functional = make(memory_mb=least)
    assert np.isfinite(functional.value(functional.start))
    assert functional.memory <= least * 2**20
    refuses(f"need at least {least:g}", make, memory_mb=least - 0.01)


def test_memory_too_small_for_objectives_during_the_run_names_the_least_that_works(make):
    """Objectives that look at the fluid cut the run into segments: two more rooms for stored states."""
    objective = MapMisfit(np.zeros((2, 10, 13)), 1 / 48) + MapMisfit(np.zeros((2, 10, 13)), 5 / 48)
    refused = refuses("need at least ", make, objective, memory_mb=0.01)
    least = float(refused.rpartition(" ")[2])
    functional = make(objective, memory_mb=least)
    assert np.isfinite(functional.value_and_gradient(functional.start)[0])
    refuses("need at least ", make, objective, memory_mb=least - 0.01)


@pytest.mark.parametrize("ask", ["value", "value_and_gradient", "setup"])
def test_controls_of_another_length_or_not_finite_are_refused(make, ask):
    functional = make(free=["forces[0].radius", "forces[0].vector"])
    evaluate = getattr(functional, ask)
    for wrong in (np.zeros(2), np.zeros(4), np.zeros((3, 1)), 1.0):
        refuses(f"controls of shape {np.shape(wrong)}: expected (3,)", evaluate, wrong)
    for bad in (math.nan, math.inf):
        refuses(
            "controls: forces[0].vector is not finite", evaluate, functional.start + np.array([0, 0, bad])
        )
        refuses(
            "controls: forces[0].radius is not finite", evaluate, functional.start + np.array([bad, 0, 0])
        )


def test_controls_that_a_force_refuses_are_refused_and_the_next_are_not(make):
    functional = make(free=["forces[0].radius", "forces[0].vector"])
    before = functional.value(functional.start)
    refuses("the limit is 10000", functional.value, functional.start + np.array([0, 1e5, 0]))
    refuses("GaussianForce.radius", functional.value, functional.start + np.array([50, 0, 0]))
    assert functional.value(functional.start) == before


PAINT = np.linspace(0.01, 0.03, 130).reshape(10, 13)


def test_a_free_viscosity_needs_a_diffusion_solved_to_a_tolerance(make):
    free = ["fluid.viscosity"]
    for viscosity in (0.01, PAINT):
        settings = {"viscosity": viscosity}
        fluid = {"solver": "jacobi", **SURE, **settings}
        refuses("a free viscosity needs", make, free=free, fluid=fluid)
        refuses("set solver to 'multigrid'", make, free=free, fluid=fluid)
        refuses("set diffusion_tolerance to 0.0001 or less, not 0.007", make, free=free, fluid=settings)
        make(fluid=settings)
        make(fluid={"solver": "jacobi", **settings})


def test_a_viscosity_that_moves_needs_the_same_tolerance(make):
    moves = {"viscosity": PAINT, "viscosity_moves": True}
    refuses("set diffusion_tolerance to 0.0001 or less, not 0.007", make, fluid=moves)
    refuses("a viscosity that moves needs", make, fluid={"solver": "jacobi", **moves})
    make(fluid={**SURE, **moves})


def test_a_free_viscosity_of_zero_is_refused(make):
    holes = np.where(PAINT > 0.02, PAINT, 0.0)
    for viscosity in (0.0, holes):
        fluid = {"viscosity": viscosity, **SURE}
        refuses("fluid.viscosity begins at 0", make, free=["fluid.viscosity"], fluid=fluid)
    some = Free("fluid.viscosity", parts=holes > 0)
    assert make(free=[some], fluid={"viscosity": holes, **SURE}).start.size == np.sum(holes > 0)


@pytest.mark.parametrize(
    "viscosity", [lambda t: 0.01 + t, Keyed({0.0: 0.01, 0.1: 0.02})], ids=["function", "keys"]
)
def test_a_viscosity_that_depends_on_the_time_cannot_vary(make, viscosity):
    """It may be there."""
    fluid = {"viscosity": viscosity, **SURE}
    refuses("fluid.viscosity cannot vary here", make, free=["fluid.viscosity"], fluid=fluid)
    functional = make(fluid=fluid)
    assert np.isfinite(functional.value(functional.start))


def test_a_viscosity_that_turns_negative_is_refused_at_once(make):
    viscosity = {"viscosity": lambda t: 0.05 - t}
    refuses("viscosity at 0.0625 s", make, fluid=viscosity)


@pytest.mark.parametrize("point", [(-0.01, 0.3), (1.01, 0.3), (0.4, -0.01), (0.4, 0.71)], ids=str)
def test_particles_outside_the_picture_are_refused(make, point):
    message = "particles must begin within the picture"
    refuses(message, make, ParticleMisfit([*POINT, point], np.zeros((2, 2)), 0.125))
    refuses(message, make, at(0.125) + WarpObjective(print, 0.125, [point]))
    make(ParticleMisfit([(0.0, 0.0), (1.0, 0.7)], np.zeros((2, 2)), 0.125))


@pytest.mark.parametrize("points", [[(math.nan, 0.3)], [(0.4, math.inf)]], ids=str)
def test_particles_at_positions_not_finite_are_refused(points):
    refuses("points: a number is not finite", ParticleMisfit, points, POINT, 0.125)
    refuses("points: a number is not finite", ParticleFunction, points, print, [0.125])


def test_objectives_that_do_not_fit_are_refused(make):
    refuses("1 points and 2 destinations", ParticleMisfit, POINT, np.zeros((2, 2)), 0.125)
    refuses("weights of particles", ParticleMisfit, POINT, POINT, 0.125, weights=[-1.0])
    refuses("one time or more", ParticleFunction, POINT, print, ())
    refuses("weight is nan", lambda: math.nan * Effort())
    refuses("weight is inf", Sum, ((math.inf, Effort()),))
    refuses("MapMisfit.target of shape (10, 13): expected (2, 10, 13)", make, MapMisfit(PAINT, 0.125))
    target = np.full((2, 10, 13), math.nan)
    refuses("MapMisfit.target: a number is not finite", make, MapMisfit(target, 0.125))
    fluid = {"densities": [Density("ink"), Density("smoke")]}
    refuses(
        "DensityMisfit of 'tea': expected one of the fluid's (ink, smoke)",
        make,
        DensityMisfit("tea", PAINT, 0.125),
        fluid=fluid,
    )
    refuses("expected (10, 13)", make, DensityMisfit("ink", PAINT.T, 0.125), fluid=fluid)


def test_an_objective_that_no_run_has_is_refused(make):
    class Beauty(Objective):
        pass

    refuses("Beauty is no objective", make, Effort() + Beauty(), error=TypeError)


def test_a_velocity_that_does_not_fit_the_grid_is_refused(make):
    refuses("velocity of shape (2, 13, 10)", make, velocity=np.zeros((2, 13, 10)))
    refuses("expected finite numbers", make, velocity=np.full((2, 10, 13), math.inf))


def test_a_gradient_of_another_shape_than_the_particles_is_refused(make):
    functional = make(ParticleFunction(POINT, lambda t, x: (0.0, np.zeros(3)), [0.125]))
    message = "a gradient of shape (3,) for particles of shape (1, 2)"
    refuses(message, functional.value, functional.start)


@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
@pytest.mark.parametrize(
    "objective", [at(0.125), MapMisfit(np.zeros((2, 10, 13)), 0.125)], ids=["particle", "map"]
)
def test_overflow_is_reported_with_its_first_step(make, objective):
    """Walls stop a particle and a foot wherever they go, so the objective alone would not tell."""
    functional = make(objective, ["velocity"])
    assert np.isfinite(functional.value(functional.start))
    noise = np.random.default_rng(0).standard_normal(functional.start.shape)
    begins = "the fluid is not finite from step 0 (0 s) on"
    for much in (1e37, 1e39):  # the velocity itself is finite in single precision, or is not
        refuses(begins, functional.value, much * noise, error=FloatingPointError)
        refuses(begins, functional.value_and_gradient, much * noise, error=FloatingPointError)
    assert np.isfinite(functional.value(functional.start))


@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
@pytest.mark.parametrize("memory_mb", [None, 0.0])
def test_overflow_of_a_density_is_reported_with_its_first_step(make, memory_mb):
    """A density that a source raises beyond what single precision holds, in the fourth step."""
    late = Source((0.5, 0.3), 1e6, 0.1, envelope=Late())
    ink = Density(sources=[late])
    objective = DensityMisfit("ink", PAINT, 0.125)
    if memory_mb is not None:
        refused = refuses("need at least", make, objective, fluid={"densities": [ink]}, memory_mb=0.01)
        memory_mb = float(refused.rpartition(" ")[2])
    functional = make(objective, fluid={"densities": [ink]}, memory_mb=memory_mb)
    message = "the fluid is not finite from step 3 (0.0625 s) on"
    refuses(message, functional.value, functional.start, error=FloatingPointError)


class Late(GaussianForce.__dataclass_fields__["envelope"].default_factory):
    """A course that is beyond all bounds in the fourth step."""

    def integral(self, start, end):
        return 1e38 if start <= 3.5 / 48 < end else 0.0


@wp.kernel(module="tests.refusals")
def logarithm_of_0(value: wp.array[Real]):
    value[0] = wp.log(Real(0.0))


def test_an_objective_that_is_not_finite_although_the_fluid_is_says_so(make):
    """A function of particles, and one of Warp."""
    for objective in (
        ParticleFunction(POINT, lambda t, x: (math.nan, np.zeros_like(x)), [0.125]),
        WarpObjective(lambda state, value: wp.launch(logarithm_of_0, 1, [value], device=value.device), 0.125),
    ):
        functional = make(objective)
        refuses(
            "the objective is not finite",
            functional.value_and_gradient,
            functional.start,
            error=FloatingPointError,
        )


@pytest.mark.parametrize("step", [1, 4, 6])
@pytest.mark.parametrize("capped", [False, True])
def test_a_gradient_that_is_not_finite_is_reported_with_its_step(make, step, capped):
    """A function of particles whose gradient is none: going back, the step to its time is the first."""
    wrong = ParticleFunction(POINT, lambda t, x: (1.0, np.full_like(x, math.nan)), [step / 48])
    memory_mb = None
    if capped:
        refused = refuses("need at least", make, wrong, memory_mb=0.01)
        memory_mb = float(refused.rpartition(" ")[2])
    functional = make(wrong + Effort(), ["velocity", "forces[0].vector"], memory_mb=memory_mb)
    assert np.isfinite(functional.value(functional.start))
    message = f"the gradient is not finite from step {step - 1} ({(step - 1) / 48:.4g} s) backward"
    refuses(message, functional.value_and_gradient, functional.start, error=FloatingPointError)
