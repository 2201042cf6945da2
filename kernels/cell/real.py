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
    """Annotation of a number in device memory: launch with an array of one element, read a `Real`."""


class RowReal:
    """Annotation of a table over the rows: launch with a `Field`, read the `Real` of row j."""


class RowIndex:
    """Annotation of a table over the rows: launch with `Indices`, read the index of row j."""
