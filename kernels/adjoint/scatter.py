"""Scatter: the transpose of an interpolation. Each cell adds to the points around the place it was read at.

    f_bar[at - 1 + q + (r - 1) pitch] += w_q(tx) w_r(ty) out_bar[k]        cubic: q, r = 0 … 3

Neighbouring cells mostly read at neighbouring places: `at` - k is one number, or a few, over a span. For
each such number what all its cells add to a row is a sum of products of shifted arrays, so that on a CPU
a span adds whole rows at a time, vectorised, instead of sixteen times a cell to an address that the cell
before has just written. What is left after a few such numbers is added cell by cell. The order of the
additions is fixed, hence so are the bits; on CUDA each cell adds atomically.
"""

import warp as wp
from wfluid.kernels.cell.layout import SPAN
from wfluid.kernels.cell.program import adjoint_spans
from wfluid.kernels.cell.real import Field, Indices, Real

SHIFTS = 6
"""Numbers `at` - k of one span that are added row by row."""

_WEIGHTS = {
    "cubic": """
        const real s{0} = 1 - {0};
        {1}[0]{2} = {0} * (real(-0.5) + {0} * (1 - real(0.5) * {0}));
        {1}[1]{2} = 1 + {0} * {0} * (real(-2.5) + real(1.5) * {0});
        {1}[2]{2} = 1 + s{0} * s{0} * (real(-2.5) + real(1.5) * s{0});
        {1}[3]{2} = s{0} * (real(-0.5) + s{0} * (1 - real(0.5) * s{0}));
    """,
    "bilinear": """
        {1}[0]{2} = 1 - {0};
        {1}[1]{2} = {0};
    """,
}


def _scatter_source(kind: str) -> str:
    taps = {"cubic": 4, "bilinear": 2}[kind]
    weights = _WEIGHTS[kind].replace("real(", "(real)(")
    one_x, one_y = weights.format("a", "x", ""), weights.format("b", "y", "")
    all_x, all_y = weights.format("a", "x", "[PAD + c]"), weights.format("b", "y", "[c]")
    return f"""
    typedef wp::{Real.__name__} real;
    enum {{ SPAN = {SPAN}, TAPS = {taps}, REACH = TAPS / 2 - 1, PAD = 4 }};
    enum {{ SHIFTS = {SHIFTS}, NONE = -(1 << 30) }};
#if defined(__CUDA_ARCH__)
    if (i >= nx) return;
    real x[TAPS], y[TAPS];
    const real a = tx.data[k], b = ty.data[k];
    {one_x}
    {one_y}
    for (int r = 0; r < TAPS; ++r)
        for (int q = 0; q < TAPS; ++q)
            wp::atomic_add(
                f_bar, at.data[k] + (r - REACH) * pitch + q - REACH, x[q] * y[r] * out_bar.data[k]);
#else
    const wp::int32 cells = nx - i < SPAN ? nx - i : SPAN;
    alignas(64) real x[TAPS][SPAN + 2 * PAD] = {{}}, t[TAPS][SPAN + 2 * PAD] = {{}}, y[TAPS][SPAN];
    alignas(64) wp::int32 shift[SPAN];
    for (int c = 0; c < SPAN; ++c) {{
        const bool cell = c < cells;
        const real a = cell ? tx.data[k + c] : 0, b = cell ? ty.data[k + c] : 0;
        const real bar = cell ? out_bar.data[k + c] : 0;
        shift[c] = cell ? at.data[k + c] - c : NONE;
        {all_x}
        {all_y}
        for (int r = 0; r < TAPS; ++r) y[r][c] *= bar;
    }}
    wp::int32 first = 0;
    for (int round = 0; first < cells; ++round) {{
        const wp::int32 here = shift[first], start = here - REACH * pitch - REACH;
        const wp::int32 end = start + (TAPS - 1) * pitch + SPAN + TAPS - 1;
        if (round == SHIFTS || start < 0 || end > (wp::int32)f_bar.shape[0]) break;
        for (int r = 0; r < TAPS; ++r)
            for (int c = 0; c < SPAN; ++c) t[r][PAD + c] = shift[c] == here ? y[r][c] : 0;
        for (int r = 0; r < TAPS; ++r) {{
            real* row = f_bar.data + start + r * pitch;
            for (int p = 0; p < SPAN + TAPS - 1; ++p) {{
                real sum = 0;
                for (int q = 0; q < TAPS; ++q) sum += x[q][PAD + p - q] * t[r][PAD + p - q];
                row[p] += sum;
            }}
        }}
        for (int c = 0; c < SPAN; ++c) shift[c] = shift[c] == here ? NONE : shift[c];
        while (first < cells && shift[first] == NONE) ++first;
    }}
    for (int c = first; c < cells; ++c) {{
        if (shift[c] == NONE) continue;
        real* corner = f_bar.data + shift[c] + c - REACH * pitch - REACH;
        for (int r = 0; r < TAPS; ++r)
            for (int q = 0; q < TAPS; ++q) corner[r * pitch + q] += x[q][PAD + c] * y[r][c];
    }}
#endif
"""


@wp.func_native(_scatter_source("cubic"))
def scatter_span_cubic(
    i: int, k: int, nx: int, at: Indices, tx: Field, ty: Field, out_bar: Field, pitch: int, f_bar: Field
):
    """Add what the cells of the span from i, k on read by cubics."""
    ...


@wp.func_native(_scatter_source("bilinear"))
def scatter_span_bilinear(
    i: int, k: int, nx: int, at: Indices, tx: Field, ty: Field, out_bar: Field, pitch: int, f_bar: Field
):
    """Add what the cells of the span from i, k on read bilinearly."""
    ...


@adjoint_spans
def scatter_cubic(
    i: int,
    j: int,
    k: int,
    at: Indices,
    tx: Field,
    ty: Field,
    out_bar: Field,
    nx: int,
    pitch: int,
    # outputs
    f_bar: Field,
):
    """The transpose of `advection.cubic`, tx and ty past point `at`; adds to f_bar."""
    scatter_span_cubic(i, k, nx, at, tx, ty, out_bar, pitch, f_bar)


@adjoint_spans
def scatter_bilinear(
    i: int,
    j: int,
    k: int,
    at: Indices,
    tx: Field,
    ty: Field,
    out_bar: Field,
    nx: int,
    pitch: int,
    # outputs
    f_bar: Field,
):
    """The transpose of `advection.bilinear`, tx and ty past point `at`; adds to f_bar."""
    scatter_span_bilinear(i, k, nx, at, tx, ty, out_bar, pitch, f_bar)
