"""The scheme "paper" is Stable Fluids as in Bonilla & Velho, section II, to rounding."""

import re
import warnings

import numpy as np
import pytest
from stable_fluids import StableFluids
from wfluid.kernels.cell.real import PRECISION

from wfluid.animation.animation import Animation
from wfluid.animation.simulation import PoorSolveWarning
from wfluid.domain.envelopes import Constant
from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.gradient.functional import _check_solves
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.pictures.picture import Picture
from wfluid.step.march import march

GRID = Grid(26, 20, 1.0, 0.7)
DT = 0.04
ROUNDING = {"float32": 2e-6, "float64": 1e-14}[PRECISION]
"""Of the largest value: some ten units in the last place."""

FORCES = [
    GaussianForce((0.3, 0.2), (9.0, -4.0), 0.06, Constant(0.0, 10.0)),
    GaussianForce((0.9, 0.6), (-5.0, 3.0), 0.05, Constant(0.0, 10.0)),
]
"""The first reaches 0.36 longer sides far: on a periodic axis its images count up to there."""

X, Y = (np.arange(26) + 0.5) * GRID.hx, (np.arange(20)[:, None] + 0.5) * GRID.hy
EDGE = np.where(np.hypot(X - 0.4, Y - 0.3) < 0.15, 0.5, 0.001)
"""A disc 500 times as viscous as what is around it."""


def gained(forces, periodic):
    """What forces add to u and v in a step, summed over the nearest images."""
    u, v = np.zeros((20, 27)), np.zeros((21, 26))
    places = (np.arange(27) * GRID.hx, Y), (X, np.arange(21)[:, None] * GRID.hy)
    for force in forces:
        for f, (x, y), strength in zip((u, v), places, force.vector, strict=True):
            for n in (-1, 0, 1) if periodic[0] else (0,):
                for m in (-1, 0, 1) if periodic[1] else (0,):
                    dx, dy = x - force.center[0] - n * GRID.width, y - force.center[1] - m * GRID.height
                    f += DT * strength * np.exp(-(dx**2 + dy**2) / (2 * force.radius**2))
    return u, v


def after(make_solver, steps, forces=FORCES, **fluid):
    """The state after so many steps in the scheme "paper"."""
    solver = make_solver(26, 20, grid=GRID, scheme="paper", **fluid)

    def advance(state_in, state_out, step):
        solver.step(state_in, state_out, forces, step * DT, DT)

    *_, (state, _) = march(solver.rest(), solver.rest(), range(steps), advance)
    return state


def assert_equal(state, u, v, d, rounding=ROUNDING):
    for got, expected in zip((*state.velocity, *state.displacement), (u, v, *d), strict=True):
        size = np.abs(expected).max()
        assert size > 1e-3
        np.testing.assert_allclose(got, expected, rtol=0, atol=rounding * size)


@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic", "periodic,no-slip"])
@pytest.mark.parametrize("mu", [0.005, 0.3, EDGE], ids=["thin", "thick", "painted"])
def test_a_run_is_that_of_stable_fluids_in_numpy(make_solver, walls, mu):
    """Eight steps with forces: velocities and map agree to rounding; the picture moves."""
    compare(make_solver, walls, mu)


@pytest.mark.float64
@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic", "periodic,no-slip"])
@pytest.mark.parametrize("mu", [0.005, EDGE], ids=["thin", "painted"])
def test_a_run_is_that_of_stable_fluids_in_double_precision(make_solver, walls, mu):
    compare(make_solver, walls, mu)


def compare(make_solver, walls, mu):
    """A run with the oracle's."""
    state = after(make_solver, 8, viscosity=mu, walls=walls, sweeps=30)
    names = walls.split(",")
    reference = StableFluids(26, 20, 1.0, 0.7, (names[0], names[-1]), mu, 30)
    added = gained(FORCES, [name == "periodic" for name in (names[0], names[-1])])
    for _ in range(8):
        reference.step(DT, added)
    assert np.abs(reference.d).max() > 0.9 * GRID.hx
    assert_equal(state, reference.u, reference.v, reference.d)


@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "free-slip,periodic"])
@pytest.mark.parametrize("mu", [0.005, 0.1])
def test_a_number_and_the_same_number_painted_move_the_picture_alike(make_solver, walls, mu):
    """To rounding, converged or not."""
    number = after(make_solver, 12, viscosity=mu, walls=walls, sweeps=20)
    painted = after(make_solver, 12, viscosity=Painted(np.full((5, 7), mu)), walls=walls, sweeps=20)
    assert_equal(painted, *number.velocity, number.displacement, rounding=2 * ROUNDING)


def test_contrast_does_not_make_the_sweeps_diverge(make_solver):
    """Undamped sweeps converge for any paint: each component's matrix is diagonally dominant."""
    paint = np.where(np.random.default_rng(4).random((20, 26)) < 0.5, 1e-6, 100.0)
    state = after(make_solver, 20, viscosity=Painted(paint), sweeps=200)
    assert max(np.abs(f).max() for f in state.velocity) < DT * 20 * 10.0


@pytest.mark.parametrize("painted", [False, True])
def test_sweeps_that_have_not_converged_are_reported(device, painted):
    """At mu = 0.1 fifty sweeps leave a third of the change, and the picture moves more than twice too far."""
    mu, reached = Painted(np.full((3, 4), 0.1)) if painted else 0.1, []
    for settings in ({}, {"solver": "multigrid"}):
        fluid = Fluid(viscosity=mu, scheme="paper", **settings)
        picture, size = Picture(np.zeros((6, 8, 3), np.float32)), {"cells": 128, "device": device.alias}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            frames = list(Animation(picture, fluid, FORCES[:1], Timeline(0.5, 12), **size).frames())
        reached.append(frames[-1].quality.displacement_max)
        poor = [str(w.message) for w in caught if w.category is PoorSolveWarning]
        if settings:
            assert poor == []
            continue
        (said,) = poor
        assert "scheme (--scheme) to standard" in said and "\n" not in said
        left = [float(number) for number in re.findall(r"left (\S+) of the div.* and (\S+) of the", said)[0]]
        solve = frames[1].solve
        assert left == pytest.approx([solve.pressure.relative, solve.diffusion.relative], rel=0.05)
        assert left[1] > 0.2
    assert reached[0] > 2 * reached[1]


def test_a_viscosity_that_moves_has_no_gradient_in_the_papers_scheme(device):
    """The gradient with respect to viscosity is that of the stress, which this scheme does not solve."""
    with pytest.raises(ValueError, match="set scheme to 'standard'"):
        _check_solves(Fluid(viscosity=Painted(EDGE), viscosity_moves=True, scheme="paper"), free=False)
