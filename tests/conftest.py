"""Shared by all tests: the device, the precision, and shorthands for grids and velocities."""

import os

import numpy as np
import pytest

from wfluid.device import load_kernels, open_device
from wfluid.fluid import Fluid
from wfluid.grid import Grid
from wfluid.solver import Solver

DOUBLE = os.environ.get("WFLUID_PRECISION") == "float64"


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", help="device the tests run on: cpu, cuda, …")


def pytest_collection_modifyitems(config, items):
    """Tests marked float64 run only in the process that test_precision starts for them."""
    wanted = [item for item in items if (item.get_closest_marker("float64") is not None) == DOUBLE]
    config.hook.pytest_deselected(items=[item for item in items if item not in wanted])
    items[:] = wanted


@pytest.fixture(scope="session")
def device(request):
    device = open_device(request.config.getoption("--device"))
    load_kernels(device)
    return device


@pytest.fixture
def make_solver(device):
    """A solver for nx, ny and the keywords of Fluid; the domain's height follows the cell counts."""

    def make(nx, ny, **fluid):
        longer = max(nx, ny)
        return Solver(Grid(nx, ny, nx / longer, ny / longer), Fluid(**fluid), device)

    return make


def from_streamfunction(grid, psi):
    """Face velocities (psi at nodes, differenced): free of divergence to rounding."""
    x = np.arange(grid.nx + 1) * grid.hx
    y = np.arange(grid.ny + 1)[:, None] * grid.hy
    values = psi(x, y)
    return np.diff(values, axis=0) / grid.hy, -np.diff(values, axis=1) / grid.hx


def noise_velocity(solver, seed=0):
    """Random face velocities that respect the solver's walls."""
    rng = np.random.default_rng(seed)
    nx, ny = solver.grid.nx, solver.grid.ny
    u, v = rng.standard_normal((ny, nx + 1)), rng.standard_normal((ny + 1, nx))
    periodic_x, periodic_y = solver.fluid.walls.periodic
    u[:, -1] = u[:, 0] if periodic_x else 0
    v[-1, :] = v[0, :] if periodic_y else 0
    if not periodic_x:
        u[:, 0] = 0
    if not periodic_y:
        v[0, :] = 0
    return u, v


def divergence(grid, u, v):
    """At centres, from face velocities."""
    return np.diff(u, axis=1) / grid.hx + np.diff(v, axis=0) / grid.hy


def sparse_laplacian(n, h, kind):
    """One axis's second difference, assembled apart from the code under test.

    "even", "odd": points half a cell inside; "face": the n - 1 inner faces; "periodic".
    """
    import scipy.sparse as sparse

    size = n - 1 if kind == "face" else n
    matrix = sparse.diags_array([np.ones(size - 1), -2 * np.ones(size), np.ones(size - 1)], offsets=[-1, 0, 1])
    matrix = sparse.lil_array(matrix)
    if kind == "even":
        matrix[0, 0] = matrix[-1, -1] = -1
    elif kind == "odd":
        matrix[0, 0] = matrix[-1, -1] = -3
    elif kind == "periodic":
        matrix[0, -1] += 1
        matrix[-1, 0] += 1
    return sparse.csr_array(matrix) / h**2


def laplacian_2d(grid, kind_x, kind_y):
    """Laplacian over unknowns row by row, from two axes."""
    import scipy.sparse as sparse

    x, y = sparse_laplacian(grid.nx, grid.hx, kind_x), sparse_laplacian(grid.ny, grid.hy, kind_y)
    return sparse.kron(sparse.eye_array(y.shape[0]), x) + sparse.kron(y, sparse.eye_array(x.shape[0]))
