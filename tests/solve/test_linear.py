"""The linear solves: against sparse direct solves, their symmetry, their convergence."""

import numpy as np
import pytest
from oracles import laplacian_2d, sparse_laplacian

from wfluid.domain.grid import Grid
from wfluid.domain.walls import Rule
from wfluid.fields.arrays import field, from_numpy, to_numpy
from wfluid.solve.chebyshev import chebyshev_count, chebyshev_factors
from wfluid.solve.multigrid import Location, hierarchy
from wfluid.solve.operators import FIVE_POINT_INTERVAL, FivePoint
from wfluid.solve.system import LinearSystem, SolveMethod

SIZES = ((16, 16), (31, 24), (37, 29), (53, 8), (6, 61))
KINDS = {
    "pressure": (0.0, 1.0, (Rule.EVEN, Rule.EVEN), (False, False), ("even", "even")),
    "pressure periodic": (0.0, 1.0, (Rule.PERIODIC, Rule.EVEN), (False, False), ("periodic", "even")),
    "u free-slip": (1.0, 0.02, (Rule.FACE, Rule.EVEN), (True, False), ("face", "even")),
    "v no-slip": (1.0, 0.3, (Rule.ODD, Rule.FACE), (False, True), ("odd", "face")),
    "u periodic": (1.0, 5.0, (Rule.PERIODIC, Rule.ODD), (True, False), ("periodic", "odd")),
}


def five_point(nx, ny, size, points, shift, scale, device):
    """The system shift - scale Lap."""
    levels = [FivePoint(*cells, size, points, device) for cells in hierarchy(nx, ny, size)]
    for level in levels:
        level.set_coefficients(shift, scale)
    system = LinearSystem(levels, device, FIVE_POINT_INTERVAL, singular=shift == 0)
    system.invert_coarsest()
    return system


def system_for(kind, nx, ny, device):
    """The system, its grid and which of the stored points are unknowns."""
    shift, scale, rules, on_faces, _ = KINDS[kind]
    longer = max(nx, ny)
    grid = Grid(nx, ny, nx / longer, ny / longer)
    system = five_point(nx, ny, (grid.width, grid.height), Location(rules, on_faces), shift, scale, device)
    cut = (slice(int(rules[1] is Rule.FACE), ny), slice(int(rules[0] is Rule.FACE), nx))
    return system, grid, cut


def right_hand_side(kind, grid, cut, seed=0):
    b = np.zeros((grid.ny, grid.nx))
    b[cut] = np.random.default_rng(seed).standard_normal(b[cut].shape)
    if KINDS[kind][0] == 0:
        b -= b.mean()
    return b


def solve(system, b, cycles=None, sweeps=None, how=None):
    how = how or (SolveMethod("jacobi", sweeps) if sweeps else SolveMethod("multigrid", cycles))
    layout = system.levels[0].layout
    rhs, x = field(layout, system.device), field(layout, system.device)
    from_numpy(b, rhs, layout)
    system.solve(how, (rhs,), (x,))
    return to_numpy(x, layout), system.measure(how, (rhs,), (x,))


