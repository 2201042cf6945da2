"""Reference solutions for tests, independent of the code under test."""

import numpy as np


def from_streamfunction(grid, psi):
    """Face velocities by differences of psi at nodes, free of divergence up to rounding."""
    x = np.arange(grid.nx + 1) * grid.hx
    y = np.arange(grid.ny + 1)[:, None] * grid.hy
    values = psi(x, y)
    return np.diff(values, axis=0) / grid.hy, -np.diff(values, axis=1) / grid.hx


def noise_velocity(solver, seed=0):
    """Random face velocities that meet the solver's boundary conditions."""
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
    """Divergence at centres, from face velocities."""
    return np.diff(u, axis=1) / grid.hx + np.diff(v, axis=0) / grid.hy


def strain_rate(grid, u, v):
    """Size of the strain rate sqrt(2 S:S) [1/s] at the cells that touch no wall, (ny - 2, nx - 2)."""
    along_x, along_y = np.diff(u, axis=1) / grid.hx, np.diff(v, axis=0) / grid.hy
    shear = np.diff(u[:, 1:-1], axis=0) / grid.hy + np.diff(v[1:-1], axis=1) / grid.hx
    shear = (shear[1:, 1:] + shear[:-1, 1:] + shear[1:, :-1] + shear[:-1, :-1]) / 4
    return np.sqrt(2 * along_x[1:-1, 1:-1] ** 2 + 2 * along_y[1:-1, 1:-1] ** 2 + shear**2)


def sparse_laplacian(n, h, kind):
    """The second difference along one axis, independent of the code under test.

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
    """The Laplacian over unknowns, row by row, from the second differences of two axes."""
    import scipy.sparse as sparse

    x, y = sparse_laplacian(grid.nx, grid.hx, kind_x), sparse_laplacian(grid.ny, grid.hy, kind_y)
    return sparse.kron(sparse.eye_array(y.shape[0]), x) + sparse.kron(y, sparse.eye_array(x.shape[0]))


def stress_matrix(grid, mu, alpha, dt, walls):
    """I + dt alpha - dt div (mu (grad v + grad v^T)) over the free faces, u row by row, then v.

    Assembled from the energy, not from fluxes: every centre and every node dissipates mu times the square
    of its strain over its own area (half a cell on a wall), and the matrix is the energy's Hessian.
    `walls` are the names for x and y. Returns the matrix, and where in u (ny, nx) and v (ny, nx) the free
    faces are.
    """
    import scipy.sparse as sparse

    nx, ny, hx, hy = grid.nx, grid.ny, grid.hx, grid.hy
    wraps_x, wraps_y = (wall == "periodic" for wall in walls)
    free_u, free_v = np.ones((ny, nx), bool), np.ones((ny, nx), bool)
    free_u[:, 0] = wraps_x
    free_v[0, :] = wraps_y
    number = {}
    for name, free in (("u", free_u), ("v", free_v)):
        for j, i in np.argwhere(free):
            number[name, j, i] = len(number)

    def face(name, j, i):
        """Unknown of a face, wrapped; None where it is zero."""
        return number.get((name, j % ny if wraps_y else j, i % nx if wraps_x else i))

    def centre(values, j, i):
        j = j % ny if wraps_y else min(max(j, 0), ny - 1)
        return values[j, i % nx if wraps_x else min(max(i, 0), nx - 1)]

    strains, weights = [], []

    def add(terms, weight):
        strains.append({n: c for n, c in terms if n is not None})
        weights.append(weight)

    for j in range(ny):
        for i in range(nx):
            add([(face("u", j, i + 1), 1 / hx), (face("u", j, i), -1 / hx)], 2 * mu[j, i])
            add([(face("v", j + 1, i), 1 / hy), (face("v", j, i), -1 / hy)], 2 * mu[j, i])
    for j in range(ny + (not wraps_y)):
        for i in range(nx + (not wraps_x)):
            on_x, on_y = not wraps_x and i in (0, nx), not wraps_y and j in (0, ny)
            mean = sum(centre(mu, j - b, i - a) for a in (0, 1) for b in (0, 1)) / 4
            area = (0.5 if on_x else 1.0) * (0.5 if on_y else 1.0)
            terms = []
            for name, on_wall, wall, h, before, after in (
                ("u", on_y, walls[1], hy, (j - 1, i), (j, i)),
                ("v", on_x, walls[0], hx, (j, i - 1), (j, i)),
            ):
                if not on_wall:
                    terms += [(face(name, *after), 1 / h), (face(name, *before), -1 / h)]
                elif wall == "no-slip":  # the fluid inside against the still wall, half a cell away
                    inner, sign = (after, 1) if min(before) < 0 else (before, -1)
                    terms.append((face(name, *inner), sign * 2 / h))
            add(terms, area * mean)
    rows, columns, values = [], [], []
    for row, strain in enumerate(strains):
        for column, value in strain.items():
            rows.append(row)
            columns.append(column)
            values.append(value)
    b = sparse.csr_array((values, (rows, columns)), shape=(len(strains), len(number)))
    drag = np.empty(len(number))
    for (name, j, i), n in number.items():
        drag[n] = (centre(alpha, j, i) + centre(alpha, j - (name == "v"), i - (name == "u"))) / 2
    matrix = sparse.diags_array(1 + dt * drag) + dt * b.T @ sparse.diags_array(weights) @ b
    return sparse.csc_array(matrix), free_u, free_v
