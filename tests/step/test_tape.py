"""`tape.backward()` plays the transpose of a step that a `wp.Tape` recorded, with all its stages.

    <y, F(x + h e) - F(x - h e)> / 2h = <F'(x)^T y, e>

for a step F about a state x, noise y, and noise e in one array of x after the other. With h = 1e-5 the
difference is wrong by h^2 = 1e-10 times third derivatives, and by the rounding eps / h = 2e-11 of each
product, some of a hundred sizes of the result: 1e-8 of the sum of the products' sizes. Where the transpose
of a stage is missing both sides are apart by 1e-5 of it or more.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import warp as wp
from inner_products import inner
from viscous_media import DT, centres, disc, frozen

import wfluid.gradient.functional  # noqa: F401 - all of the adjoint's kernels, before any is loaded
from wfluid import Buoyancy, Density, Fluid, GaussianForce, Grid, Growth, Painted, Source
from wfluid.fields.arrays import from_numpy, to_numpy
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.step import advection, coefficients, creeping, densities, diffusion, feet, forcing, projection
from wfluid.step.forcing import Forcing
from wfluid.step.inertial import InertialStep
from wfluid.step.kinds import step_for
from wfluid.step.tape import record, recording

GRID = Grid(23, 18, 1.0, 0.7)
H = 1e-5
TOLERANCE = 1e-8

PUSH = GaussianForce((0.4, 0.3), (2.0, -1.0), 0.2)
BUOYANCY = Buoyancy("ink", (0.5, -3.0))
GROWTH = Growth((0.6, 0.4), 1.5, 0.2)
INK = Density("ink", diffusion=1e-3, sources=[Source((0.5, 0.4), 2.0, 0.1)])
X, Y = centres(GRID)
SMOOTH = 0.01 + 0.02 * np.exp(-((X - 0.5) ** 2 + (Y - 0.4) ** 2) / 0.05)
FREEZE = frozen(np.where(disc(GRID, 0.7, 0.4, 0.1), 10.0, 0.0))
SOLVED = {"diffusion_tolerance": 1e-12}
CREEPING = {"inertia": False, "pressure_tolerance": 1e-12}

CASES = {
    "constant": ({"viscosity": 0.01}, (PUSH, BUOYANCY, GROWTH)),
    "still": ({"viscosity": 0.0, "walls": "periodic"}, ()),
    "paper": ({"viscosity": 0.01, "scheme": "paper", "walls": "free-slip,periodic"}, (PUSH,)),
    "paper, painted": (
        {"viscosity": SMOOTH, "freeze": FREEZE, "scheme": "paper", "walls": "no-slip,periodic"},
        (PUSH, BUOYANCY, GROWTH),
    ),
    "painted": ({"viscosity": SMOOTH, "walls": "no-slip"}, (PUSH,)),
    "frozen": ({"viscosity": SMOOTH, "freeze": FREEZE, "pressure_tolerance": 1e-12, **SOLVED}, (PUSH,)),
    "moves": ({"viscosity": SMOOTH, "viscosity_moves": True, **SOLVED}, (PUSH, BUOYANCY)),
    "creeping": ({"viscosity": 0.01, **CREEPING}, (PUSH, BUOYANCY, GROWTH)),
    "creeping, frozen": ({"viscosity": SMOOTH, "freeze": FREEZE, "walls": "no-slip", **CREEPING}, (PUSH,)),
    "creeping, moves": ({"viscosity": SMOOTH, "viscosity_moves": True, **CREEPING}, (PUSH, GROWTH)),
}
"""Fluids and forces. Each stage occurs in some case; each optional stage is missing in some other."""


class Recorded:
    """A step between two states with gradients, about a smooth flow; `speed` times as fast."""

    def __init__(self, device, fluid, forces, points=((7.3, 5.1), (15.8, 12.4)), speed=1.0):
        self.fluid = Fluid(densities=[INK], **fluid)
        self.step = step_for(GRID, self.fluid, device)
        self.step.allow_gradients()
        self.step.plan(DT, DT, self.step.update_coefficients)
        self.forcing = Forcing(forces, self.fluid, GRID, device, gradients=True)
        self.forcing.set(forces, self.fluid, 0.0, DT, DT, pressure_part=0.7)
        self.before, self.after, bar, after_bar = (
            State.at_rest(GRID, device, 1, len(points)) for _ in range(4)
        )
        self.before.take_gradient(bar)
        self.after.take_gradient(after_bar)
        centre = Ghosts(self.step.layout, self.fluid.walls.centre_rules(), device)
        self._ghosts = [*self.step.velocity_ghosts, *self.step.moved_ghosts, centre, centre]
        i, j = np.meshgrid(np.arange(23.0), np.arange(18.0))
        waves = np.sin(0.3 * i + 0.2), np.cos(0.4 * j - 0.1), np.sin(0.2 * (i + j) + 0.1)
        u, v = speed * 0.4 * waves[1] * waves[0], speed * 0.3 * waves[2] * waves[1]
        self.start = [u, v, waves[2], waves[0] * waves[1], 0.01 * waves[0], 8.0 + 0.7 * i + 0.4 * j]
        self.start += [np.array(column) for column in zip(*points, strict=True)]
        self.names = ["u", "v", "d_x", "d_y", "q", "rho", "p_x", "p_y"]
        if not self.step.keeps_pressure:  # the pressure is not used
            self.start[4] = np.zeros_like(u)

    def arrays(self, state):
        return [*state.fields, *state.particles]

    def set(self, values):
        """Set the arrays of the state before, with their ghosts."""
        for f, own, ghosts in zip(self.arrays(self.before), values, [*self._ghosts, None, None], strict=True):
            if ghosts is None:
                f.assign(own)
            else:
                from_numpy(own, f, self.step.layout)
                ghosts.fill(f)

    def advance(self):
        self.step.advance(self.before, self.after, self.forcing)

    def record(self):
        """Record the step from the start, and set the gradients of the state after it to noise."""
        self.set(self.start)
        with recording() as tape:
            self.advance()
        self.ask()
        return tape

    def ask(self):
        random = np.random.default_rng(2)
        for f in self.arrays(self.after):
            values = random.standard_normal(self.start[0].shape if f.size > 100 else f.size)
            self._put(values, f.grad)
        if not self.step.keeps_pressure:
            self.after.q.grad.zero_()
        self.asked = [wp.clone(f.grad) for f in self.arrays(self.after)]

    def _put(self, values, f):
        f.zero_()
        from_numpy(values, f, self.step.layout) if values.ndim > 1 else f.assign(values)

    def gradients(self):
        """With respect to the cells and points of the state before, copies."""
        layout = self.step.layout
        cells = [to_numpy(f.grad, layout) for f in self.before.fields]
        return cells + [f.grad.numpy().copy() for f in self.before.particles]

    def product(self, xs, ys):
        """<x, y> over cells and points, and the sum of the products' sizes."""
        total, size = inner(xs[:6], ys[:6], self.step.layout)
        for x, y in zip(xs[6:], ys[6:], strict=True):
            total, size = total + x.numpy() @ y.numpy(), size + np.abs(x.numpy() * y.numpy()).sum()
        return total, size

    def errors(self):
        """By array of the state before: the difference of both sides over the sum of products' sizes."""
        self.record().backward()
        gradients = [wp.clone(f.grad) for f in self.arrays(self.before)]
        errors = {}
        for n, name in enumerate(self.names):
            if name == "q" and not self.step.keeps_pressure:
                continue
            e = np.random.default_rng(n).standard_normal(self.start[n].shape)
            ends = []
            for h in (H, -H):
                self.set([own + h * e if m == n else own for m, own in enumerate(self.start)])
                self.advance()
                ends.append([wp.clone(f, requires_grad=False) for f in self.arrays(self.after)])
            for plus, minus in zip(*ends, strict=True):
                plus.assign((plus.numpy() - minus.numpy()) / (2 * H))
            left, size = self.product(self.asked, ends[0])
            changed = [np.zeros_like(own) for own in self.start]
            changed[n] = e
            self.set(changed)
            right, _ = self.product(gradients, self.arrays(self.before))
            errors[name] = abs(left - right) / size if size else abs(left)
        return errors