@pytest.mark.float64
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_multigrid_equals_a_sparse_direct_solve(device, kind, size):
    """On even, odd and prime sizes and both extremes of aspect; the matrix is SciPy's."""
    import scipy.sparse as sparse
    from scipy.sparse.linalg import spsolve

    shift, scale, *_, axes = KINDS[kind]
    system, grid, cut = system_for(kind, *size, device)
    b = right_hand_side(kind, grid, cut)
    x, residual = solve(system, b, cycles=16)
    matrix = shift * sparse.eye_array(b[cut].size) - scale * laplacian_2d(grid, *axes)
    if shift == 0:  # the constant is free: fix the mean
        matrix = matrix + np.ones((1, 1)) * sparse.coo_array(([1.0], ([0], [0])), shape=matrix.shape)
    exact = spsolve(sparse.csc_array(matrix), b[cut].ravel())
    got = x[cut].ravel()
    if shift == 0:
        exact, got = exact - exact.mean(), got - got.mean()
    assert residual.relative < 1e-11
    np.testing.assert_allclose(got, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.float64
@pytest.mark.parametrize("cycles", [1, 2, 3])
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_fixed_cycles_are_a_symmetric_operator(device, kind, size, cycles):
    """<p, M q> = <M p, q> to rounding, converged or not: the adjoint of a solve is the same solve."""
    system, grid, cut = system_for(kind, *size, device)
    p, q = (right_hand_side(kind, grid, cut, seed) for seed in (1, 2))
    left, right = np.sum(p * solve(system, q, cycles)[0]), np.sum(q * solve(system, p, cycles)[0])
    size = np.linalg.norm(p) * np.linalg.norm(solve(system, q, cycles)[0])
    assert abs(left - right) < 1e-13 * size, f"{left} against {right}"


@pytest.mark.parametrize("kind", KINDS)
def test_three_cycles_leave_less_than_a_thousandth(device, kind):
    """And say so: the residual reported is the one of the answer."""
    system, grid, cut = system_for(kind, 61, 48, device)
    b = right_hand_side(kind, grid, cut)
    assert solve(system, b, cycles=3)[1].relative < 1e-3
    assert solve(system, b, cycles=1)[1].relative > 1e-3


@pytest.mark.float64
@pytest.mark.parametrize("scale", [0.0, 1e-6, 1e-4, 5e-4, 2e-3, 0.1, 30.0])
@pytest.mark.parametrize("tolerance", [0.1, 7e-3, 1e-4])
def test_a_planned_solve_keeps_its_tolerance_and_is_symmetric(device, scale, tolerance):
    """On white noise, for every stiffness: few Chebyshev sweeps where that is enough, cycles beyond."""
    kind = "v no-slip"
    _, grid, cut = system_for(kind, 41, 32, device)
    points = Location(*KINDS[kind][2:4])
    system = five_point(41, 32, (grid.width, grid.height), points, 1.0, scale, device)
    top = system.levels[0]
    how = system.plan_sweeps(top.least, 2 - top.least, top.centre, tolerance) or system.plan_cycles(tolerance)
    p, q = (right_hand_side(kind, grid, cut, seed) for seed in (1, 2))
    (mp, residual), (mq, _) = solve(system, p, how=how), solve(system, q, how=how)
    assert residual.relative <= tolerance
    if scale == 0:
        assert how == SolveMethod("chebyshev", 1) and residual.relative < 1e-15
    size = np.linalg.norm(p) * np.linalg.norm(mq)
    assert abs(np.sum(p * mq) - np.sum(q * mp)) < 1e-12 * size


def test_the_chebyshev_degree_is_the_least_that_keeps_the_tolerance():
    for low, high, tolerance in ((0.1, 1.9, 7e-3), (0.5, 1.5, 1e-4), (0.8, 1.0, 7e-3)):
        count = chebyshev_count(low, high, tolerance)
        x = np.linspace(low, high, 401)
        left = [
            np.abs(np.prod([1 - w * x for w in chebyshev_factors(low, high, n)], axis=0)).max()
            for n in (count - 1, count)
        ]
        assert left[1] <= tolerance < left[0]


@pytest.mark.parametrize("stretch", [1, 5, 20])
def test_cells_far_from_square_converge_too(device, stretch):
    """Cells `stretch` times wider than high: three cycles still leave less than a hundredth."""
    points = Location((Rule.EVEN, Rule.EVEN))
    system = five_point(64, 60, (1.0, 1.0 / stretch), points, 0.0, 1.0, device)
    b = np.random.default_rng(0).standard_normal((60, 64))
    assert solve(system, b - b.mean(), cycles=3)[1].relative < 1e-2


def test_jacobi_is_the_fixed_point_iteration(device):
    """Sweeps of x <- x + (b - A x) / diag, written again with SciPy's matrix."""
    system, grid, cut = system_for("u free-slip", 19, 14, device)
    b = right_hand_side("u free-slip", grid, cut)
    got, residual = solve(system, b, sweeps=7)
    matrix = np.eye(b[cut].size) - 0.02 * laplacian_2d(grid, "face", "even").toarray()
    diagonal = 1 + 2 * 0.02 * (1 / grid.hx**2 + 1 / grid.hy**2)  # the interior's, ghosts do the rest
    x = np.zeros(b[cut].size)
    for _ in range(7):
        x += (b[cut].ravel() - matrix @ x) / diagonal
    np.testing.assert_allclose(got[cut].ravel(), x, atol=2e-6)
    assert residual.iterations == 7


def test_the_oracle_itself_has_the_right_null_space():
    """Neumann and periodic second differences kill constants, the others do not."""
    for kind, kills in (("even", True), ("periodic", True), ("odd", False), ("face", False)):
        matrix = sparse_laplacian(7, 0.3, kind)
        assert (np.abs(matrix @ np.ones(matrix.shape[0])).max() < 1e-12) == kills


def test_chebyshev_factors_damp_the_interval_evenly():
    """Prod (1 - w x) is at most 1 / T_n((b + a) / (b - a)) on [a, b]."""
    low, high = 0.45, 2.0
    x = np.linspace(low, high, 201)
    for count in (1, 2, 3, 4):
        left = np.prod([1 - w * x for w in chebyshev_factors(low, high, count)], axis=0)
        best = 1 / np.cosh(count * np.arccosh((high + low) / (high - low)))
        assert np.abs(left).max() == pytest.approx(best, rel=1e-9)
