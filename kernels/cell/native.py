"""Assumptions for the compiler, without which loops over cells do not vectorise."""

import warp as wp
from wfluid.kernels.cell.real import PRECISION, Field, Real


@wp.func_native("__builtin_assume(k >= 4); return k;")
def inside(k: int) -> int:
    """k, with the assumption k >= 4: no cell is among the first elements of its field.

    Warp wraps negative indices, and its test for them stops the vectoriser. Apply this to the index in every
    row that is read or written; its neighbours in the row are then k - 1, k + 1.
    """
    ...


@wp.func_native("__builtin_assume(i >= 0); return i;")
def entry(i: int) -> int:
    """i, with the assumption i >= 0: the index of an entry in a table."""
    ...


_BITS = {"float32": "wp::int32", "float64": "wp::int64"}[PRECISION]


@wp.func_native(
    "__builtin_assume(k >= 0);"
    f"const {_BITS} bits = ((const {_BITS}*)f.data)[k];"
    f"wp::{PRECISION} value; memcpy(&value, &bits, sizeof(value)); return value;"
)
def gather(f: Field, k: int) -> Real:
    """f[k] at an address that is computed from data.

    A read through an integer lvalue cannot alias a store to a `Field`, so a loop of gathers vectorises. Never
    use it on an array that the same kernel writes.
    """
    ...
