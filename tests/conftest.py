"""Shared by all tests: the device and the precision."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from wfluid.domain.grid import Grid
from wfluid.fields.device import load_kernels, open_device
from wfluid.model.fluid import Fluid
from wfluid.step.solver import Solver

DOUBLE = os.environ.get("WFLUID_PRECISION") == "float64"


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", help="device the tests run on: cpu, cuda, …")


def pytest_collection_modifyitems(config, items):
    """Tests marked float64 run in a process of their own: precision is chosen once a process.

    So do those marked beside, which take long, where the whole suite runs. Their processes run one
    after the other beside this one; the tests that tell how they went come last.
    """
    telling = any("apart" in item.fixturenames for item in items)
    double = [item for item in items if item.get_closest_marker("float64")]
    beside = [item for item in items if item.get_closest_marker("beside") and item not in double]
    if DOUBLE:
        wanted = double
    elif os.environ.get("WFLUID_BESIDE"):
        wanted = beside
    else:
        elsewhere = {*double, *(beside if telling else ())}
        wanted = [item for item in items if item not in elsewhere]
    config.hook.pytest_deselected(items=[item for item in items if item not in wanted])
    items[:] = sorted(wanted, key=lambda item: "apart" in item.fixturenames)
    if items and "apart" in items[-1].fixturenames and not config.option.collectonly:
        device = config.getoption("--device")
        environments = {"float64": {"WFLUID_PRECISION": "float64"}, "beside": {"WFLUID_BESIDE": "1"}}
        config.stash[APART] = Apart(environments, device)


class Apart:
    """Everything under some marks, running beside this process: a process a mark, one after the other."""

    def __init__(self, environments, device):
        """`environments` are what each mark's process has beside this one's variables."""
        self._environments, self._device = environments, device
        self._ended = {mark: threading.Event() for mark in environments}
        self._results, self._process, self._stopped = {}, None, False
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        for mark, environment in self._environments.items():
            command = [sys.executable, "-m", "pytest", "-m", mark, str(Path(__file__).parent)]
            command += ["--device", self._device, "-p", "no:cacheprovider"]
            if not self._stopped:
                settings = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
                self._process = subprocess.Popen(command, env={**os.environ, **environment}, **settings)
                said = self._process.communicate()[0]
                self._results[mark] = self._process.returncode, said
            self._ended[mark].set()

    def result(self, mark):
        """Exit code and output of a mark's process, once it has ended."""
        assert self._ended[mark].wait(timeout=900)
        return self._results[mark]

    def stop(self):
        """End it, if the others were stopped."""
        self._stopped = True
        if self._process:
            self._process.kill()


APART = pytest.StashKey[Apart]()


def pytest_unconfigure(config):
    if APART in config.stash:
        config.stash[APART].stop()


@pytest.fixture
def apart(request):
    """What runs in processes beside this one."""
    return request.config.stash[APART]


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
