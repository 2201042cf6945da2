"""wfluid check-gradient: the Taylor test of the gradients of a scene, in double precision."""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.cli.exits import Exit
from wfluid.domain.grid import Grid
from wfluid.gradient.functional import Functional
from wfluid.gradient.objectives import Objective, ParticleMisfit, Sum
from wfluid.gradient.state_objectives import DensityMisfit, MapMisfit
from wfluid.gradient.taylor import LEAST_RATE, taylor_rates
from wfluid.gradient.variables import POSITIVE, VELOCITY, VISCOSITY, Free, Setup, known_names
from wfluid.kernels.cell.real import Real
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.model.fluid import Fluid
from wfluid.model.force import flatten
from wfluid.scene.scene import Scene
from wfluid.staging.aims import Aims
from wfluid.staging.build import StagedKeyframes, stage_all

TIGHT = 1e-12
"""Tolerance of the solves; the gradient with respect to viscosity is exact only for exact solves."""

DENSITY_WEIGHT = 1e-3
"""Weight of the density terms in the objective; displacements are small numbers."""


def check_gradient(scene: Scene, cells: int, device: str | None, seed: int) -> int:
    """Test the gradient with respect to every variable of a scene; print a table; `FAILED` if one is wrong.

    The objective is the misfit of the keyframes; without keyframes, the mean square of the displacement and
    of the densities at the end. Forces found for the keyframes act too.

    Raises:
        ValueError: a scene without variables, or with an error.
    """
    staged = stage_all(scene, device, lambda text: print(f"wfluid check-gradient: {text}", file=sys.stderr))
    animation, aims = staged.animation, staged.aims if isinstance(staged, StagedKeyframes) else None
    functional = _functional(replace(animation, cells=cells), aims)
    grid, steps = functional.grid, functional.timeline.steps
    objective = "mean square of " + " and ".join(["the displacement", *animation.fluid.density_names])
    if aims:
        objective = f"misfit of {len(aims.keyframes)} keyframes"
    print(f"{grid.nx} x {grid.ny} cells, {steps} steps, {Real.__name__}: {objective}")
    print(f"{'variable':44s} {'size':>6s} {'|gradient|':>11s} {'remainder':>10s} {'rate':>9s}")
    wrong, began = 0, time.perf_counter()
    rates: list[float] = []
    for rate in taylor_rates(functional, seed=seed):
        shown = f"{rate.rate:.3f}"
        if not np.isfinite(rate.rate):
            shown = "linear" if np.isinf(rate.rate) else "constant"
        verdict = "" if rate.holds else f"  below {LEAST_RATE}"
        numbers = f"{rate.size:6d} {rate.gradient:11.3e} {rate.remainder:10.1e} {shown:>9s}"
        print(f"{rate.name:44s} {numbers}{verdict}", flush=True)
        wrong += not rate.holds
        rates.append(rate.rate)
    worst = min(filter(np.isfinite, rates), default=math.inf)
    lowest = f", the lowest rate is {worst:.3f}" if np.isfinite(worst) else ""
    seconds = time.perf_counter() - began
    text = f"{len(rates)} variables tested in {seconds:.1f} s, {wrong} wrong{lowest}; nothing was written"
    print(text, file=sys.stderr)
    return Exit.FAILED if wrong else Exit.DONE


def _functional(animation: Animation, aims: Aims | None) -> Functional:
    """The objective as a function of all variables of an animation."""
    grid, timeline, device = animation.grid, animation.timeline, animation.device
    fluid = replace(animation.fluid, diffusion_tolerance=TIGHT, pressure_tolerance=TIGHT)
    found = aims.found if aims else ()
    setup = Setup(fluid, (*flatten(animation.forces), *found), np.zeros((2, grid.ny, grid.nx)))
    names = [name for name in known_names(setup) if not _excluded(name, setup)]
    free = [Free(name, _scale(name, setup)) for name in names]
    objective = _misfit(aims) if aims else _objective(grid, fluid, timeline.end)
    return Functional(grid, fluid, setup.forces, timeline, objective, free, device=device)


def _misfit(aims: Aims) -> Objective:
    """The misfits of keyframes and pins."""
    pins = [ParticleKeyframe(pin, pin, max(one.time for one in aims.keyframes)) for pin in aims.pins]
    return Sum(
        tuple(
            (one.weight, ParticleMisfit([one.point], [one.destination], one.time))
            for one in (*aims.keyframes, *pins)
        )
    )


def _objective(grid: Grid, fluid: Fluid, end: float) -> Objective:
    """The mean square of the displacement at the end, and of every density."""
    mean, none = 2 / (grid.width * grid.height), np.zeros((grid.ny, grid.nx))
    total: Objective = mean * MapMisfit(np.stack([none, none]), end)
    for name in fluid.density_names:
        total += DENSITY_WEIGHT * mean * DensityMisfit(name, none, end)
    return total


def _excluded(name: str, setup: Setup) -> bool:
    """Whether a variable is left out: the gradient of viscosity is unreliable at 0 and with Jacobi sweeps."""
    if name != VISCOSITY:
        return False
    none = isinstance(setup.fluid.viscosity, float) and setup.fluid.viscosity == 0
    return none or setup.fluid.solver == "jacobi"


def _scale(name: str, setup: Setup) -> float:
    """The magnitude of a variable: test steps are in proportion to it."""
    if name.rpartition(".")[2] in POSITIVE or name == VELOCITY:
        return 1.0
    values = np.abs(np.asarray(setup.number(name), dtype=np.float64))
    return float(values.max()) or 1.0
