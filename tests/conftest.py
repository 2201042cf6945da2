"""Shared by all tests: the device and the precision."""

import os

import pytest

from wfluid.device import load_kernels, open_device
from wfluid.fluid import Fluid
from wfluid.grid import Grid
from wfluid.solver import Solver

DOUBLE = os.environ.get("WFLUID_PRECISION") == "float64"


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", help="device the tests run on: cpu, cuda, …")


def pytest_collection_modifyitems(config, items):
    """Tests marked float64 run only in the process that test_precision starts for them."""
    wanted = [item for item in items if (item.get_closest_marker("float64") is not None) == DOUBLE]
    config.hook.pytest_deselected(items=[item for item in items if item not in wanted])
    items[:] = wanted


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
