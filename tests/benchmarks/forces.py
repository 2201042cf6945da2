"""What forces and densities add to a step, as a ratio to the step without them."""

import argparse

import numpy as np
import warp as wp
from timing import alternate

from wfluid.domain.grid import Grid
from wfluid.fields.device import open_device
from wfluid.model.densities import Density, Source
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce, Growth, VortexForce
from wfluid.model.noise_force import NoiseForce
from wfluid.model.uniform_forces import Wind
from wfluid.step.solver import Solver


def stepping(solver, forces, device):
    """A step with these forces."""
    a, b = solver.rest(), solver.rest()
    return lambda: (solver.step(a, b, forces, 0.1, 1 / 96), wp.synchronize_device(device))


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[256])
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--runs", type=int, default=15)
    options = parser.parse_args()
    device, random = open_device(options.device), np.random.default_rng(0)
    for n in options.cells:
        solver = Solver(Grid(n, n), Fluid(viscosity=0.001), device)
        candidates = {"no force": stepping(solver, [], device)}
        for radius in (0.06, 0.02):
            for count in (1, 10, 100, 1000):
                places = random.random((count, 2))
                forces = [GaussianForce(tuple(place), (0.1, 0.2), radius) for place in places]
                candidates[f"{count} pushes of radius {radius}"] = stepping(solver, forces, device)
        for force in (
            VortexForce((0.5, 0.5), 1.0, 0.06),
            Growth((0.5, 0.5), 1.0, 0.06),
            Wind((1.0, 0.0)),
            NoiseForce(strength=1.0, period=1.0),
        ):
            candidates[type(force).__name__] = stepping(solver, [force], device)
        for kappa in (0.0, 1e-4):
            density = Density(diffusion=kappa, sources=[Source((0.5, 0.5), 1.0, 0.06)])
            own = Solver(Grid(n, n), Fluid(viscosity=0.001, densities=[density]), device)
            candidates[f"density, kappa {kappa:g}"] = stepping(own, [], device)
        seconds = alternate(candidates, options.runs)
        print(f"\n{n} x {n} cells on {device.name}, medians of {options.runs}")
        for name, value in seconds.items():
            print(f"  {name:28s} {value * 1e3:8.2f} ms   x {value / seconds['no force']:.2f}")


if __name__ == "__main__":
    main()
