"""Value and gradient of a whole run beside the run alone, and beside JAX's value_and_grad of the same flow.

The flow: constant viscosity, one Gaussian force, particles that should be somewhere else at the end; the
gradient with respect to the force's vector and center. The peer is the usual way to write this in an array
language (periodic, Euler traces, bilinear interpolation, exact solves in Fourier space); ours has walls,
midpoint traces, cubic interpolation and particles that follow the flow by cubics.

    python tests/benchmarks/gradients.py --cells 256 512 --steps 24
    python tests/benchmarks/gradients.py --memory --cells 256 --steps 24 240 1000 --cap 64
"""

import argparse
import resource
import subprocess
import sys
import time

import numpy as np
import warp as wp
from timing import alternate

from wfluid.domain.grid import Grid
from wfluid.domain.timeline import Timeline
from wfluid.gradient.functional import Functional
from wfluid.gradient.objectives import ParticleMisfit
from wfluid.gradient.variables import Free
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce

RATE = 96
POINTS = np.array([[0.31, 0.42], [0.5, 0.52], [0.6, 0.2], [0.45, 0.6]])
TARGETS = POINTS + np.array([[0.05, 0.02], [0.04, 0.03], [0.0, 0.0], [0.03, -0.02]])
VECTOR, CENTER, RADIUS, VISCOSITY = (2.0, 1.0), (0.4, 0.5), 0.08, 0.001


def ours(n, steps, device, cap=None):
    """The functional, at n x n cells."""
    objective = ParticleMisfit(POINTS, TARGETS, time=steps / RATE)
    free = [Free("forces[0].vector"), Free("forces[0].center")]
    timeline = Timeline(steps / RATE, fps=RATE, substeps=1)
    forces = [GaussianForce(CENTER, VECTOR, RADIUS)]
    return Functional(
        Grid(n, n),
        Fluid(viscosity=VISCOSITY),
        forces,
        timeline,
        objective,
        free,
        memory_mb=cap,
        device=device,
    )


def jax_run(n, steps):
    """Jitted (value, value and gradient) of the peer, or None without JAX."""
    try:
        import jax
        import jax.numpy as jnp
    except ImportError:
        return None
    dt = 1 / RATE
    k = 2 * np.pi * np.fft.fftfreq(n, 1 / n).astype(np.float32)
    kx, ky = k[None, : n // 2 + 1], k[:, None]
    k2 = kx**2 + ky**2
    safe, decay = np.where(k2 == 0, 1, k2), 1 / (1 + VISCOSITY * dt * k2)
    column, row = np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32))

    def sample(f, x, y):
        i, j = jnp.floor(x).astype(int), jnp.floor(y).astype(int)
        a, b = x - i, y - j
        i0, i1, j0, j1 = i % n, (i + 1) % n, j % n, (j + 1) % n
        north, south = f[j0, i0] * (1 - a) + f[j0, i1] * a, f[j1, i0] * (1 - a) + f[j1, i1] * a
        return north * (1 - b) + south * b

    def step(m, carry):
        u, v, d_x, d_y, p = carry
        g = dt * jnp.exp(-((column / n - m[2]) ** 2 + (row / n - m[3]) ** 2) / (2 * RADIUS**2))
        p = p + dt * n * jnp.stack([sample(f, p[:, 0], p[:, 1]) for f in (u, v)], axis=1)
        u, v = u + m[0] * g, v + m[1] * g
        x, y = column - dt * n * u, row - dt * n * v
        u, v = sample(u, x, y), sample(v, x, y)
        d_x, d_y = sample(d_x, x, y) + (x - column), sample(d_y, x, y) + (y - row)
        uh, vh = jnp.fft.rfft2(u) * decay, jnp.fft.rfft2(v) * decay
        along = (kx * uh + ky * vh) / safe
        return jnp.fft.irfft2(uh - kx * along), jnp.fft.irfft2(vh - ky * along), d_x, d_y, p

    def value(m):
        still = jnp.zeros((n, n), jnp.float32)
        carry = (still, still, still, still, jnp.asarray(POINTS * n, jnp.float32))
        carry = jax.lax.fori_loop(0, steps, lambda _, c: step(m, c), carry)
        return 0.5 * jnp.sum((carry[4] / n - TARGETS) ** 2) + 0.0 * jnp.sum(carry[2] + carry[3])

    def value_and_loss(m):
        still = jnp.zeros((n, n), jnp.float32)
        carry = (still, still, still, still, jnp.asarray(POINTS * n, jnp.float32))
        carry, _ = jax.lax.scan(lambda c, _: (step(m, c), None), carry, None, length=steps)
        return 0.5 * jnp.sum((carry[4] / n - TARGETS) ** 2) + 1e-12 * jnp.sum(carry[2] ** 2 + carry[3] ** 2)

    m = jnp.array([*VECTOR, *CENTER], jnp.float32)
    forward, both = jax.jit(value), jax.jit(jax.value_and_grad(value_and_loss))
    return lambda: jax.block_until_ready(forward(m)), lambda: jax.block_until_ready(both(m))


