"""Strips: threads that share the rows of a step compute what one thread does, and never wait for ever."""

import subprocess
import sys
import threading

import numpy as np
import pytest
import warp as wp
from wfluid.kernels.cell.program import strips
from wfluid.kernels.cell.strips import GIVEN_UP, STRIP, repeat_while, share, together

import wfluid.fields.device
import wfluid.step.step
from wfluid import (
    Buoyancy,
    Density,
    Fluid,
    Freeze,
    GaussianForce,
    Grid,
    Growth,
    NoiseForce,
    Painted,
    Solver,
    Source,
    VortexForce,
)
from wfluid.fields.graph import CapturedGraph
from wfluid.system.threads import helpers

FORCE = GaussianForce((0.4, 0.5), (2.0, 1.0), 0.08)
WEIGHTED = GaussianForce((0.6, 0.4), (-1.0, 1.0), 0.1, weight=Painted(np.eye(4)))

DISC = np.hypot(*(np.mgrid[0:96, 0:128] / 96 - 0.5)) < 0.2

FLUIDS = {
    "constant": {"viscosity": 0.001},
    "paper": {"scheme": "paper", "sweeps": 5},
    "paper, painted": {"scheme": "paper", "sweeps": 5, "viscosity": np.where(DISC, 1.0, 0.001)},
    "periodic": {"walls": "periodic"},
    "smooth": {"viscosity": 0.02 + 0.01 * np.cos(np.arange(128) / 20) * np.ones((96, 1))},
    "jump": {"viscosity": np.where(DISC, 1.0, 0.001)},
    "moves": {"viscosity": np.where(DISC, 1.0, 0.001), "viscosity_moves": True},
    "frozen": {"freeze": Freeze(DISC.astype(float))},
    "no-slip": {"walls": "no-slip,periodic"},
}


@pytest.fixture
def cpu(device):
    if device.is_cuda:
        pytest.skip("strips are for CPU threads")
    return device


def test_a_grid_of_few_rows_is_left_to_the_first_strip(cpu, monkeypatch):
    """No launch is shared, every meeting is a loop's, and both threads come to the end."""
    monkeypatch.setattr(wfluid.step.step, "SHARED_CELLS", 0)
    monkeypatch.setattr(wfluid.step.step, "free_cores", lambda: 2)
    mu = np.where(np.arange(160) % 40 < 20, 1.0, 0.001) * np.ones((30, 1))
    solver = Solver(Grid(160, 30, 1.0, 30 / 160), Fluid(viscosity=mu), cpu)
    a, b = solver.rest(), solver.rest()
    for step in range(100):
        solver.step(a, b, [FORCE], step / 24, 1 / 24)
        a, b = b, a
    assert solver.report().diffusion.method == "conjugate gradients"


@pytest.mark.parametrize("name", FLUIDS)
def test_two_threads_compute_the_bits_of_one(cpu, monkeypatch, name):
    """Velocity, map and pressure of steps shared by two threads equal those of one, exactly."""
    states = []
    for threads in (1, 2):
        monkeypatch.setattr(wfluid.step.step, "SHARED_CELLS", 0 if threads == 2 else 10**9)
        monkeypatch.setattr(wfluid.step.step, "free_cores", lambda: 2)
        solver = Solver(Grid(128, 96, 1.0, 0.7), Fluid(**FLUIDS[name]), cpu)
        assert (solver._pool is not None) == (threads == 2)
        a, b = solver.rest(), solver.rest()
        for step in range(4):
            solver.step(a, b, [FORCE, WEIGHTED], step / 24, 1 / 24)
            a, b = b, a
        states.append([f.numpy() for f in (a.u, a.v, a.d_x, a.d_y, a.q)])
    for one, two in zip(*states, strict=True):
        np.testing.assert_array_equal(one, two)
    assert np.abs(states[0][0]).max() > 0.01


def test_two_threads_compute_the_bits_of_one_under_every_force(cpu, monkeypatch):
    """Pushes, growth with its mean, fields, buoyancy, a density that cycles diffuse, and points."""
    random = np.random.default_rng(0)
    drop = Source((0.5, 0.4), 2.0, 0.1)
    ink = Density(diffusion=0.05, initial=Painted(random.random((9, 9))), sources=[drop])
    forces = [
        FORCE,
        WEIGHTED,
        VortexForce((0.3, 0.4), 3.0, 0.1),
        Growth((0.6, 0.4), 1.0, 0.1),
        NoiseForce(strength=1.0, period=1.0),
        Buoyancy("ink", (0.0, -1.0)),
    ]
    states = []
    monkeypatch.setattr(wfluid.step.step, "free_cores", lambda: 2)
    for least in (0, 10**9):
        monkeypatch.setattr(wfluid.step.step, "SHARED_CELLS", least)
        solver = Solver(Grid(129, 97, 1.0, 0.7), Fluid(densities=[ink]), cpu)
        a, b = (solver.rest([(0.5, 0.5), (0.2, 0.3)]) for _ in range(2))
        for step in range(4):
            solver.step(a, b, forces, step / 24, 1 / 24)
            a, b = b, a
        states.append([f.numpy() for f in (a.u, a.v, a.d_x, a.d_y, *a.rho, a.p_x, a.p_y)])
    for one, two in zip(*states, strict=True):
        np.testing.assert_array_equal(one, two)
    assert np.abs(states[0][0]).max() > 0.01


