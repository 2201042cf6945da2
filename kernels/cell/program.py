"""Per-cell programs: one Python function becomes a vectorised CPU kernel and a CUDA kernel.

A field is a 1-D array over a padded grid (`Layout`); a program is written for one cell::

    @cells
    def residual(i: int, j: int, k: int, b: Field, x: Field, pitch: int,
                 # outputs
                 r: Field): ...

`i` is the column, `j` the row, `k` the index of the cell in every field of that layout, so the
neighbours are k - 1, k + 1, k - pitch, k + pitch. `cells` wraps the program into

* a CPU kernel in which a thread runs `SPAN` consecutive cells of one row: a countable loop over
  consecutive addresses, which LLVM vectorises (a plain 2-D Warp kernel runs 20 times slower);
* a CUDA kernel in which a thread runs one cell.

The last span of a row may go past the end of the row, into its padding (`Layout`). It may write to ghost
cells, which are filled afterwards. All CPU kernels share one Warp module and all CUDA kernels another: a
module takes four seconds to compile before its first kernel, and a device compiles only its own module.

A number that lives on the device, and so may change between replays of a captured graph, is
annotated `Uniform`; a table with one entry per row is annotated `RowReal` or `RowIndex`. The kernel reads
it once per span, and the program gets a plain number.

A function that takes device functions and returns a program of them makes variants from one source, such as
advection with cubic and with bilinear interpolation (`step/advection`).
"""

import inspect
import linecache
import types
from collections.abc import Callable, Sequence

import warp as wp
from wfluid.kernels.cell.layout import SPAN, Layout
from wfluid.kernels.cell.lock import exclusive
from wfluid.kernels.cell.real import Field, Indices, Real, RowIndex, RowReal, Uniform
from wfluid.kernels.cell.strips import Strip, share, strips_meet

_HOISTED = {Uniform: (Real, Field, "0"), RowReal: (Real, Field, "j"), RowIndex: (wp.int32, Indices, "j")}
"""By annotation: the type in the program, the type in the kernel, the entry that the kernel reads."""

CPU_FLAGS = (
    "-march=native -mprefer-vector-width=512 -ffp-contract=off"
    " -mllvm=-inline-threshold=9000 -mllvm=-inline-cold-callsite-threshold=3000"
)
"""All of a program is inlined into its loop over a span, or the loop does not vectorise. Products are not
fused with sums: that gains no speed, as the loops wait for memory, and without it every vector width, hence
every CPU, computes the same bits."""


