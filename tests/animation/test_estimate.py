"""The memory that is estimated before a run holds the arrays that the run allocates."""

import gc

import numpy as np
import pytest
import warp as wp

from wfluid.animation.animation import Animation
from wfluid.animation.estimate import COUPLED_FIELDS, DENSITY_FIELDS, FIELDS
from wfluid.animation.simulation import Simulation
from wfluid.domain.envelopes import Constant
from wfluid.domain.timeline import Timeline
from wfluid.model.densities import Density
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.pictures.picture import Picture

CELLS = 128
RAMP = Painted(np.linspace(0, 1, CELLS)[None] * np.ones((CELLS, 1)), scale=0.01, floor=1e-3)


@pytest.mark.parametrize(
    ("fluid", "fields"),
    [
        (Fluid(viscosity=0.01), FIELDS),
        (Fluid(viscosity=RAMP), COUPLED_FIELDS),
        (Fluid(viscosity=0.01, walls="no-slip"), COUPLED_FIELDS),
        (Fluid(viscosity=0.01, densities=[Density("ink", diffusion=1e-3)]), FIELDS + DENSITY_FIELDS),
    ],
    ids=["constant viscosity", "painted viscosity", "no-slip walls", "a density"],
)
def test_the_fields_that_are_counted_hold_those_of_a_solver(device, fluid, fields):
    """The allocated arrays are 0.6 … 1 of the count, which includes copies on the host."""
    known = {id(a) for a in gc.get_objects() if isinstance(a, wp.array)}
    force = GaussianForce((0.5, 0.5), (1.0, 0.0), 0.1, Constant(0, 1))
    picture = Picture(np.zeros((CELLS, CELLS, 3), np.float32))
    animation = Animation(picture, fluid, [force], Timeline(0.1, 10), cells=CELLS, device=device.alias)
    simulation = Simulation(animation.solver, animation.timeline)
    list(simulation.moments([force], 1))
    made = [a for a in gc.get_objects() if isinstance(a, wp.array) and id(a) not in known and a.ptr]
    size = sum({a.ptr: a.capacity for a in made}.values()) / (4 * CELLS * CELLS)
    assert 0.6 * fields < size < fields, (size, fields)