def test_shares_cover_every_line_once(cpu):
    """Many lines are cut into parts that follow on one another, few are left to the first strip."""
    for lines in (1, 47, 48, 49, 1000):
        for count in (2, 3, 8):
            parts = [strip.share(5, 5 + lines) for strip in strips(count, cpu)]
            ends = [5, *(end for _, end in parts)]
            covered = [n for first, end in parts for n in range(first, end)]
            assert covered == list(range(5, 5 + lines)), parts
            assert ends == sorted(ends)
    assert share(3, 9) == (3, 9)


def meetings(cpu, launches):
    """How often one strip meets the others during `launches`."""
    counter = wp.zeros(2, dtype=wp.int32, device=cpu)
    (strip,) = strips(1, cpu)
    strip.counter = counter
    token = STRIP.set(strip)
    try:
        launches(strip)
    finally:
        STRIP.reset(token)
    return int(counter.numpy()[0])


def test_strips_meet_only_where_one_may_read_what_another_wrote(cpu):
    def shared(strip):
        strip.share(0, 100)

    def few(strip):
        strip.share(0, 10)

    def in_turn(*launches):
        return lambda strip: [launch(strip) for launch in launches]

    def at_once(*launches):
        def run(strip):
            with together():
                in_turn(*launches)(strip)

        return run

    assert meetings(cpu, in_turn(shared)) == 0
    assert meetings(cpu, in_turn(shared, shared, shared)) == 2
    assert meetings(cpu, in_turn(few, few, few)) == 0
    assert meetings(cpu, in_turn(few, shared, few, few, shared)) == 3
    assert meetings(cpu, at_once(shared, shared, shared)) == 0
    assert meetings(cpu, in_turn(shared, at_once(shared, few, shared), shared)) == 2
    assert meetings(cpu, in_turn(few, at_once(few, shared), few)) == 2


def test_a_loop_in_a_graph_runs_as_often_on_every_strip(cpu):
    """Every strip reads the same condition, though the first changes it."""
    going, passes = wp.array([1], dtype=wp.int32), wp.zeros(1, dtype=wp.int32)

    def body():
        if STRIP.get().alone():
            wp.launch(count_down, dim=1, inputs=[passes, going], device=cpu)

    replay = CapturedGraph(cpu, lambda: repeat_while(going, body), helpers(2))
    for _ in range(300):  # a strip that read the condition late would leave the other waiting
        going.assign([1])
        passes.zero_()
        replay.launch()
        assert passes.numpy()[0] == 5
    assert replay._strips[0].counter.numpy()[0] == 300 * 2 * 12


@wp.kernel(module="tests.strips")
def count_down(passes: wp.array[int], going: wp.array[int]):
    passes[0] = passes[0] + 1
    going[0] = int(passes[0] < 5)


def test_an_interrupted_step_leaves_no_thread_waiting(cpu, monkeypatch):
    """The calling thread is stopped before its strip: the other ends, and the next step is right."""
    monkeypatch.setattr(wfluid.step.step, "SHARED_CELLS", 0)
    monkeypatch.setattr(wfluid.step.step, "free_cores", lambda: 2)
    solver = Solver(Grid(128, 96, 1.0, 0.7), Fluid(), cpu)
    a, b, c = solver.rest(), solver.rest(), solver.rest()
    solver.step(a, b, [FORCE], 0.0, 0.1)
    expected = b.velocity[0]
    launch, main_thread = wp.capture_launch, threading.current_thread()

    def interrupted(graph):
        if threading.current_thread() is main_thread:
            raise KeyboardInterrupt
        launch(graph)

    monkeypatch.setattr(wp, "capture_launch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solver.step(a, b, [FORCE], 0.0, 0.1)
    monkeypatch.setattr(wp, "capture_launch", launch)
    (replay, *_) = next(iter(solver._replays.values()))
    assert replay._strips[0].counter.numpy().tolist() == [0, 0] and GIVEN_UP == 1
    solver.step(a, b, [FORCE], 0.0, 0.1)
    solver.step(a, c, [FORCE], 0.0, 0.1)
    np.testing.assert_array_equal(b.velocity[0], expected)
    np.testing.assert_array_equal(c.velocity[0], expected)


def test_a_forked_process_steps_with_threads_of_its_own(cpu):
    """The child has inherited no helper; it must not wait for one."""
    code = (
        "import os, wfluid.step.step as module\n"
        "from wfluid import Fluid, Grid, Solver\n"
        "from wfluid.fields.device import open_device\n"
        "module.SHARED_CELLS, module.free_cores = 0, lambda: 2\n"
        "solver = Solver(Grid(64, 64), Fluid(), open_device())\n"
        "a, b = solver.rest(), solver.rest()\n"
        "solver.step(a, b, [], 0.0, 0.1)\n"
        "child = os.fork()\n"
        "solver.step(a, b, [], 0.0, 0.1)\n"
        "os._exit(0) if child == 0 else print(os.waitpid(child, 0)[1])\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert result.stdout.strip() == "0", result.stderr