class Program:
    """A per-cell (or per-line) function with its kernel for each kind of device."""

    def __init__(self, func: wp.Function, kernels: dict[str, wp.Kernel], span: int):
        self.func = func
        self.kernels = kernels
        self.span = span

    @exclusive
    def launch(
        self,
        layout: Layout,
        device: wp.Device,
        inputs: Sequence,
        outputs: Sequence,
        rows: tuple[int, int] | None = None,
        boxes: wp.array | None = None,
        turn: int | None = None,
    ) -> None:
        """Run the program on every cell of `layout`, or of its rows `rows[0]` to `rows[1]` - 1.

        A layered program runs for every n on the cells of its box: `boxes` holds, for each n, the
        first column, the column after the last, the first row and the row after the last. A program that
        writes to cells of other rows is given a `turn`, the number of the one CPU thread that runs it;
        programs with different numbers may run at the same time.
        """
        row, end = share(*(rows or (0, layout.ny)), turn)
        if row == end:
            return
        spans = layout.nx if device.is_cuda else -(-layout.nx // self.span)
        layers = [] if boxes is None else [boxes, len(boxes) // 4]
        wp.launch(
            self.kernels["cuda" if device.is_cuda else "cpu"],
            dim=(end - row) * spans,
            inputs=[*inputs],
            outputs=[*outputs, *layers, row, spans, layout.first, layout.pitch],
            device=device,
            record_tape=False,
        )


class Lines:
    """A function of a line number t (a row, a column, a force) with its kernels."""

    def __init__(self, kernels: dict[str, wp.Kernel]):
        self.kernels = kernels

    @exclusive
    def launch(
        self, lines: int, device: wp.Device, inputs: Sequence, outputs: Sequence, turn: int | None = None
    ) -> None:
        """Run the function for t = 0 … lines - 1; `turn` as in `Program.launch`."""
        first, end = share(0, lines, turn)
        if first < end:
            wp.launch(
                self.kernels["cuda" if device.is_cuda else "cpu"],
                dim=end - first,
                inputs=[*inputs],
                outputs=[*outputs, first],
                device=device,
                record_tape=False,
            )


_CELLS = """def {name}({signature}, row_: int, spans_: int, first_: int, pitch_: int):
    t = wp.tid()
    line = t // spans_
    i = (t - line * spans_) * SPAN
    j = row_ + line
    k = first_ + j * pitch_ + i
{hoisted}
    for c in range(SPAN):
        func(i + c, j, k + c, {arguments})
"""

_SPANS = """def {name}({signature}, row_: int, spans_: int, first_: int, pitch_: int):
    t = wp.tid()
    line = t // spans_
    i = (t - line * spans_) * SPAN
    j = row_ + line
    k = first_ + j * pitch_ + i
{hoisted}
    func(i, j, k, {arguments})
"""

_LAYERS = """def {name}(
    {signature}, boxes_: Indices, layers_: int, row_: int, spans_: int, first_: int, pitch_: int
):
    t = wp.tid()
    line = t // spans_
    i = (t - line * spans_) * SPAN
    j = row_ + line
    k = first_ + j * pitch_ + i
{hoisted}
    for n in range(layers_):
        box_ = 4 * n
        rows_ = boxes_[box_ + 2] <= j and j < boxes_[box_ + 3]
        if rows_ and boxes_[box_] < i + SPAN and i < boxes_[box_ + 1]:
            for c in range(SPAN):
                func(n, i + c, j, k + c, {arguments})
"""

_LINES = """def {name}({signature}, first_: int):
    t = first_ + wp.tid()
{hoisted}
    func(t, {arguments})
"""


FORWARD, ADJOINT = "wfluid", "wfluid.adjoint"
"""Names of the modules. Kernels of the adjoint are built only where a gradient is computed."""


def cells(program: Callable, span: int = SPAN, module: str = FORWARD) -> Program:
    """Make a program of (i, j, k, …), run once per cell, or of (n, i, j, k, …), once per layer and cell.

    A layered program runs on all cells of a span that meets its box, so it must add 0 outside the box.
    Programs outside this package name a module of their own, so that this one is not built again.
    """
    layered = next(iter(inspect.signature(program).parameters)) == "n"
    template = _LAYERS if layered else _CELLS
    func, kernels = _kernels(
        program, skip=3 + layered, template=template, spans={"cpu": span, "cuda": 1}, module=module
    )
    return Program(func, kernels, span)


def adjoint_spans(program: Callable) -> Program:
    """A program of the adjoint that runs once per span, from its first cell on; on CUDA once per cell."""
    spans = {"cpu": SPAN, "cuda": 1}
    func, kernels = _kernels(program, skip=3, template=_SPANS, spans=spans, module=ADJOINT)
    return Program(func, kernels, SPAN)


def lines(program: Callable, module: str = FORWARD) -> Lines:
    """Make a function of (t, …) that runs once per line, with one thread for each line on every device."""
    return Lines(_kernels(program, skip=1, template=_LINES, spans={"cpu": 1, "cuda": 1}, module=module)[1])


def adjoint_cells(program: Callable) -> Program:
    """A program of the adjoint."""
    return cells(program, module=ADJOINT)


def adjoint_lines(program: Callable) -> Lines:
    """A function of lines of the adjoint."""
    return lines(program, module=ADJOINT)


def _kernels(program, skip, template, spans, module):
    parameters = list(inspect.signature(program, eval_str=True).parameters.values())[skip:]
    hoisted = {p.name: _HOISTED[p.annotation] for p in parameters if p.annotation in _HOISTED}
    program.__annotations__.update({name: received for name, (received, _, _) in hoisted.items()})
    func = wp.func(program)
    source_of = {
        "signature": ", ".join(f"{p.name}: annotation_{p.name}" for p in parameters),
        "arguments": ", ".join(f"{p.name}_0" if p.name in hoisted else p.name for p in parameters),
        "hoisted": "\n".join(f"    {name}_0 = {name}[{entry}]" for name, (_, _, entry) in hoisted.items()),
    }
    program_name = _name(program)
    kernels = {}
    for kind, span in spans.items():
        name = f"{program.__module__.rpartition('.')[2]}_{program_name}_{span}"
        source = template.format(name=name, **source_of)
        file = f"<{kind} {program.__module__}.{program_name} {span}>"
        linecache.cache[file] = (len(source), None, source.splitlines(True), file)  # Warp reads the source
        scope = {"wp": wp, "func": func, "SPAN": wp.constant(span), "Indices": Indices}
        for p in parameters:
            scope[f"annotation_{p.name}"] = hoisted[p.name][1] if p.name in hoisted else p.annotation
        exec(compile(source, file, "exec"), scope)
        kernel: types.FunctionType = scope[name]
        kernel.__module__ = program.__module__
        kernels[kind] = wp.kernel(kernel, module=module_of(kind, module))
    return func, kernels


def _name(program: Callable) -> str:
    """The name of a program, then those of the device functions that it was made with.

    A function that makes one program for each of several device functions so gives each its own kernel.
    """
    captured = inspect.getclosurevars(program).nonlocals.values()
    return "_".join([program.__name__, *(f.key for f in captured if isinstance(f, wp.Function))])


def module_of(kind: str, name: str = FORWARD) -> wp.Module:
    """The Warp module `name` for "cpu" or "cuda"."""
    module = wp.get_module(f"{name}.{kind}")
    module.options.update(enable_backward=False, fuse_fp=kind == "cuda", cpu_compiler_flags=CPU_FLAGS)
    return module


_meeting = wp.kernel(strips_meet, module=module_of("cpu"))


@exclusive
def strips(count: int, device: wp.Device) -> list[Strip]:
    """The strips of a CPU, `count` of them; a graph of the same launches is captured with each."""
    counter = wp.zeros(2, dtype=wp.int32, device=device)
    return [Strip(index, count, counter, _meeting) for index in range(count)]