def speed(options):
    """Print the table of times."""
    for n in options.cells:
        for steps in options.steps:
            began = time.perf_counter()
            functional = ours(n, steps, options.device)
            m = functional.start
            made = time.perf_counter()
            functional.value_and_gradient(m)
            first = time.perf_counter()
            candidates = {
                "run": lambda: functional.value(m),  # noqa: B023
                "value + gradient": lambda: functional.value_and_gradient(m),  # noqa: B023
            }
            peer = jax_run(n, steps)
            if peer:
                candidates["JAX run"], candidates["JAX value_and_grad"] = peer
            seconds = alternate(candidates, options.runs)
            print(f"\n{n} x {n} cells, {steps} steps, medians of {options.runs}")
            for name, value in seconds.items():
                print(f"  {name:20s} {value * 1e3:9.1f} ms {value / steps * 1e3:8.2f} ms/step")
            print(f"  value + gradient / run          {seconds['value + gradient'] / seconds['run']:.2f}")
            if peer:
                ratio = seconds["JAX value_and_grad"] / seconds["value + gradient"]
                print(f"  JAX value_and_grad / ours       {ratio:.2f}")
            print(f"  made in {made - began:.2f} s, first evaluation {first - made:.2f} s")
            launches = count_launches(functional, m)
            print(f"  launches an evaluation, were none replayed: {launches}, replayed: 2 graphs")


def count_launches(functional, m):
    """Kernel launches of one evaluation, from those of a loop's body."""
    recording, count = functional._recording, [0, 0]
    launch = wp.launch

    def counted(*arguments, **settings):
        count[0] += 1
        return launch(*arguments, **settings)

    wp.launch = counted
    try:
        for work in (recording.loops.record_forward, recording.loops.record_backward):
            with wp.ScopedCapture(device=recording.device):
                work()
    finally:
        wp.launch = launch
    return count[0] * recording.steps


def memory(options):
    """Print the table of memory: each case in a process of its own, for its peak."""
    for n in options.cells:
        for steps in options.steps:
            for cap in (None, options.cap):
                command = [sys.executable, __file__, "--case", str(n), str(steps), str(cap or 0)]
                command += ["--device", options.device]
                print(subprocess.run(command, capture_output=True, text=True, check=True).stdout, end="")


def case(options):
    """One row of the table of memory."""
    n, steps, cap = options.case
    small = ours(16, 2, options.device)
    small.value_and_gradient(small.start)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    functional = ours(int(n), int(steps), options.device, cap or None)
    functional.value_and_gradient(functional.start)
    began = time.perf_counter()
    functional.value_and_gradient(functional.start)
    seconds = time.perf_counter() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    segments = len(functional._recording.schedule.segments)
    print(
        f"{int(n)} x {int(n)}, {int(steps):5d} steps, cap {cap or 'none'}: "
        f"states {functional.memory / 2**20:7.1f} MB, peak grew by {grown:7.1f} MB, "
        f"{segments} segments, {seconds:6.2f} s"
    )


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[256, 512])
    parser.add_argument("--steps", type=int, nargs="+", default=[24])
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--memory", action="store_true", help="peak memory with and without a cap")
    parser.add_argument("--cap", type=float, default=64.0, help="memory_mb")
    parser.add_argument("--case", type=float, nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.case:
        case(options)
    elif options.memory:
        memory(options)
    else:
        speed(options)


if __name__ == "__main__":
    main()
