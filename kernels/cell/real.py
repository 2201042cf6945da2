"""The precision, and the types of arrays and of parameters read once a span."""

import os

import warp as wp

_PRECISIONS = {"float32": wp.float32, "float64": wp.float64}
PRECISION = os.environ.get("WFLUID_PRECISION", "float32")
if PRECISION not in _PRECISIONS:
    raise ValueError(f"WFLUID_PRECISION={PRECISION!r}: expected one of {', '.join(_PRECISIONS)}")

Real = _PRECISIONS[PRECISION]
"""The scalar of every field; float32 unless WFLUID_PRECISION=float64 is set for the process."""

Field = wp.array[Real]
"""A 1-D device array of `Real` over a `Layout`."""

Indices = wp.array[wp.int32]
"""A 1-D device array of indices."""


class Uniform:
    """Annotation of a number in device memory: pass an array of one element, receive a `Real`."""


class RowReal:
    """Annotation of a table over the rows: pass a `Field` of them, receive row j's `Real`."""


class RowIndex:
    """Annotation of a table over the rows: pass `Indices`, receive row j's index."""
