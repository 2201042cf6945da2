"""The pressure that a step keeps of the step before: as much as its own length makes of it, or none.

The pressure of a step of dt is q = dt p [longer side^2/s], p the fluid's own. The next step, of dt', begins
with dt' p = dt' / dt q, as long as p goes on: not from a step with prescribed divergence, nor into one.
"""

import numpy as np
import pytest
import scipy.sparse as sparse
from oracles import divergence, stress_matrix
from scipy.sparse.linalg import spsolve
from viscous_media import centres

from wfluid import Constant, GaussianForce, Grid, Growth, ImageForce
from wfluid.fields.arrays import to_numpy

GRID = Grid(22, 17, 1.0, 0.7)
X, Y = centres(GRID)
SOFT = 0.002 + 0.06 * np.exp(-((X - 0.55) ** 2 + (Y - 0.35) ** 2) / 0.02)
"""A viscosity without symmetry."""

EXACT = {"viscosity": SOFT, "walls": "free-slip", "diffusion_tolerance": 1e-6, "pressure_cycles": 10}


def run(solver, state, spare, forces, steps, dt, t=0.0):
    """The state after so many steps, the one to write next, and the time."""
    for n in range(steps):
        solver.step(state, spare, forces, t + n * dt, dt)
        state, spare = spare, state
    return state, spare, t + steps * dt


@pytest.mark.parametrize("factor", [0.25, 0.5, 1.0])
def test_a_fluid_that_pressure_holds_stays_still_when_the_steps_change(make_solver, factor):
    """Under the force grad phi it is p = phi that holds the fluid, whatever the viscosity and the step.

    What a step adds is less than a thousandth of what the force alone would give in 0.04 s.
    """
    slope = ImageForce(1 + np.sin(3 * X + 1) * np.cos(4 * Y), "gradient", 2.0, radius=0)
    solver, dt = make_solver(GRID.nx, GRID.ny, grid=GRID, **EXACT), 0.04
    state, spare, t = run(solver, solver.rest(), solver.rest(), [slope], 60, dt)
    before = state.velocity
    after, _, _ = run(solver, state, spare, [slope], 1, factor * dt, t)
    changed = max(np.abs(f - g).max() for f, g in zip(after.velocity, before, strict=True))
    assert changed < 1e-3 * 2.0 * dt, changed / (2.0 * dt)


def matrices():
    """Divergence at centres, and minus its transpose, the gradient: over free faces, u row by row, then v."""
    nx, ny = GRID.nx, GRID.ny
    along = [
        sparse.diags_array([np.ones(n - 1), -np.ones(n - 1)], offsets=[0, -1], shape=(n, n - 1)) / h
        for n, h in ((nx, GRID.hx), (ny, GRID.hy))
    ]
    of_u, of_v = (
        sparse.kron(sparse.eye_array(ny), along[0]),
        sparse.kron(along[1], sparse.eye_array(nx)),
    )
    return sparse.csc_array(sparse.hstack([of_u, of_v]))


def free(u, v):
    """The free faces of a velocity: those on no wall."""
    return np.concatenate([u[:, 1:-1].ravel(), v[1:-1].ravel()])


def stepped(velocity, q, kept, dt, s):
    """A step without advection, by direct solves: diffusion of v - kept grad q, then div v' = s."""
    d = matrices()
    matrix, _, _ = stress_matrix(GRID, SOFT, np.zeros_like(SOFT), dt, ("free-slip", "free-slip"))
    v = spsolve(matrix, velocity + kept * d.T @ q.ravel())
    laplacian = sparse.lil_array(d @ d.T)
    right = d @ v - s.ravel()
    laplacian[0], right[0] = 0, 0
    laplacian[0, 0] = 1  # the pressure's own constant
    return v - d.T @ spsolve(sparse.csc_array(laplacian), right)


PUSH = GaussianForce((0.5, 0.3), (2e-3, -1e-3), 0.15, Constant(0.0, 0.08))
GROWTH = Growth((0.4, 0.4), 2e-3, 0.15, Constant(0.0, 0.08))
LATER = Growth((0.4, 0.4), 2e-3, 0.15, Constant(0.08, 0.2))
"""So weak that a flow carries itself by a millionth of its size in a step."""


@pytest.mark.parametrize(
    ("forces", "next_dt", "part"),
    [
        ([PUSH], 0.04, 1.0),
        ([PUSH], 0.01, 0.25),
        ([PUSH], 0.1, 1.0),
        ([PUSH, GROWTH], 0.04, 0.0),
        ([PUSH, GROWTH], 0.01, 0.0),
        ([PUSH, LATER], 0.04, 0.0),
    ],
    ids=["as long", "shorter", "longer", "after a growth", "after a growth, shorter", "into a growth"],
)
def test_a_step_keeps_of_the_pressure_what_belongs_to_it(make_solver, forces, next_dt, part):
    """Against direct solves, and far from what another part of the pressure would give.

    Where the next step is longer all of the pressure is kept, and no more.
    """
    solver = make_solver(GRID.nx, GRID.ny, grid=GRID, **EXACT)
    state, spare, t = run(solver, solver.rest(), solver.rest(), forces, 2, 0.04)
    before, q = free(*state.velocity), to_numpy(state.q, solver.layout)
    after, _, _ = run(solver, state, spare, forces, 1, next_dt, t)
    got, s = free(*after.velocity), divergence(GRID, *after.velocity)
    expected, other = (stepped(before, q, kept, next_dt, s) for kept in (part, 1.0 if part < 1 else 0.5))
    size = np.abs(before).max()
    error, apart = np.abs(got - expected).max() / size, np.abs(other - expected).max() / size
    assert error < 2e-5 and apart > 2e-3, (error, apart)
