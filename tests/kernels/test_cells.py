"""The per-cell machinery: layout, spans, devices, vectorisable reads."""

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.layout import HALO, SPAN, Layout
from wfluid.kernels.cell.program import ADJOINT, FORWARD, Program, cells, module_of
from wfluid.kernels.cell.real import Field, Real, RowReal, Uniform
from wfluid.kernels.solve import five_point
from wfluid.kernels.step import advection

from wfluid import kernels
from wfluid.fields.arrays import from_numpy, to_numpy


def numbered(i: int, j: int, k: int, factor: Uniform, row: RowReal, out: Field):
    out[k] = factor * (row + Real(i))


numbered = cells(numbered, module="tests.numbered")


@pytest.mark.parametrize("size", [(4, 4), (63, 5), (64, 3), (65, 2), (200, 7)], ids=str)
def test_every_cell_is_visited_once_with_its_row_and_column(device, size):
    layout = Layout(*size)
    out = wp.full(layout.size, -1.0, dtype=Real, device=device)
    factor = wp.array([2.0], dtype=Real, device=device)
    rows = wp.array(1000.0 * np.arange(size[1]), dtype=Real, device=device)
    numbered.launch(layout, device, [factor, rows], [out])
    expected = 2 * (np.arange(size[0]) + 1000 * np.arange(size[1])[:, None])
    np.testing.assert_array_equal(to_numpy(out, layout), expected)


@pytest.mark.parametrize("size", [(4, 4), (63, 5), (64, 3), (65, 2)], ids=str)
def test_a_span_never_leaves_its_row(device, size):
    """What a program writes past a row stays before the next row's cells and halo."""
    layout = Layout(*size)
    out = wp.full(layout.size, -1.0, dtype=Real, device=device)
    factor = wp.array([1.0], dtype=Real, device=device)
    rows = wp.zeros(size[1], dtype=Real, device=device)
    numbered.launch(layout, device, [factor, rows], [out], rows=(0, 1))
    written = np.flatnonzero(out.numpy() != -1)
    assert written[0] == layout.first
    assert written[-1] <= layout.first + layout.pitch - 2 * HALO - 1


def programs():
    """Every per-cell program of the package, by name."""
    for folder in kernels.__all__:
        package = getattr(kernels, folder)
        for name in package.__all__:
            for attribute, value in vars(getattr(package, name)).items():
                home = f"wfluid.kernels.{folder}.{name}"
                if isinstance(value, Program) and value.func.module.name == home:
                    yield pytest.param(value, id=f"{folder}.{name}.{attribute}")


@pytest.mark.parametrize(
    ("program", "inputs"),
    [
        (five_point.residual, lambda a, n, p: [a[0], a[1], n[0:1], n[1:2], n[2:3], p]),
        (advection.trace_midpoint, lambda a, n, p: [a[0], a[1], n[0:1], n[1:2], 70, 9, 0, 1, p]),
        (advection.advect_face_cubic, lambda a, n, p: [a[0], a[1], a[2], p, 70, 9, 0, 1, p]),
    ],
    ids=["residual", "trace_midpoint", "advect_face_cubic"],
)
def test_spans_equal_single_cells_bit_for_bit(device, program, inputs):
    """The vectorised kernel and one cell a thread compute the same bits."""
    if device.is_cuda:
        pytest.skip("CUDA kernels run one cell a thread anyhow")
    source = program.func.func
    source.__annotations__.update(ORIGINAL_ANNOTATIONS[program])
    single = cells(source, span=1, module=f"tests.{program.func.key}")
    layout, rng = Layout(70, 9), np.random.default_rng(3)
    arrays = [wp.array(rng.standard_normal(layout.size), dtype=Real, device=device) for _ in range(3)]
    numbers = wp.array([2.5, 0.3, 0.7], dtype=Real, device=device)
    results = []
    for version in (program, single):
        outs = [
            wp.zeros(layout.size, dtype=Real, device=device)
            for _ in range(1 + (program is advection.trace_midpoint))
        ]
        version.launch(layout, device, inputs(arrays, numbers, layout.pitch), outs)
        results.append([to_numpy(out, layout) for out in outs])
    np.testing.assert_array_equal(*results)


ORIGINAL_ANNOTATIONS = {
    five_point.residual: {"centre": Uniform, "ax": Uniform, "ay": Uniform},
    advection.trace_midpoint: {"dt_hx": Uniform, "dt_hy": Uniform},
    advection.advect_face_cubic: {},
}


def test_programs_of_one_source_have_a_kernel_each():
    """Warp tells the kernels of a module apart by name: each name is that of one program and its variant."""
    made = [kernel for param in programs() for kernel in param.values[0].kernels.values()]
    keys = [(kernel.module.name, kernel.key) for kernel in made]
    assert len(keys) == len(set(keys)) > 100
    for variant in ("cubic", "bilinear"):
        assert ("wfluid.cpu", f"advection_advect_face_{variant}_{SPAN}") in keys


@pytest.mark.parametrize("name", [FORWARD, ADJOINT])
def test_every_kernel_compiles_for_cuda_without_a_gpu(tmp_path, name):
    """NVRTC comes with Warp: the CUDA modules build ahead of time on any machine."""
    built = wp.compile_aot_module(module_of("cuda", name), arch=80, module_dir=tmp_path, use_ptx=True)
    text, found = built[0].read_text(), 0
    for program in programs():
        kernel = program.values[0].kernels["cuda"]
        if kernel.module is module_of("cuda", name):
            assert kernel.key in text, f"{kernel.key} is missing from the PTX"
            found += 1
    assert found >= 20


def test_fields_survive_the_way_to_the_device_and_back(device):
    layout = Layout(SPAN + 1, 6)
    f = wp.zeros(layout.size, dtype=Real, device=device)
    values = np.random.default_rng(0).standard_normal((6, SPAN + 1)).astype(np.float32)
    from_numpy(values, f, layout)
    np.testing.assert_array_equal(to_numpy(f, layout), values)