@pytest.mark.float64
@pytest.mark.parametrize("name", CASES)
def test_the_tape_plays_the_transpose_of_a_step(device, name):
    """The inner products agree for each array of the state before, for all fluids and forces."""
    errors = Recorded(device, *CASES[name]).errors()
    assert max(errors.values()) <= TOLERANCE, errors


@pytest.mark.float64
@pytest.mark.parametrize("walls", ["free-slip", "no-slip", "periodic,free-slip"])
@pytest.mark.parametrize("scheme", ["standard", "paper"])
def test_what_a_wall_stops_is_transposed(device, scheme, walls):
    """A foot or a point that would go beyond a wall stays on it, however the velocity changes."""
    points = np.random.default_rng(3).uniform(0, (23, 18), (40, 2))
    # in the paper's scheme points move with the diffused and projected velocity: little is taken from it
    taken = {"viscosity": 0.0, "sweeps": 1} if scheme == "paper" else {"viscosity": 0.01}
    fluid = {"scheme": scheme, "walls": walls, **taken}
    recorded = Recorded(device, fluid, (), points, speed=30.0)
    errors = recorded.errors()
    recorded.record()
    j, i = np.mgrid[:18, :23] + 0.5
    feet_x, feet_y = (to_numpy(f, recorded.step.layout) for f in recorded.step.feet.foot)
    feet_stopped = np.isin(i + feet_x, (0, 23)) | np.isin(j + feet_y, (0, 18))
    points_stopped = np.isin(recorded.after.p_y.numpy(), (0, 18))
    assert feet_stopped.sum() > 20 and points_stopped.any()
    assert max(errors.values()) <= TOLERANCE, errors


