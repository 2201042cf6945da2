"""Media of varying viscosity and drag for the tests of viscosity, and their diffusion."""

import numpy as np

from wfluid import Fluid, Freeze
from wfluid.fields.arrays import from_numpy, vector
from wfluid.step.coefficients import Coefficients
from wfluid.step.diffusion import CoupledDiffusion

WALLS = ("free-slip", "no-slip", "periodic", "no-slip,periodic", "free-slip,no-slip")
"""Each boundary condition on all sides, and two combinations."""

MEDIA = ("constant", "smooth", "jump 1e2", "jump 1e4", "noise", "drag", "both")
"""The names of `media`."""

DT = 1 / 24
"""The step [s]."""


def disc(grid, x=0.5, y=0.5, radius=0.25):
    """Whether each centre lies in a disc, (ny, nx)."""
    return np.hypot(*(a - b for a, b in zip(centres(grid), (x, y), strict=True))) < radius


def centres(grid):
    """Positions of centres: x (nx,) and y (ny, 1)."""
    return (np.arange(grid.nx) + 0.5) * grid.hx, ((np.arange(grid.ny) + 0.5) * grid.hy)[:, None]


def media(grid):
    """Viscosity and drag by name."""
    x, y = centres(grid)
    rng = np.random.default_rng(5)
    blank = np.zeros((grid.ny, grid.nx))
    return {
        "constant": (blank + 0.002, blank),
        "smooth": (0.001 + 0.05 * np.exp(-((x - 0.5) ** 2 + (y - 0.4) ** 2) / 0.02), blank),
        "jump 1e2": (np.where(disc(grid), 0.1, 0.001), blank),
        "jump 1e4": (np.where(disc(grid), 10.0, 0.001), blank),
        "noise": (0.001 * 10 ** (2 * rng.random(blank.shape)), blank),
        "drag": (blank + 0.001, np.where(disc(grid), 1e4, 0.0)),
        "both": (np.where(disc(grid, 0.3), 1.0, 0.0), np.where(disc(grid, 0.7, radius=0.1), 1e3, 0.0)),
    }


def frozen(alpha):
    """The mask whose drag is `alpha`."""
    return Freeze(np.log1p(alpha) / np.log1p(1e4), 1e4) if alpha.any() else None


def coupled(grid, mu, alpha, walls, device, dt=DT, **settings):
    """The coupled diffusion with given coefficients, ready to run."""
    fluid = Fluid(viscosity=mu, freeze=frozen(alpha), walls=walls, **settings)
    coefficients = Coefficients(grid, fluid, device)
    diffusion = CoupledDiffusion(fluid, coefficients, device)
    coefficients.set_time(0.0, dt)
    diffusion.plan(dt)
    coefficients.coarsen()
    diffusion.update_coefficients()
    return diffusion


def random_vector(diffusion, seed):
    """A vector of noise, 0 on walls."""
    layout, rng = diffusion.layout, np.random.default_rng(seed)
    out = vector(layout, diffusion.device, 2)
    for f in out:
        from_numpy(rng.standard_normal((layout.ny, layout.nx)), f, layout)
    diffusion.system.levels[0].fill(out)
    return out
