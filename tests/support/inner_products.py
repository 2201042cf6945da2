"""Inner products of fields for the tests of transposes: <y, A x> = <A^T y, x>."""

import numpy as np
from wfluid.kernels.cell.layout import HALO

from wfluid.fields.arrays import from_numpy, vector


def padded(f, layout):
    """The values of a field with its ghosts, (ny + 4, nx + 4), a copy."""
    rows = layout.size // layout.pitch
    grid = f.numpy()[: rows * layout.pitch].reshape(rows, layout.pitch)
    return grid[: layout.ny + 2 * HALO, : layout.nx + 2 * HALO].copy()


def put_padded(values, f, layout):
    """Write values with ghosts, (ny + 4, nx + 4), into a field."""
    buffer = f.numpy().copy()
    rows = layout.size // layout.pitch
    grid = buffer[: rows * layout.pitch].reshape(rows, layout.pitch)
    grid[: layout.ny + 2 * HALO, : layout.nx + 2 * HALO] = values
    f.assign(buffer)


def noise(layout, device, components, seed, *ghosts):
    """Fields of noise; with `ghosts` for each field, ghosts are filled and values on walls are 0."""
    rng = np.random.default_rng(seed)
    fields = vector(layout, device, components)
    for f in fields:
        from_numpy(rng.standard_normal((layout.ny, layout.nx)), f, layout)
    for f, own in zip(fields, ghosts, strict=False):
        own.fill(f)
    return fields


def inner(x, y, layout):
    """<x, y> over the cells, and a bound of what rounding makes of it.

    The sum of the products' sizes, of which each operation rounds off a part: what cancels is no error.
    """
    cells = (slice(HALO, HALO + layout.ny), slice(HALO, HALO + layout.nx))
    products = [padded(f, layout)[cells] * padded(g, layout)[cells] for f, g in zip(x, y, strict=True)]
    return sum(p.sum() for p in products), sum(np.abs(p).sum() for p in products)
