"""What one thread does on the device while another captures a graph stays out of the capture."""

import subprocess
import sys
import threading

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.lock import LAUNCHES

from wfluid import Density as DensityOf
from wfluid import Fluid, Free, Functional, GaussianForce, Grid, Oscillator, ParticleMisfit, Source, Timeline
from wfluid.animation.loops import Seam, loop_frames
from wfluid.animation.simulation import Simulation
from wfluid.fields.graph import CapturedGraph
from wfluid.morphing.flow_maps import flow_maps
from wfluid.step.solver import Solver

GRID = Grid(24, 16, 1.0, 2 / 3)
TIMELINE = Timeline(0.25, 24)
FORCES = [GaussianForce((0.5, 0.3), (0.4, 0.1), 0.1, Oscillator(period=0.25))]


def oscillate(device):
    """A loop whose picture is untouched after the first lap, and whose frames are written anew."""
    fluid = Fluid(densities=[DensityOf("ink", sources=[Source((0.5, 0.3), rate=1.0, radius=0.1)])])
    run = Simulation(Solver(GRID, fluid, device), TIMELINE, [(0.3, 0.3)])
    return [moment.state.displacement for moment in loop_frames("oscillate", run, FORCES, 6, 24.0, Seam())]


def run_there_and_back(device):
    """Both maps of a flow, whose velocities are kept."""
    flow = flow_maps(Solver(GRID, Fluid(), device), FORCES, TIMELINE)
    return [flow.from_start, flow.to_end]


def search(device):
    """A gradient through a run."""
    misfit = ParticleMisfit([(0.4, 0.3)], [(0.5, 0.3)], time=0.25)
    functional = Functional(
        GRID, Fluid(), FORCES, TIMELINE, misfit, free=[Free("forces[0].vector")], device=device
    )
    return [functional.value_and_gradient(functional.start)[1]]


@pytest.mark.parametrize("work", [oscillate, run_there_and_back, search])
def test_every_call_of_warp_holds_the_lock(device, monkeypatch, work):
    """All that a capture would take in: what is made, copied, written and launched."""
    outside = []

    def spied(call):
        def spy(*arguments, **settings):
            if not LAUNCHES._is_owned():
                outside.append(call.__qualname__)
            return call(*arguments, **settings)

        return spy

    for owner, names in (
        (wp, ("zeros", "full", "empty", "clone", "copy", "launch")),
        (wp.array, ("assign", "fill_", "zero_")),
    ):
        for name in names:
            monkeypatch.setattr(owner, name, spied(getattr(owner, name)))
    work(device)
    assert not outside


@pytest.mark.parametrize("work", [oscillate, run_there_and_back])
def test_a_capture_takes_in_nothing_of_another_thread(device, work):
    """Another thread makes frames all the while: replays of what was captured meanwhile do only their own."""
    expected, found, done = work(device), [], threading.Event()

    def run():
        try:
            found.extend(work(device))
        finally:
            done.set()

    other = threading.Thread(target=run)
    other.start()
    f = wp.zeros(4, dtype=float, device=device)
    graphs = []
    while not done.is_set():
        graphs.append(CapturedGraph(device, lambda: [f.fill_(1.0), f.zero_()], None))
    other.join()
    assert graphs
    for graph in graphs:
        graph.launch()
    for one, other_one in zip(expected, found, strict=True):
        np.testing.assert_array_equal(one, other_one)


def test_a_process_forked_while_a_thread_computes_does_not_wait_for_it():
    """The child has no such thread, so it must not inherit the lock as held."""
    code = (
        "import os, threading, time\n"
        "from wfluid.kernels.cell.lock import LAUNCHES\n"
        "held = threading.Event()\n"
        "def work():\n"
        "    with LAUNCHES:\n"
        "        held.set(); time.sleep(0.5)\n"
        "threading.Thread(target=work).start()\n"
        "held.wait()\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    os._exit(0 if LAUNCHES.acquire(timeout=5) else 1)\n"
        "print(os.waitpid(child, 0)[1])\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert result.stdout.strip() == "0", result.stderr
