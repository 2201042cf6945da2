"""A step and its stages in ns a cell, one thread each; a whole step beside JAX with FFT solves.

The peer is the usual way to write this in an array language: periodic, Euler traces, bilinear
interpolation, constant viscosity, exact solves in Fourier space. Ours has walls, midpoint traces and
cubic interpolation.
"""

import argparse

import numpy as np
import warp as wp
from timing import alternate

from wfluid.domain.grid import Grid
from wfluid.fields.device import open_device
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.step.solver import Solver

FORCE = GaussianForce((0.4, 0.5), (2.0, 1.0), 0.08)


def jax_step(n, viscosity, dt):
    """A jitted step (u, v, x, y) -> the same, or None without JAX."""
    try:
        import jax
        import jax.numpy as jnp
    except ImportError:
        return None
    k = 2 * np.pi * np.fft.fftfreq(n, 1 / n).astype(np.float32)
    kx, ky = (
        np.broadcast_to(k[None, : n // 2 + 1], (n, n // 2 + 1)),
        np.broadcast_to(k[:, None], (n, n // 2 + 1)),
    )
    k2 = kx**2 + ky**2
    k2_safe = np.where(k2 == 0, 1, k2)
    decay = 1 / (1 + viscosity * dt * k2)
    column, row = np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32))
    x0, y0 = column / n, row / n
    push = 2.0 * np.exp(-((x0 - 0.4) ** 2 + (y0 - 0.5) ** 2) / (2 * 0.08**2)).astype(np.float32)

    def sample(f, x, y):
        i, j = jnp.floor(x).astype(int), jnp.floor(y).astype(int)
        a, b = x - i, y - j
        i0, i1, j0, j1 = i % n, (i + 1) % n, j % n, (j + 1) % n
        north, south = f[j0, i0] * (1 - a) + f[j0, i1] * a, f[j1, i0] * (1 - a) + f[j1, i1] * a
        return north * (1 - b) + south * b

    @jax.jit
    def step(u, v, d_x, d_y):
        u, v = u + dt * push, v + 0.5 * dt * push
        x, y = column - dt * n * u, row - dt * n * v
        u, v = sample(u, x, y), sample(v, x, y)
        d_x, d_y = sample(d_x, x, y) + (x - column), sample(d_y, x, y) + (y - row)
        uh, vh = jnp.fft.rfft2(u) * decay, jnp.fft.rfft2(v) * decay
        along = (kx * uh + ky * vh) / k2_safe
        return jnp.fft.irfft2(uh - kx * along), jnp.fft.irfft2(vh - ky * along), d_x, d_y

    state = [jax.numpy.zeros((n, n), jax.numpy.float32) for _ in range(4)]

    def run():
        nonlocal state
        state = list(step(*state))
        jax.block_until_ready(state)

    return run


def graph(device, work):
    """A replay of `work`."""
    with wp.ScopedCapture(device=device) as capture:
        work()
    return lambda: (wp.capture_launch(capture.graph), wp.synchronize_device(device))


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[256, 512, 1024])
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--runs", type=int, default=11)
    options = parser.parse_args()
    device, dt = open_device(options.device), 1 / 96
    for n in options.cells:
        solver = Solver(Grid(n, n), Fluid(viscosity=0.001), device)
        a, b = solver.rest(), solver.rest()
        for step in range(6):
            solver.step(a, b, [FORCE], step * dt, dt)
            a, b = b, a
        controls, top = solver._forcing_for([FORCE]), solver._step.projection.system.levels[0]
        ten_sweeps = lambda: top.smooth(top.b, top.x, [top.plain] * 10, top.r, top.y)  # noqa: B023, E731
        foot = solver._step.trace(a, controls)
        stages = {
            "10 Jacobi sweeps": graph(device, ten_sweeps),
            "foot": graph(device, lambda: solver._step.trace(a, controls)),  # noqa: B023
            "velocity, cubic": graph(device, lambda: [solver._step.advect((a.u, a.v), foot)]),  # noqa: B023
            "map, cubic": graph(device, lambda: solver._step.carry_map(a, foot, b)),  # noqa: B023
            "diffusion": graph(device, lambda: solver._step.diffusion.diffuse((a.u, a.v))),  # noqa: B023
            "projection": graph(device, lambda: solver._step.project((a.u, a.v), (b.u, b.v))),  # noqa: B023
            "whole step": lambda: (solver.step(a, b, [FORCE], 0.1, dt), wp.synchronize_device(device)),  # noqa: B023
        }
        peer = jax_step(n, 0.001, dt) if not device.is_cuda else None
        if peer:
            stages["JAX step"] = peer
        seconds = alternate(stages, options.runs)
        report = solver.report()
        print(f"\n{n} x {n} cells on {device.name}, medians of {options.runs}")
        for name, value in seconds.items():
            print(f"  {name:18s} {value * 1e3:8.2f} ms {value / n**2 * 1e9:8.2f} ns/cell")
        print(f"  Jacobi with ghosts {10 * n**2 / seconds['10 Jacobi sweeps'] / 1e6:.0f} Mcells/s")
        print(f"  projection leaves {report.pressure.relative:.1e} after {report.pressure.iterations} cycles")
        if peer:
            print(f"  JAX step / whole step {seconds['JAX step'] / seconds['whole step']:.2f}")


if __name__ == "__main__":
    main()
