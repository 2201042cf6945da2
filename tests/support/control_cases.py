"""Small runs shared by the tests of gradients: fluids, forces, objectives and free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import warp as wp
from oracles import from_streamfunction
from viscous_media import centres, disc
from warp_objectives import mean_square, product
from wfluid.kernels.cell.layout import HALO

from wfluid import (
    Arbitrary,
    Buoyancy,
    Constant,
    Density,
    Fade,
    Fluid,
    Freeze,
    GaussianForce,
    Grid,
    Growth,
    Keyed,
    Oscillator,
    Painted,
    PaintedSource,
    Path,
    Source,
    Stroke,
    Timeline,
    VortexForce,
    Wind,
)
from wfluid.gradient.functional import Functional
from wfluid.gradient.objectives import Effort, Objective, ParticleFunction, ParticleMisfit
from wfluid.gradient.state_objectives import DensityMisfit, MapMisfit, WarpObjective
from wfluid.gradient.variables import Free

GRID = Grid(23, 18, 1.0, 0.7)
"""A grid with different numbers and sizes of cells along x and y."""

TIMELINE = Timeline(5 / 24, fps=24, substeps=2)
"""Ten steps of 1/48 s."""

END, MIDDLE = 10 / 48, 6 / 48
"""Times of objectives [s]."""

EXACT = {"diffusion_tolerance": 1e-13, "pressure_tolerance": 1e-13}
"""Conjugate gradients iterate up to rounding, so that no value jumps when their number changes."""

SURE = {"diffusion_tolerance": 1e-9}
"""The number of cycles is fixed; only a free viscosity needs a tolerance."""


def paint(low, high, seed):
    """A smooth field over the picture, (ny, nx), between two values."""
    rng = np.random.default_rng(seed)
    x, y = centres(GRID)
    hills = sum(np.sin(a * x + b * y + c) for a, b, c in rng.uniform(2, 7, (4, 3)))
    return low + (high - low) * (hills - hills.min()) / np.ptp(hills)


def begin(strength=0.04):
    """A velocity (2, ny, nx) [longer side/s] of a few eddies, without symmetry."""
    u, v = from_streamfunction(
        GRID,
        lambda x, y: strength * (np.sin(5.1 * x + 0.4) * np.sin(6.3 * y + 0.3) + 0.7 * np.cos(4 * x - 7 * y)),
    )
    return np.stack([u[:, :-1], v[:-1]])


WAVE = Oscillator(amplitude=1.3, period=0.3, phase=0.2)
PUSH = GaussianForce((0.42, 0.33), (9.0, 5.0), 0.17, WAVE)
MOVING = GaussianForce(
    Path((0.0, 0.11, 0.3), [(0.2, 0.5), (0.52, 0.37), (0.7, 0.5)]),
    (4.0, -7.0),
    0.13,
    Arbitrary(times=(0.0, 0.07, 0.2), values=(0.6, 1.4, 0.9)),
)
TWIRL = VortexForce((0.66, 0.28), 60.0, 0.14, 0.8 * Fade(rise=0.05, fall=0.08, end=0.2))
GROWTH = Growth((0.35, 0.45), 5.0, 0.16, 1.2 * Oscillator(period=0.5, centred=False))
BRIEF_GROWTH = replace(GROWTH, envelope=Constant(0.0, 0.07))
SOFT_WIND = Wind((5.0, -3.0), WAVE, weight=Painted(paint(0, 1, 8)))
STROKE = Stroke(Path((0.02, 0.08, 0.18), [(0.3, 0.2), (0.6, 0.3), (0.7, 0.5)]), 0.12, 0.7)

POINTS = np.random.default_rng(1).uniform((0.15, 0.12), (0.85, 0.58), (7, 2))
WANTED = POINTS + np.random.default_rng(2).normal(0, 0.05, (7, 2))
PARTICLES = ParticleMisfit(POINTS, WANTED, END, weights=np.linspace(0.5, 2, 7))


def wave(t, places):
    """An objective of positions and time, with its gradient."""
    x, y = places.T
    slope = np.stack([4 * np.cos(4 * x) * np.exp(y) + t, np.sin(4 * x) * np.exp(y)], axis=1)
    return float(np.sum(np.sin(4 * x) * np.exp(y) + t * x)), slope


FUNCTION = ParticleFunction(POINTS[:3] + 0.01, wave, (2 / 48, END))
MAP = MapMisfit(np.stack([paint(-0.05, 0.05, 3), paint(-0.03, 0.06, 4)]), END, Painted(paint(0, 2, 5)))
EARLY_MAP = MapMisfit(np.zeros((2, 18, 23)), MIDDLE)


def far_apart(state, value):
    """An objective of the particles, in Warp."""
    wp.launch(mean_square, len(state.p_x), [state.p_x, state.p_y, value], device=value.device)


def lively(state, value):
    """An objective of the velocity at every cell, in Warp."""
    grid, layout = state.grid, state.layout
    inputs = [state.u, state.v, grid.nx, layout.first, layout.pitch, 1 / (grid.nx * grid.ny), value]
    wp.launch(product, grid.nx * grid.ny, inputs, device=value.device)


def carried(state, value):
    """An objective of a density and the displacement at every cell, in Warp."""
    grid, layout = state.grid, state.layout
    inputs = [state.rho[0], state.d_y, grid.nx, layout.first, layout.pitch, 1 / (grid.nx * grid.ny), value]
    wp.launch(product, grid.nx * grid.ny, inputs, device=value.device)


INK = Density(
    "ink",
    diffusion=0.002,
    initial=Painted(paint(0.5, 2, 6)),
    sources=[
        Source((0.3, 0.4), 6.0, 0.15, WAVE),
        PaintedSource(Painted(paint(0.5, 3, 7)), Arbitrary(times=(0.0, 0.1, 0.3), values=(1.0, 0.4, 1.5))),
    ],
)
SMOKE = Density(
    "smoke",
    diffusion=0.2,
    initial=Painted(paint(1, 2, 9)),
    sources=[Source(MOVING.center, -2.0, 0.2, 0.7 * WAVE)],
)
RISE = Buoyancy("ink", (2.0, -6.0), 1.1 * Constant(0.0, 0.15))
FALL = Buoyancy("smoke", (1.0, 3.0), WAVE)
INK_MISFIT = DensityMisfit("ink", paint(0, 2, 10), END, Painted(paint(0.5, 2, 11)))
SMOKE_MISFIT = DensityMisfit("smoke", paint(0, 2, 12), MIDDLE)


@dataclass(frozen=True)
class Case:
    """A run with its objective and its free parameters."""

    forces: Sequence
    objective: Objective
    free: Sequence[str | Free]
    fluid: dict = field(default_factory=dict)
    velocity: np.ndarray | None = None
    capped: bool = False
    """Whether the run gets only the least memory that it needs."""

    @property
    def names(self):
        """Names of the free parameters."""
        return [one if isinstance(one, str) else one.name for one in self.free]

    def functional(self, device, memory_mb=None, timeline=TIMELINE):
        """The functional of the case."""
        if self.capped and memory_mb is None:
            memory_mb = self.least_memory(device, timeline)
        free = [Free(one) if isinstance(one, str) else one for one in self.free]
        run, settings = (GRID, Fluid(**self.fluid), self.forces, timeline), {"device": str(device)}
        settings |= {"velocity": self.velocity, "memory_mb": memory_mb}
        return Functional(*run, self.objective, free, **settings)

    def least_memory(self, device, timeline=TIMELINE):
        """The least memory [MB], from the message of an error."""
        with pytest.raises(ValueError, match="need at least") as refused:
            self.functional(device, 1e-3, timeline)
        return float(str(refused.value).rpartition(" ")[2])


def cells_of_traces(functional):
    """The cells used by the bilinear look-ups of the last run, step by step.

    Computed from velocities and displacements, independently of the code under test. For every centre it is
    the cell at the middle of the backtrace, and whether a wall stopped the backtrace. In the paper's scheme
    it is the cell at its end, for every face along the velocity after forces, for every centre along the
    velocity after the step. With a moving viscosity also the source. The recording must keep every state.
    """
    recording = functional._recording
    assert recording.schedule.keeps_all
    fluid, layout, steps = functional._recording.step.fluid, recording.step.layout, TIMELINE.steps
    u, v, d_x, d_y = (table.rows(0, steps + 1) for table in recording.loops.states[:4])
    inner = slice(HALO, HALO + layout.ny), slice(HALO, HALO + layout.nx)
    paper, found = fluid.scheme == "paper", []

    def lines(rows):
        end = layout.size // layout.pitch
        return rows[:, : end * layout.pitch].reshape(len(rows), end, layout.pitch)

    flows = ((pushed_velocities(recording), True), ((u[1:], v[1:]), False)) if paper else (((u, v), False),)
    for (flow_u, flow_v), of_faces in flows:
        for rows, h, n, axis in ((flow_u, GRID.hx, GRID.nx, 2), (flow_v, GRID.hy, GRID.ny, 1)):
            f = lines(rows[:steps])
            centre = (f + np.roll(f, -1, axis))[:, *inner] / 2
            offset = -TIMELINE.dt / h * centre * (1 if paper else 0.5)
            if not fluid.walls.periodic[2 - axis]:
                middle = (np.arange(n) + 0.5).reshape((1, n) if axis == 2 else (n, 1))
                stopped = np.clip(offset, -middle, n - middle)
                found.append(stopped != offset)
                offset = stopped
            if of_faces:
                found += [np.floor((offset + np.roll(offset, 1, side)) / 2) for side in (1, 2)]
            else:
                found += [np.floor(offset + shift) for shift in ((0,) if paper else (0, 0.5))]
    if fluid.viscosity_moves:
        found += [np.floor(lines(d[:steps])[:, *inner]) for d in (d_x, d_y)]
    return np.stack(found).astype(int)


def pushed_velocities(recording):
    """u and v after the forces of every step of the last run, (steps, size) each."""
    loops, steps = recording.loops, TIMELINE.steps
    before, forcing, found = loops.working.before, loops.forcing, ([], [])
    for n in range(steps):
        for table, f in zip(loops.states, loops.working.stored(before), strict=True):
            wp.copy(f, table.row(n))
        wp.copy(forcing.numbers, loops.numbers.row(n))
        wp.copy(forcing.boxes, loops.boxes.row(n))
        for f, out in zip(recording.step.push(before, forcing), found, strict=True):
            out.append(f.numpy().copy())
    return [np.stack(rows) for rows in found]


def hard_edge():
    """A freeze mask of a disc with a sharp edge."""
    return Freeze(disc(GRID, 0.7, 0.5, 0.16).astype(float))


SHAPES = ("forces[*].center", "forces[*].radius")
VELOCITY = Free("velocity", scale=0.1)

CASES = {
    "constant viscosity, free-slip": Case(
        [PUSH, MOVING, TWIRL, GROWTH],
        PARTICLES + 2e-4 * Effort(),
        [
            *SHAPES,
            "forces[*].vector",
            "forces[1].center.places",
            Free("forces[2].spin", scale=30.0),
            Free("forces[3].rate", scale=3.0),
            "forces[0].envelope.amplitude",
            "forces[0].envelope.period",
            "forces[0].envelope.phase",
            "forces[1].envelope.values",
            "forces[2].envelope.gain",
            "forces[3].envelope.gain",
            "forces[3].envelope.factors[0].period",
            "fluid.viscosity",
            VELOCITY,
        ],
        {"viscosity": 0.01, **SURE},
        begin(),
    ),
    "painted viscosity, no-slip": Case(
        [PUSH, MOVING, SOFT_WIND],
        0.3 * FUNCTION + 2.0 * MAP + EARLY_MAP,
        [
            "forces[*].vector",
            *SHAPES,
            "forces[1].center.places",
            "forces[2].envelope.period",
            "fluid.viscosity",
            VELOCITY,
        ],
        {"viscosity": paint(0.002, 0.03, 13), "walls": "no-slip", **EXACT},
        begin(),
    ),
    "viscosity that moves, periodic": Case(
        [TWIRL, GROWTH, Wind((3.0, 2.0), WAVE), STROKE],
        0.01 * WarpObjective(far_apart, END, POINTS) + WarpObjective(lively, MIDDLE) + MAP,
        [
            "forces[*].vector",
            *SHAPES,
            "forces[0].spin",
            "forces[1].rate",
            "forces[2].envelope.phase",
            "forces[3].strength",
            "fluid.viscosity",
            VELOCITY,
        ],
        {"viscosity": paint(0.002, 0.05, 14), "viscosity_moves": True, "walls": "periodic", **EXACT},
        begin(),
    ),
    "soft freeze, free-slip and no-slip": Case(
        [PUSH, MOVING, BRIEF_GROWTH],
        PARTICLES + 0.5 * MAP + 1e-4 * Effort(),
        [
            "forces[*].vector",
            *SHAPES,
            "forces[1].center.places",
            "forces[2].rate",
            "fluid.viscosity",
            VELOCITY,
        ],
        {
            "viscosity": paint(0.001, 0.02, 15),
            "freeze": Freeze(paint(0, 0.4, 16), 1e3),
            "walls": "free-slip,no-slip",
            **EXACT,
        },
        begin(),
    ),
    "hard freeze, no-slip and periodic": Case(
        [TWIRL, BRIEF_GROWTH, PUSH],
        MAP + WarpObjective(lively, END) + 0.2 * FUNCTION,
        ["forces[*].vector", *SHAPES, "forces[0].spin", "forces[1].rate", "fluid.viscosity", VELOCITY],
        {"viscosity": 0.004, "freeze": hard_edge(), "walls": "no-slip,periodic", **EXACT},
        begin(),
    ),
    "densities, periodic and free-slip": Case(
        [RISE, FALL, PUSH],
        INK_MISFIT + 0.5 * SMOKE_MISFIT + 0.1 * WarpObjective(carried, END),
        [
            "forces[*].vector",
            "forces[0].envelope.gain",
            "forces[1].envelope.period",
            "forces[2].center",
            "fluid.densities[*].sources[*].rate",
            "fluid.densities[*].sources[*].center",
            "fluid.densities[1].sources[0].center.places",
            "fluid.densities[*].sources[*].radius",
            "fluid.densities[0].sources[0].envelope.phase",
            "fluid.densities[0].sources[1].envelope.values",
            "fluid.densities[1].sources[0].envelope.gain",
            "fluid.viscosity",
            VELOCITY,
        ],
        {"viscosity": 0.005, "densities": [INK, SMOKE], "walls": "periodic,free-slip", **SURE},
        begin(),
    ),
    "Jacobi sweeps, no-slip": Case(
        [PUSH, TWIRL, RISE, GROWTH],
        PARTICLES + 0.2 * INK_MISFIT + MAP,
        [
            "forces[*].vector",
            *SHAPES,
            "forces[1].spin",
            "forces[3].rate",
            VELOCITY,
            "fluid.densities[0].sources[0].rate",
        ],
        {
            "viscosity": paint(0.002, 0.03, 17),
            "densities": [INK],
            "solver": "jacobi",
            "sweeps": 12,
            "walls": "no-slip",
        },
        begin(),
    ),
    "the paper's scheme, free-slip": Case(
        [PUSH, MOVING, TWIRL],
        PARTICLES + MAP + 1e-4 * Effort(),
        [
            "forces[*].vector",
            *SHAPES,
            "forces[1].center.places",
            "forces[2].spin",
            "forces[0].envelope.phase",
            VELOCITY,
        ],
        {"viscosity": 0.01, "scheme": "paper", "sweeps": 20},
        begin(),
    ),
    "the paper's scheme, painted, no-slip": Case(
        [PUSH, TWIRL],
        PARTICLES + MAP + 1e-4 * Effort(),
        ["forces[*].vector", *SHAPES, Free("forces[1].spin", scale=30.0), VELOCITY],
        {
            "viscosity": paint(0.002, 0.03, 22),
            "freeze": Freeze(paint(0, 0.3, 23), 1e2),
            "scheme": "paper",
            "sweeps": 10,
            "walls": "no-slip",
        },
        begin(),
    ),
    "the paper's scheme, periodic": Case(
        [FALL, RISE, GROWTH, PUSH],
        0.1 * INK_MISFIT + 0.1 * SMOKE_MISFIT + MAP,
        ["forces[*].vector", "forces[*].radius", "fluid.densities[*].sources[*].rate", VELOCITY],
        {
            "viscosity": 0.01,
            "scheme": "paper",
            "sweeps": 20,
            "densities": [INK, SMOKE],
            "walls": "periodic",
        },
        begin(),
    ),
    "viscosity that changes, free-slip and periodic": Case(
        [PUSH, GROWTH],
        PARTICLES + MAP,
        ["forces[*].vector", *SHAPES, "forces[1].rate", VELOCITY],
        {
            "viscosity": Keyed({0.0: paint(0.002, 0.03, 19), 0.1: 0.02, 0.2: paint(0.002, 0.03, 20)}),
            "freeze": Freeze(paint(0, 0.3, 21), 1e3),
            "walls": "free-slip,periodic",
            **EXACT,
        },
        begin(),
    ),
    "viscosity that changes and moves, in the least memory, free-slip": Case(
        [MOVING, TWIRL],
        FUNCTION + EARLY_MAP,
        ["forces[*].vector", *SHAPES, VELOCITY],
        {
            "viscosity": lambda t: paint(0.002, 0.03, 22) * (1 + 5 * t),
            "viscosity_moves": True,
            **EXACT,
        },
        begin(),
        capped=True,
    ),
    "densities in the least memory, free-slip": Case(
        [RISE, PUSH, MOVING],
        INK_MISFIT + FUNCTION + 1e-4 * Effort(),
        [
            "forces[*].vector",
            "forces[1].center",
            "forces[2].center.places",
            "fluid.viscosity",
            "fluid.densities[0].sources[0].rate",
            VELOCITY,
        ],
        {"viscosity": 0.005, "densities": [INK], **SURE},
        begin(),
        capped=True,
    ),
    "painted viscosity in the least memory, no-slip and periodic": Case(
        [PUSH, GROWTH, TWIRL],
        PARTICLES + EARLY_MAP + MAP,
        ["forces[*].vector", "forces[1].rate", "forces[2].spin", "fluid.viscosity", VELOCITY],
        {"viscosity": paint(0.002, 0.03, 18), "walls": "no-slip,periodic", **EXACT},
        begin(),
        capped=True,
    ),
}


def compared(device):
    """Gradients of some cases by their names and slices, with solves that single precision can finish."""
    found = {}
    for name in (
        "constant viscosity, free-slip",
        "viscosity that moves, periodic",
        "densities, periodic and free-slip",
    ):
        case = CASES[name]
        fluid = case.fluid | {"diffusion_tolerance": 1e-5}
        functional = replace(case, fluid=fluid).functional(device)
        _, gradient = functional.value_and_gradient(functional.start)
        found[name] = {one.name: gradient[one.entries].tolist() for one in functional.variables.slices}
    return found
