"""Stokes-Brinkman flow: against a dense solve of the saddle point, symmetric, and quick in any medium."""

import numpy as np
import pytest
import scipy.sparse as sparse
from oracles import divergence, stress_matrix
from viscous_media import MEDIA, WALLS, frozen, media

from wfluid import Fluid
from wfluid.domain.grid import Grid
from wfluid.fields.arrays import from_numpy, to_numpy, vector
from wfluid.solve.stokes import StokesFlow
from wfluid.step.coefficients import Coefficients

DT = 20.0
"""Long beside the time that viscosity takes: what is left of inertia is a drag of 1/20 s."""


def flow_in(grid, mu, alpha, walls, device, tolerance=1e-11):
    """The solver in a medium, and its layout."""
    fluid = Fluid(viscosity=mu, freeze=frozen(alpha), walls=walls)
    medium = Coefficients(grid, fluid, device)
    medium.set_time(0.0, DT)
    medium.coarsen()
    flow = StokesFlow(medium.levels, (grid.width, grid.height), fluid.boundary, device)
    bounds = medium.stiffness(DT)
    flow.plan(DT, bounds.least, bounds.jump, bounds.least_row, tolerance)
    flow.update_coefficients()
    return flow


def noise(flow, seed):
    """A vector of noise, 0 on walls."""
    layout, rng = flow.layout, np.random.default_rng(seed)
    out = vector(layout, flow.device, 2)
    for f in out:
        from_numpy(rng.standard_normal((layout.ny, layout.nx)), f, layout)
    flow.fill(out)
    return out


def dense_flow(grid, mu, alpha, walls, b):
    """The velocity of A v + G q = b, D v = 0, from one dense matrix; D by differences of unit velocities."""
    words = walls.split(",")
    matrix, *free = stress_matrix(grid, mu, alpha, DT, (words[0], words[-1]))
    count, columns = matrix.shape[0], []
    for n in range(count):
        unit, faces = np.zeros(count), [np.zeros((grid.ny, grid.nx)) for _ in range(2)]
        unit[n] = 1.0
        split = free[0].sum()
        faces[0][free[0]], faces[1][free[1]] = unit[:split], unit[split:]
        u = np.concatenate([faces[0], faces[0][:, :1] * (words[0] == "periodic")], axis=1)
        v = np.concatenate([faces[1], faces[1][:1] * (words[-1] == "periodic")], axis=0)
        columns.append(divergence(grid, u, v).ravel())
    d = np.stack(columns, axis=1)
    saddle = sparse.bmat([[matrix, d.T], [d, None]]).toarray()
    load = np.concatenate([np.concatenate([f[where] for f, where in zip(b, free, strict=True)]), 0 * d[:, 0]])
    return np.linalg.lstsq(saddle, load, rcond=1e-13)[0][:count], free


@pytest.mark.float64
@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", MEDIA)
def test_flow_equals_a_dense_saddle_point_solve(device, name, walls):
    """To 1e-7 of the flow: the tolerance 1e-11 is in the norm of A, whose condition is up to 1e8."""
    grid = Grid(12, 9, 1.0, 0.7)
    mu, alpha = media(grid)[name]
    flow = flow_in(grid, mu, alpha, walls, device)
    b, v = noise(flow, 1), vector(flow.layout, device, 2)
    flow.solve(b, v)
    expected, free = dense_flow(grid, mu, alpha, walls, [to_numpy(f, flow.layout) for f in b])
    got = np.concatenate([to_numpy(f, flow.layout)[where] for f, where in zip(v, free, strict=True)])
    np.testing.assert_allclose(got, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.float64
@pytest.mark.parametrize("name", MEDIA)
def test_flow_is_symmetric_and_without_divergence(device, name):
    """<p, S q> = <S p, q> to the tolerance; div S q = 0 to rounding of the projections."""
    grid = Grid(23, 17, 1.0, 0.7)
    flow = flow_in(grid, *media(grid)[name], "no-slip,periodic", device)
    p, q = noise(flow, 1), noise(flow, 2)
    sp, sq = vector(flow.layout, device, 2), vector(flow.layout, device, 2)
    flow.solve(p, sp)
    flow.solve(q, sq)
    left, right, size = (
        sum(np.sum(to_numpy(f, flow.layout) * to_numpy(g, flow.layout)) for f, g in zip(a, b, strict=True))
        for a, b in ((p, sq), (sp, q), (sq, sq))
    )
    assert abs(left - right) < 1e-8 * abs(left)
    left_over = to_numpy(flow.divergence_of(sq), flow.layout)
    assert np.abs(left_over).max() * min(grid.hx, grid.hy) < 1e-5 * np.sqrt(size / (23 * 17))


@pytest.mark.parametrize("name, most", [("constant", 6), ("smooth", 20), ("jump 1e2", 40), ("drag", 40)])
def test_iterations_hardly_depend_on_the_grid(device, name, most):
    """To 1e-3, on 32 and on 128 cells: with equal weights in the projection a jump of 1e2 takes hundreds."""
    for n in (32, 128):
        grid = Grid(n, n, 1.0, 1.0)
        flow = flow_in(grid, *media(grid)[name], "free-slip", device, 1e-3)
        x, y = (np.arange(n) + 0.5) / n, ((np.arange(n) + 0.5) / n)[:, None]
        b, v = vector(flow.layout, device, 2), vector(flow.layout, device, 2)
        from_numpy(np.exp(-((x - 0.4) ** 2 + (y - 0.5) ** 2) / 0.005), b[0], flow.layout)
        flow.fill(b)
        flow.solve(b, v)
        assert flow.measure().iterations <= most
