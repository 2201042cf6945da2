"""Shared by all tests: the device, the precision, and which tests are long."""

import os

import pytest

from wfluid.domain.grid import Grid
from wfluid.fields.device import load_kernels, open_device
from wfluid.model.fluid import Fluid
from wfluid.step.solver import Solver

DOUBLE = os.environ.get("WFLUID_PRECISION") == "float64"


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", help="device the tests run on: cpu, cuda, …")
    parser.addoption("--long", action="store_true", help="run the tests marked long too")
    parser.addoption("--fuzz", type=int, default=500, help="number of mutated files that are read")


def pytest_collection_modifyitems(config, items):
    """Keep the tests of this process's precision, and the long ones where they are asked for.

    Warp's number type is chosen once a process, by WFLUID_PRECISION.
    """

    def runs(item):
        is_double, is_long = (item.get_closest_marker(mark) is not None for mark in ("float64", "long"))
        return is_double == DOUBLE and (not is_long or config.getoption("--long"))

    config.hook.pytest_deselected(items=[item for item in items if not runs(item)])
    items[:] = filter(runs, items)


@pytest.fixture(scope="session")
def device(request):
    device = open_device(request.config.getoption("--device"))
    load_kernels(device)
    return device


@pytest.fixture
def make_solver(device):
    """A solver for nx, ny and the keywords of Fluid; cells are `stretch` times as high as wide.

    Or for a `grid` of its own.
    """

    def make(nx, ny, stretch=0.93, grid=None, **fluid):
        longer = max(nx, ny)
        return Solver(grid or Grid(nx, ny, nx / longer, stretch * ny / longer), Fluid(**fluid), device)

    return make
