"""Diffusion of variable viscosity and drag: method, residual, time beside one projection; whole steps.

float32, steps of 1/24 s, the change of a noisy velocity. "error" is the part of the solution that is
missing, in the operator's own norm and in the velocity, against conjugate gradients run to the end.
"""

import argparse

import numpy as np
import warp as wp
from stages import FORCE, graph, jax_step
from timing import alternate

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import from_numpy, vector
from wfluid.fields.device import open_device
from wfluid.model.fluid import Fluid
from wfluid.model.painted import Freeze
from wfluid.solve.system import SolveMethod
from wfluid.step.solver import Solver

DT = 1 / 24


def media(n):
    """Viscosity and drag by name, (n, n)."""
    y, x = (np.mgrid[0:n, 0:n] + 0.5) / n
    r = np.hypot(x - 0.5, y - 0.5)
    blank, rng = np.zeros((n, n)), np.random.default_rng(1)
    disc = r < 0.25
    return {
        "constant": (blank + 0.002, blank),
        "smooth, contrast 50": (0.001 + 0.05 * np.exp(-(r**2) / 0.02), blank),
        "jump 1e2": (np.where(disc, 0.1, 0.001), blank),
        "jump 1e4": (np.where(disc, 10.0, 0.001), blank),
        "noise 1e2": (0.001 * 10 ** (2 * rng.random((n, n))), blank),
        "drag 1e4": (blank + 0.001, np.where(disc, 1e4, 0.0)),
    }


def prepared(n, mu, alpha, device):
    """A solver of the medium after a step, and a noisy velocity."""
    freeze = Freeze(np.log1p(alpha) / np.log1p(1e4)) if alpha.any() else None
    solver = Solver(Grid(n, n), Fluid(viscosity=mu, freeze=freeze), device)
    a, b = solver.rest(), solver.rest()
    for step in range(4):
        solver.step(a, b, [FORCE], step * DT, DT)
        a, b = b, a
    velocity, rng = vector(solver.layout, device, 2), np.random.default_rng(0)
    for f, ghosts in zip(velocity, solver._step.velocity_ghosts, strict=True):
        from_numpy(rng.standard_normal((n, n)), f, solver.layout)
        ghosts.fill(f)
    return solver, a, b, velocity


def stepping(solver, a, b, dt, device):
    """A whole step, to be called."""
    return lambda: (solver.step(a, b, [FORCE], 0.1, dt), wp.synchronize_device(device))


def errors(diffusion, velocity):
    """Of the solve planned: missing part of the change in the operator's norm, and of the velocity."""
    system, method = diffusion.system, diffusion.method
    diffusion.diffuse(velocity)
    exact, left, back = (vector(diffusion.layout, diffusion.device, 2) for _ in range(3))
    best = SolveMethod("conjugate gradients", 60, 1e-6)
    system.prepare(best)
    system.solve(best, diffusion._b, exact)
    for f, g, out in zip(exact, diffusion._x, left, strict=True):
        out.assign(f.numpy() - g.numpy())

    def energy(x):
        system.levels[0].fill(x)
        system.levels[0].residual(system.zero, x, back)
        system.levels[0].fill(back)
        rows = [-np.sum(f.numpy().astype(float) * g.numpy()) for f, g in zip(x, back, strict=True)]
        return np.sqrt(sum(rows))

    size = diffusion.system.inner.norm
    figures = energy(left) / energy(exact), size(left) / size(velocity)
    diffusion.method = method
    diffusion.diffuse(velocity)
    return figures


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[256, 512])
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--runs", type=int, default=7)
    options = parser.parse_args()
    device = open_device(options.device)
    for n in options.cells:
        print(f"\n{n} x {n} cells on {device.name}, steps of 1/24 s, medians of {options.runs}")
        head = (
            "method",
            "iterations",
            "residual",
            "backward",
            "error A",
            "error v",
            "ms",
            "/ projection",
            "step ms",
        )
        print(f"{'':20s} {head[0]:20s}" + "".join(f"{word:>13s}" for word in head[1:]))
        for name, (mu, alpha) in media(n).items():
            solver, a, b, velocity = prepared(n, mu, alpha, device)
            diffusion, projection = solver._step.diffusion, solver._step.projection
            missing = errors(diffusion, velocity)
            report = diffusion.measure()
            seconds = alternate(
                {
                    "diffusion": graph(device, lambda: diffusion.diffuse(velocity)),  # noqa: B023
                    "projection": graph(device, lambda: projection.project((a.u, a.v), (b.u, b.v))),  # noqa: B023
                    "step": stepping(solver, a, b, DT, device),
                },
                options.runs,
            )
            figures = f"{report.iterations:13d}{report.relative:13.1e}{report.backward:13.1e}"
            figures += f"{missing[0]:13.1e}{missing[1]:13.1e}{seconds['diffusion'] * 1e3:13.2f}"
            figures += f"{seconds['diffusion'] / seconds['projection']:13.2f}{seconds['step'] * 1e3:13.2f}"
            print(f"{name:20s} {report.method:20s}{figures}", flush=True)
        for fps in (24, 96):
            mu = media(n)["smooth, contrast 50"][0]
            solver = Solver(Grid(n, n), Fluid(viscosity=mu), device)
            a, b = solver.rest(), solver.rest()
            stages = {"step": stepping(solver, a, b, 1 / fps, device)}
            peer = jax_step(n, 0.001, 1 / fps) if not device.is_cuda else None
            if peer:
                stages["JAX"] = peer
            seconds = alternate(stages, options.runs)
            text = f"whole step, smooth viscosity, 1/{fps} s: {seconds['step'] * 1e3:.1f} ms"
            if peer:
                ratio = seconds["JAX"] / seconds["step"]
                text += f"; JAX, constant viscosity, {seconds['JAX'] * 1e3:.1f} ms: ratio {ratio:.2f}"
            print(text)


if __name__ == "__main__":
    main()
