"""Kernels of user objectives, differentiated by Warp."""

import warp as wp
from wfluid.kernels.cell.real import Real


@wp.kernel(module="tests.objectives")
def mean_square(x: wp.array[Real], y: wp.array[Real], value: wp.array[Real]):
    """Add x^2 + x y of each entry [cells^2]."""
    n = wp.tid()
    wp.atomic_add(value, 0, x[n] * x[n] + x[n] * y[n])


@wp.kernel(module="tests.objectives")
def product(
    f: wp.array[Real],
    g: wp.array[Real],
    nx: int,
    first: int,
    pitch: int,
    factor: Real,
    value: wp.array[Real],
):
    """Add the factor times f^2 + f g + g^2 f of each cell."""
    t = wp.tid()
    k = first + t // nx * pitch + t % nx
    a = f[k]
    b = g[k]
    wp.atomic_add(value, 0, factor * (a * a + a * b + a * b * b))