STAGES = {
    "trace": (feet.Feet, "_trace_back", "constant"),
    "points": (feet.Feet, "_carry_points_back", "constant"),
    "velocity": (advection.Advection, "_carry_velocity_back", "constant"),
    "map": (advection.Advection, "_carry_map_back", "constant"),
    "density": (densities.DensityTransport, "_advance_back", "constant"),
    "forces": (forcing.Forcing, "_push_back", "constant"),
    "diffusion": (diffusion.SeparateDiffusion, "_diffuse_back", "constant"),
    "projection": (projection.Projection, "_project_back", "constant"),
    "coupled diffusion": (diffusion.CoupledDiffusion, "_diffuse_back", "moves"),
    "pressure taken off": (projection.Projection, "_subtract_pressure_back", "moves"),
    "pressure added": (projection.Projection, "_add_pressure_back", "moves"),
    "viscosity carried": (coefficients.Coefficients, "_carry_back", "moves"),
    "load of a creeping flow": (creeping.CreepingStep, "_load_back", "creeping"),
    "creeping flow": (creeping.CreepingStep, "_answer_back", "creeping"),
}
"""The transpose of each stage, and a step that has the stage."""


@pytest.mark.float64
@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_without_its_transpose_on_the_tape_fails_the_test_of_the_step(device, monkeypatch, stage):
    """A stage that launches but does not record its transpose makes the inner products differ."""
    kind, transpose, case = STAGES[stage]

    def recorded(backward, reads, writes):
        if backward.func.__name__ != transpose or not isinstance(backward.func.__self__, kind):
            record(backward, reads, writes)

    for module in (advection, coefficients, creeping, densities, diffusion, feet, forcing, projection):
        monkeypatch.setattr(module, "record", recorded)
    errors = Recorded(device, *CASES[case]).errors()
    assert max(errors.values()) > 1e3 * TOLERANCE, errors


@pytest.mark.float64
def test_every_stage_of_a_step_is_in_the_list_of_stages(device):
    """The tapes of all cases hold the transposes in `STAGES`, and the record that clears gradients."""
    found = set()
    for case in CASES.values():
        tape = Recorded(device, *case).record()
        found |= {(type(launch.func.__self__), launch.func.__name__) for launch in tape.launches}
    assert found == {(kind, name) for kind, name, _ in STAGES.values()} | {
        (kind, "_clear_gradients") for kind in (InertialStep, creeping.CreepingStep)
    }


