"""The equations of variable viscosity and drag: their operators and solves, against matrices from SciPy."""

import numpy as np
import pytest
import warp as wp
from oracles import divergence, noise_velocity, stress_matrix
from viscous_media import DT, MEDIA, WALLS, centres, coupled, frozen, media, random_vector

from wfluid import Fluid
from wfluid.domain.grid import Grid
from wfluid.fields.arrays import to_numpy, vector
from wfluid.solve.system import SolveMethod
from wfluid.step.diffusion import CoupledDiffusion, SeparateDiffusion


def unknowns(v, layout, free):
    """The values of a vector on the free faces: u row by row, then v."""
    return np.concatenate([to_numpy(f, layout)[where] for f, where in zip(v, free, strict=True)])


def names(walls):
    """The names of the walls for x and y."""
    words = walls.split(",")
    return words[0], words[-1]


@pytest.mark.float64
@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", MEDIA)
@pytest.mark.parametrize("size", [(17, 13), (12, 20)], ids=str)
def test_operator_and_solve_equal_a_separately_assembled_matrix(device, name, walls, size):
    """The matrix is SciPy's, assembled from the strain energy; it is symmetric and positive definite."""
    from scipy.sparse.linalg import spsolve

    grid = Grid(*size, size[0] / max(size), 0.93 * size[1] / max(size))
    mu, alpha = media(grid)[name]
    diffusion = coupled(grid, mu, alpha, walls, device)
    matrix, *free = stress_matrix(grid, mu, alpha, DT, names(walls))
    assert abs(matrix - matrix.T).max() < 1e-12 * abs(matrix).max()
    assert np.linalg.eigvalsh(matrix.toarray()).min() > 1 - 1e-9

    system, layout = diffusion.system, diffusion.layout
    b, x = random_vector(diffusion, 0), vector(layout, device, 2)
    system.levels[0].residual(system.zero, b, x)
    got, expected = -unknowns(x, layout, free), matrix @ unknowns(b, layout, free)
    np.testing.assert_allclose(got, expected, atol=1e-12 * np.abs(expected).max())

    how = SolveMethod("conjugate gradients", 200, 1e-11)
    system.solve(how, b, x)
    exact = spsolve(matrix, unknowns(b, layout, free))
    np.testing.assert_allclose(unknowns(x, layout, free), exact, atol=1e-8 * np.abs(exact).max())
    assert system.measure(how, b, x, 1.0).iterations < 60


@pytest.mark.float64
@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("name", MEDIA)
def test_fixed_cycles_are_a_symmetric_operator(device, name, walls):
    """<p, M q> = <M p, q> to rounding, converged or not, for any medium; sweeps likewise."""
    grid = Grid(23, 17, 1.0, 0.7)
    diffusion = coupled(grid, *media(grid)[name], walls, device)
    system, layout = diffusion.system, diffusion.layout
    p, q = random_vector(diffusion, 1), random_vector(diffusion, 2)
    for how in (SolveMethod("multigrid", 1), SolveMethod("multigrid", 3), SolveMethod("jacobi", 7)):
        mp, mq = vector(layout, device, 2), vector(layout, device, 2)
        system.solve(how, p, mp)
        system.solve(how, q, mq)
        left, right = (
            sum(np.sum(to_numpy(f, layout) * to_numpy(g, layout)) for f, g in zip(a, b, strict=True))
            for a, b in ((p, mq), (mp, q))
        )
        assert abs(left - right) < 1e-12 * abs(left) + 1e-14, how


@pytest.mark.float64
@pytest.mark.parametrize("name", MEDIA)
def test_row_sums_bound_the_spectrum(device, name):
    """No eigenvalue of M^-1 A above 1 nor below the bound that sweeps are chosen by, for any walls."""
    grid = Grid(13, 11, 1.0, 0.6)
    mu, alpha = media(grid)[name]
    for walls in WALLS:
        diffusion = coupled(grid, mu, alpha, walls, device)
        matrix, *free = stress_matrix(grid, mu, alpha, DT, names(walls))
        weights = unknowns(diffusion.system.levels[0].weights, diffusion.layout, free)
        values = np.linalg.eigvals(weights[:, None] * matrix.toarray()).real
        stiffness = diffusion.coefficients.stiffness(DT)
        assert values.max() < 1 + 1e-12 and values.min() > stiffness.least - 1e-12
        assert np.linalg.eigvalsh(matrix.toarray()).max() < stiffness.greatest


@pytest.mark.parametrize(
    ("name", "dt", "method"),
    [
        ("constant", 1e-4, "chebyshev"),
        ("smooth", DT, "multigrid"),
        ("jump 1e2", DT, "conjugate gradients"),
        ("jump 1e4", DT, "conjugate gradients"),
        ("noise", DT, "conjugate gradients"),
        ("drag", DT, "chebyshev"),
        ("both", DT, "conjugate gradients"),
    ],
)
def test_the_solve_chosen_keeps_its_tolerance(device, name, dt, method):
    """In float32, of the change in the operator's norm; the method and the residual are reported."""
    from scipy.sparse.linalg import spsolve

    grid = Grid(61, 48, 1.0, 0.8)
    mu, alpha = media(grid)[name]
    diffusion = coupled(grid, mu, alpha, "free-slip", device, dt, diffusion_tolerance=1e-3)
    velocity = random_vector(diffusion, 3)
    diffusion.diffuse(velocity)
    report = diffusion.measure()
    assert report.method == method and 1 <= report.iterations < 40
    matrix, *free = stress_matrix(grid, mu, alpha, dt, ("free-slip", "free-slip"))
    before = unknowns(velocity, diffusion.layout, free).astype(np.float64)
    got = unknowns(diffusion.out, diffusion.layout, free).astype(np.float64)
    exact = spsolve(matrix, before)
    error, change = got - exact, exact - before
    assert np.sqrt(error @ matrix @ error) < 2e-3 * np.sqrt(change @ matrix @ change)
    assert np.linalg.norm(error) < 2e-3 * np.linalg.norm(before)
    assert report.backward < 1e-4


