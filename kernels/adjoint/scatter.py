"""Scatter: the transpose of an interpolation. Each cell adds to the points around its foot.

    f_bar[corner - 1 + q + (r - 1) pitch] += w_q(tx) w_r(ty) out_bar[k]        cubic: q, r = 0 … 3

The feet of neighbouring cells are mostly neighbours too: the shift `corner` - k has one value, or a few, over
a span. On a CPU all cells of one shift are added together, row by row: each row of the sum is a sum of
products of shifted arrays, which vectorises. Cell by cell it would be sixteen additions, each to an address
that the cell before has just written. Cells whose shift is not among the first few are added cell by cell.
The order of the additions is fixed, hence so are the bits. On CUDA each cell adds atomically.
"""

import warp as wp
from wfluid.kernels.cell.layout import SPAN
from wfluid.kernels.cell.program import Program, adjoint_spans
from wfluid.kernels.cell.real import Field, Indices, Real

SHIFTS = 6
"""Shifts `corner` - k of one span whose cells are added row by row."""

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
                f_bar, corner.data[k] + (r - REACH) * pitch + q - REACH, x[q] * y[r] * out_bar.data[k]);
#else
    const wp::int32 cells = nx - i < SPAN ? nx - i : SPAN;
    alignas(64) real x[TAPS][SPAN + 2 * PAD] = {{}}, t[TAPS][SPAN + 2 * PAD] = {{}}, y[TAPS][SPAN];
    alignas(64) wp::int32 shift[SPAN];
    for (int c = 0; c < SPAN; ++c) {{
        const bool cell = c < cells;
        const real a = cell ? tx.data[k + c] : 0, b = cell ? ty.data[k + c] : 0;
        const real bar = cell ? out_bar.data[k + c] : 0;
        shift[c] = cell ? corner.data[k + c] - c : NONE;
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
        real* first_tap = f_bar.data + shift[c] + c - REACH * pitch - REACH;
        for (int r = 0; r < TAPS; ++r)
            for (int q = 0; q < TAPS; ++q) first_tap[r * pitch + q] += x[q][PAD + c] * y[r][c];
    }}
#endif
"""


@wp.func_native(_scatter_source("cubic"))
def scatter_cubic_span(
    i: int, k: int, nx: int, corner: Indices, tx: Field, ty: Field, out_bar: Field, pitch: int, f_bar: Field
):
    """Scatter the span that begins with cell k, column i, with the weights of `interpolation.cubic`."""
    ...


@wp.func_native(_scatter_source("bilinear"))
def scatter_bilinear_span(
    i: int, k: int, nx: int, corner: Indices, tx: Field, ty: Field, out_bar: Field, pitch: int, f_bar: Field
):
    """Scatter the span that begins with cell k, column i, with the weights of `interpolation.bilinear`."""
    ...


def _scatter(scatter_span: wp.Function) -> Program:
    @adjoint_spans
    def scatter(
        i: int,
        j: int,
        k: int,
        corner: Indices,
        tx: Field,
        ty: Field,
        out_bar: Field,
        nx: int,
        pitch: int,
        # outputs
        f_bar: Field,
    ):
        """f_bar[p] += w_p(tx, ty) out_bar[k] at the points p around the foot of point k, in place.

        The foot lies tx and ty [cells] past entry `corner`[k] of f_bar; out_bar is the gradient with respect
        to the value read there.
        """
        scatter_span(i, k, nx, corner, tx, ty, out_bar, pitch, f_bar)

    return scatter


scatter_cubic = _scatter(scatter_cubic_span)
scatter_bilinear = _scatter(scatter_bilinear_span)
