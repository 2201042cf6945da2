"""What tests compare with, written apart from the code under test."""

import numpy as np


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
    matrix = sparse.diags_array(
        [np.ones(size - 1), -2 * np.ones(size), np.ones(size - 1)], offsets=[-1, 0, 1]
    )
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
