"""Promises to the compiler, without which loops over cells do not vectorise."""

import warp as wp
from wfluid.kernels.cell.real import PRECISION, Field, Real


@wp.func_native("__builtin_assume(k >= 4); return k;")
def inside(k: int) -> int:
    """Promise the compiler that k is a cell, never among the first elements of its field.

    Warp wraps negative indices; the test for it stops the vectoriser. Apply it to the base of every
    row touched; neighbours in the row follow as k - 1, k + 1.
    """
    ...


@wp.func_native("__builtin_assume(i >= 0); return i;")
def entry(i: int) -> int:
    """Promise the compiler that i, an entry of a table, is not negative."""
    ...


_BITS = {"float32": "wp::int32", "float64": "wp::int64"}[PRECISION]


@wp.func_native(
    "__builtin_assume(k >= 0);"
    f"const {_BITS} bits = ((const {_BITS}*)f.data)[k];"
    f"wp::{PRECISION} value; memcpy(&value, &bits, sizeof(value)); return value;"
)
def gather(f: Field, k: int) -> Real:
    """f[k] at an address the compiler cannot foresee.

    Reading through an integer lvalue proves that the read does not alias a store to a `Field`, so a
    loop of gathers vectorises. Never use it on an array that the same kernel writes.
    """
    ...
