"""The gradient of a whole run is that of the value it computes: Taylor's remainder falls with h^2.

    R(h) = |f(m + h d) - f(m) - h g.d|    ->    log2 R(h) / R(h/2) = 2

whatever the number that varies, the medium, the walls, the scheme and the objective. A gradient that is
wrong by a part e leaves e h |g.d|, with which the rate falls to 1.

Steps: h is such that the remainder is about `REMAINDER` of the value. At h/2 it is 2e-12 of it, 1e4 eps: the
rounding of the last few bits of two values changes a rate by 1e-3. Nearly all such steps are 1e-5 to
1e-4, so that few traces cross from one cell into another.

There the interpolations change, which are polynomials piece by piece. Cubics join with their slopes, so that
the remainder stays of second order. Bilinear ones join with a kink, and the remainder of a trace that
crosses one is of first order in how far it goes beyond. In the standard scheme that is the velocity at the
middle of a trace, half a step from where it began: second order in the velocity, and as a part of the
value far below the remainder. In the paper's scheme it is everything; there a step is rejected if
some trace came to lie in another cell than without it. At most `REJECTED` of all steps may be.
"""

import re
from types import FunctionType

import numpy as np
import pytest
from control_cases import CASES, cells_of_traces

from wfluid import Keyed, Painted, Wall, Walls
from wfluid.gradient.objectives import Effort, ParticleFunction, ParticleMisfit, terms_of
from wfluid.gradient.state_objectives import DensityMisfit, MapMisfit, WarpObjective
from wfluid.gradient.variables import Setup, known_names
from wfluid.model.fluid import Fluid

pytestmark = pytest.mark.float64

DIRECTIONS = 5

REMAINDER = 1e-11
"""Of the value, at h."""

TRIAL = 1e-3
"""Step that h is found with, and the longest."""

REJECTED = 0.1
"""Part of the steps in the paper's scheme."""


class Remainders:
    """Taylor's remainders of a functional about where it starts."""

    def __init__(self, functional):
        self.functional, self.m = functional, functional.start
        self.value, self.gradient = functional.value_and_gradient(self.m)
        paper = functional._recording.step.fluid.scheme == "paper"
        self.cells = cells_of_traces(functional) if paper else None
        self.steps = self.rejected = 0

    def at(self, change, watch=True):
        """The remainder of a change; None where a trace changed its cell."""
        value = self.functional.value(self.m + change)
        if watch:
            self.steps += 1
            if self.cells is not None and np.any(cells_of_traces(self.functional) != self.cells):
                self.rejected += 1
                return None
        return abs(value - self.value - self.gradient @ change)

    def rates(self, entries, random):
        """With which power of the step they fall, for random directions of some entries."""
        rates, h = [], None
        for _ in range(DIRECTIONS):
            direction = np.zeros_like(self.m)
            noise = random.standard_normal(entries.stop - entries.start)
            direction[entries] = noise / np.abs(noise).max()
            if h is None:
                trial = self.at(TRIAL * direction, watch=False)
                h = TRIAL * min(1.0, np.sqrt(REMAINDER * abs(self.value) / trial))
            whole, half = self.at(h * direction), self.at(h / 2 * direction)
            if whole and half:
                rates.append(np.log2(whole / half))
        return rates


@pytest.mark.parametrize("name", CASES)
def test_the_remainder_falls_with_the_square_of_the_step(device, name):
    functional = CASES[name].functional(device)
    remainders, random, wrong = Remainders(functional), np.random.default_rng(len(name)), {}
    for one in functional.variables.slices:
        assert np.any(remainders.gradient[one.entries]), f"{one.name} has no gradient"
        rates = remainders.rates(one.entries, random)
        if not (len(rates) > DIRECTIONS / 2 and 1.9 < np.median(rates) < 2.1):
            wrong[one.name] = np.round(rates, 3).tolist()
    assert not wrong, wrong
    assert remainders.rejected <= REJECTED * remainders.steps, remainders.rejected


def test_the_cases_cover_every_kind():
    """Every number that may vary does so in some case; every objective, wall and kind of fluid is there."""
    varying, known, asked, walls, fluids = set(), set(), set(), [set(), set()], []
    for case in CASES.values():
        fluid = Fluid(**case.fluid)
        setup = Setup(fluid, tuple(case.forces), case.velocity)
        patterns = [re.escape(name).replace(r"\[\*\]", r"\[\d+\]") for name in case.names]
        for name in known_names(setup):
            known.add(kind_of(setup, name))
            if any(re.fullmatch(pattern, name) for pattern in patterns):
                varying.add(kind_of(setup, name))
        asked |= {type(term) for _, term in terms_of(case.objective)}
        for own, wall in zip(walls, (fluid.walls.x, fluid.walls.y), strict=True):
            own.add(wall)
        fluids.append(fluid)
    assert known == varying
    assert asked == {ParticleMisfit, ParticleFunction, MapMisfit, DensityMisfit, Effort, WarpObjective}
    assert walls == [set(Wall), set(Wall)] and any(fluid.walls == Walls() for fluid in fluids)
    for name in ("viscosity_moves", "freeze", "densities"):
        assert any(getattr(fluid, name) for fluid in fluids)
    schemes = {(fluid.scheme, fluid.solver) for fluid in fluids}
    assert schemes == {("standard", "multigrid"), ("standard", "jacobi"), ("paper", "jacobi")}
    assert {type(fluid.viscosity) for fluid in fluids} == {float, Painted, Keyed, FunctionType}
    assert any(case.capped for case in CASES.values())


@pytest.mark.parametrize("name", [name for name in CASES if "paper" in name])
def test_feet_that_move_to_other_cells_are_noticed(device, name):
    """What the rejection of steps relies on: the same run lies in the same cells, one that is far off not."""
    functional = CASES[name].functional(device)
    remainders, noise = Remainders(functional), np.random.default_rng(0)
    assert remainders.at(np.zeros_like(remainders.m)) == 0 == remainders.rejected
    velocity = functional.variables.slices[-1]
    assert velocity.name == "velocity"
    far = np.zeros_like(remainders.m)
    far[velocity.entries] = 0.1 * noise.standard_normal(velocity.entries.stop - velocity.entries.start)
    assert remainders.at(far) is None and remainders.rejected == 1


def kind_of(setup, name):
    """What a number belongs to, and what it is there: a `Path`'s places, a painted viscosity."""
    owner, _, last = name.rpartition(".")
    return type(setup.number(owner)) if owner else None, last, type(setup.number(name))
