"""Norms of fields."""

from __future__ import annotations

import numpy as np
import warp as wp

from wfluid.fields.arrays import Vector
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.real import Real
from wfluid.kernels.solve import sums


def norm(x: Vector, layout: Layout) -> float:
    """Euclidean norm of x over its cells."""
    return float(np.sqrt(sum(_rows(f, layout)[0].sum(dtype=np.float64) for f in x)))


def largest(f: wp.array, layout: Layout) -> float:
    """Largest absolute value of f over its cells."""
    return float(_rows(f, layout)[1].max())


def _rows(f: wp.array, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    squares, highest = (wp.empty(layout.ny, dtype=Real, device=f.device) for _ in range(2))
    sums.row_norms.launch(layout.ny, f.device, [f, layout.nx, layout.pitch], [squares, highest])
    return squares.numpy(), highest.numpy()
