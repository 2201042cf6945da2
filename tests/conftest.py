"""Shared by all tests: the device and the precision."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from wfluid.device import load_kernels, open_device
from wfluid.fluid import Fluid
from wfluid.grid import Grid
from wfluid.solver import Solver

DOUBLE = os.environ.get("WFLUID_PRECISION") == "float64"


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", help="device the tests run on: cpu, cuda, …")


def pytest_collection_modifyitems(config, items):
    """Tests marked float64 run in a process of their own: precision is chosen once a process.

    It begins with the others and runs beside them; the test that tells how it went comes last.
    """
    wanted = [item for item in items if (item.get_closest_marker("float64") is not None) == DOUBLE]
    config.hook.pytest_deselected(items=[item for item in items if item not in wanted])
    items[:] = sorted(wanted, key=lambda item: "double_precision" in item.fixturenames)
    if items and "double_precision" in items[-1].fixturenames and not config.option.collectonly:
        config.stash[DOUBLE_PRECISION] = DoublePrecision(config.getoption("--device"))


class DoublePrecision:
    """Everything marked float64, running in a process beside this one."""

    def __init__(self, device):
        command = [sys.executable, "-m", "pytest", "-m", "float64", str(Path(__file__).parent)]
        command += ["--device", device, "-p", "no:cacheprovider"]
        environment = dict(os.environ, WFLUID_PRECISION="float64")
        self._said = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(command, env=environment, stdout=self._said, stderr=self._said)

    def result(self):
        """Exit code and output, once it has ended."""
        code = self._process.wait(timeout=900)
        self._said.seek(0)
        return code, self._said.read()

    def stop(self):
        """End it, if the others were stopped."""
        self._process.kill()
        self._process.wait()


DOUBLE_PRECISION = pytest.StashKey[DoublePrecision]()


def pytest_unconfigure(config):
    if DOUBLE_PRECISION in config.stash:
        config.stash[DOUBLE_PRECISION].stop()


@pytest.fixture
def double_precision(request):
    """The process that runs what is marked float64."""
    return request.config.stash[DOUBLE_PRECISION]


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