@pytest.mark.float64
@pytest.mark.parametrize("name", CASES)
def test_recompute_restores_all_that_transposes_read(device, name):
    """After another step has overwritten the arrays between stages, the gradient has the same bits."""
    recorded = Recorded(device, *CASES[name])
    tape, step = recorded.record(), recorded.step
    tape.backward()
    expected = recorded.gradients()
    between = [*step.feet.foot, *step.map_feet.foot, *step.pushed]
    if recorded.fluid.inertia:
        between += [*step.advection.carried, *step.projection.without_pressure]
        between += [step.projection.q, *step.diffusion.out]
    for f in between:
        f.fill_(np.nan)
    if recorded.fluid.viscosity_moves:
        step.coefficients.levels[0].mu.fill_(7.0)  # finite: what lies beyond its ghosts has weight 0
    recorded.ask()
    step.recompute(recorded.before, recorded.after, recorded.forcing)
    tape.backward()
    for found, wanted in zip(recorded.gradients(), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_without_a_tape_nothing_is_recorded_or_allocated(device, monkeypatch):
    """A step on a tape has the same number of launches as one without."""
    fluid = Fluid(viscosity=Painted(SMOOTH), viscosity_moves=True, densities=[INK])
    states = [State.at_rest(GRID, device, 1, 1) for _ in range(2)]
    forces = (PUSH, BUOYANCY)
    counts = []
    launch = wp.launch

    def counted(*arguments, **settings):
        counts[-1] += 1
        return launch(*arguments, **settings)

    step, acting = InertialStep(GRID, fluid, device), Forcing(forces, fluid, GRID, device)
    step.plan(DT, DT, step.update_coefficients)
    acting.set(forces, fluid, 0.0, DT, DT)
    monkeypatch.setattr(wp, "launch", counted)
    monkeypatch.setattr(wp.Tape, "record_func", lambda *_: pytest.fail("something was recorded"))
    counts.append(0)
    step.advance(*states, acting)
    between = [
        *step.feet.foot,
        *step.map_feet.foot,
        *step.pushed,
        *step.advection.carried,
        *step.projection.without_pressure,
    ]
    assert all(f.grad is None for f in (*states[0].arrays, *states[1].arrays, *between))
    monkeypatch.undo()
    monkeypatch.setattr(wp, "launch", counted)
    for state in states:
        state.take_gradient(State.at_rest(GRID, device, 1, 1))
    step.allow_gradients()
    counts.append(0)
    with recording() as tape:
        step.advance(*states, acting)
    assert tape.launches and counts[0] == counts[1] > 10


def test_a_step_in_another_thread_is_not_recorded_on_this_tape(device):
    """The tape is that of the thread, so two threads can each have a solver."""
    states = [State.at_rest(GRID, device) for _ in range(2)]
    step, acting = InertialStep(GRID, Fluid(), device), Forcing((), Fluid(), GRID, device)
    step.plan(DT, DT, step.update_coefficients)
    with recording() as tape, ThreadPoolExecutor(1) as other:
        other.submit(step.advance, *states, acting).result()
    assert not tape.launches


def test_recording_a_stage_without_gradients_is_refused(device):
    """Else the backward pass would be wrong without an error."""
    states = [State.at_rest(GRID, device) for _ in range(2)]
    step, acting = InertialStep(GRID, Fluid(), device), Forcing((), Fluid(), GRID, device)
    step.plan(DT, DT, step.update_coefficients)
    with pytest.raises(RuntimeError, match="missing a gradient"), recording():
        step.advance(*states, acting)


def test_allowing_gradients_twice_keeps_the_arrays(device):
    """Captured graphs contain the addresses of the transposes' arrays."""
    step = InertialStep(GRID, Fluid(densities=[INK]), device)
    stages = (step.feet, step.advection, step.projection, *step.densities)
    step.allow_gradients()
    before = [dict(vars(stage)) for stage in stages]
    step.allow_gradients(of_viscosity=True)
    for stage, own in zip(stages, before, strict=True):
        assert all(vars(stage)[name] is value for name, value in own.items())