@pytest.mark.float64
@pytest.mark.parametrize("walls", ["free-slip", "periodic", "free-slip,periodic"])
def test_components_apart_equal_both_together_after_the_projection(make_solver, walls):
    """Constant mu: they differ by a gradient, which the projection takes."""
    velocities = []
    for coupled_too in (False, True):
        fluid = {"diffusion_tolerance": 1e-11, "pressure_cycles": 20}
        solver = make_solver(31, 24, viscosity=0.01, walls=walls, **fluid)
        assert isinstance(solver._step.diffusion, SeparateDiffusion)
        if coupled_too:
            mu = np.full((24, 31), 0.01)
            solver = make_solver(31, 24, viscosity=mu, walls=walls, **fluid)
            assert isinstance(solver._step.diffusion, CoupledDiffusion)
        a, b = solver.rest(), solver.rest()
        solver.set_velocity(a, *noise_velocity(solver))
        solver.project(a, b)
        solver.diffuse(b, a, 0.1)
        solver.project(a, b)
        velocities.append(b.velocity)
    for apart, together in zip(*velocities, strict=True):
        assert np.abs(apart - together).max() < 1e-9 * np.abs(apart).max()


@pytest.mark.float64
def test_at_a_no_slip_wall_they_differ_and_the_coupled_one_is_used(make_solver):
    assert not Fluid(walls="no-slip").separable and not Fluid(walls="periodic,no-slip").separable
    solver = make_solver(
        31, 24, viscosity=0.01, walls="no-slip", diffusion_tolerance=1e-11, pressure_cycles=20
    )
    assert isinstance(solver._step.diffusion, CoupledDiffusion)
    apart = SeparateDiffusion(solver.grid, solver.fluid, solver.device)
    apart.plan(0.1)
    a, b = solver.rest(), solver.rest()
    solver.set_velocity(a, *noise_velocity(solver))
    solver.project(a, b)
    apart.diffuse((b.u, b.v))
    solver.diffuse(b, a, 0.1)
    together, out = solver.rest(), solver.rest()
    solver.project(a, together)
    for f, g in zip((out.u, out.v), apart.out, strict=True):
        wp.copy(f, g)
    solver.project(out, a)
    difference = np.abs(a.velocity[0] - together.velocity[0]).max() / np.abs(together.velocity[0]).max()
    assert 0.01 < difference < 0.5


@pytest.mark.float64
@pytest.mark.parametrize("walls", ["free-slip", "periodic", "no-slip,periodic"])
@pytest.mark.parametrize("size", [(24, 24), (31, 18), (13, 37)], ids=str)
def test_projection_with_drag_equals_a_sparse_direct_solve(make_solver, walls, size):
    """v - beta grad q with div beta grad q = div v, beta = 1 / (1 + dt alpha), assembled with SciPy."""
    import scipy.sparse as sparse
    from scipy.sparse.linalg import spsolve

    nx, ny = size
    grid = Grid(nx, ny, nx / max(size), 0.93 * ny / max(size))
    x, y = centres(grid)
    alpha = np.expm1(np.log1p(1e4) * np.exp(-((x - 0.4) ** 2 + (y - 0.3) ** 2) / 0.03))
    solver = make_solver(nx, ny, grid=grid, freeze=frozen(alpha), walls=walls, pressure_cycles=60)
    a, b = solver.rest(), solver.rest()
    u, v = noise_velocity(solver)
    solver.set_velocity(a, u, v)
    solver.project(a, b, DT)

    def gradient(n, h, wraps):
        """Differences at faces 0 … n - 1 of an axis; face 0 of a closed one is on the wall."""
        matrix = sparse.lil_array((n, n))
        for face in range(0 if wraps else 1, n):
            matrix[face, face], matrix[face, face - 1] = 1 / h, -1 / h
        return matrix

    wraps_x, wraps_y = (wall == "periodic" for wall in names(walls))
    g_x = sparse.kron(sparse.eye_array(ny), gradient(nx, grid.hx, wraps_x))
    g_y = sparse.kron(gradient(ny, grid.hy, wraps_y), sparse.eye_array(nx))
    beta_x, beta_y = (1 / (1 + DT * (alpha + np.roll(alpha, 1, axis)) / 2) for axis in (1, 0))
    weighted = [sparse.diags_array(beta.ravel()) @ g for beta, g in ((beta_x, g_x), (beta_y, g_y))]
    matrix = sparse.lil_array(g_x.T @ weighted[0] + g_y.T @ weighted[1])
    matrix[0, 0] += 1.0  # the constant is free
    q = spsolve(sparse.csc_array(matrix), -divergence(grid, u, v).ravel())
    exact_u, exact_v = (
        u[:, :-1] - (weighted[0] @ q).reshape(ny, nx),
        v[:-1] - (weighted[1] @ q).reshape(ny, nx),
    )
    got_u, got_v = b.velocity
    # conjugate gradients and cycles stop at their tolerance; the velocity is as good as that
    assert np.abs(got_u[:, :-1] - exact_u).max() < 2e-3 * np.abs(exact_u).max()
    assert np.abs(got_v[:-1] - exact_v).max() < 2e-3 * np.abs(exact_v).max()
    assert solver.report().pressure.relative < 2e-3
