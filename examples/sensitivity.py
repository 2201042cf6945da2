"""What holds the nose? The gradient of its displacement with respect to the viscosity of every cell.

One force pushes the raccoon's nose. One backward pass (the adjoint method of section III of "Control Methods
for Fluid-Based Image Warping", Bonilla & Velho) gives, for each of some ten thousand cells, how much less
(red) or more (blue) the nose would move if the picture were stiffer there. `check()` then stiffens the
picture there: the nose loses the predicted distance, and more than from the same paint elsewhere.

    python examples/sensitivity.py --output sensitivity.png
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from wfluid import (
    Constant,
    Fluid,
    Free,
    Functional,
    GaussianForce,
    Grid,
    Painted,
    ParticleFunction,
    Timeline,
    read_picture,
    write_picture,
)

PICTURE = Path(__file__).parent / "images" / "raccoon.jpg"

NOSE, PUSH, RADIUS = (0.606, 0.440), (3.0, 2.0), 0.055

VISCOSITY, SECONDS = 0.004, 0.25


def nose_functional(cells=128, device=None):
    """The nose's displacement along the push [longer side], as a function of every cell's viscosity."""
    picture = read_picture(PICTURE)
    grid = Grid.for_picture(picture.width, picture.height, cells)
    along = np.array(PUSH) / np.hypot(*PUSH)

    def way(t, places):
        return float((places[0] - NOSE) @ along), along[None, :]

    return Functional(
        grid,
        Fluid(viscosity=np.full((grid.ny, grid.nx), VISCOSITY), diffusion_tolerance=1e-4),
        [GaussianForce(NOSE, PUSH, RADIUS, Constant(0.0, SECONDS / 2))],
        Timeline(SECONDS, fps=96, substeps=1),
        ParticleFunction([NOSE], way, [SECONDS]),
        [Free("fluid.viscosity")],
        device=device,
    )


def sensitivity(functional):
    """The displacement, and its derivative by log viscosity per unit of area, (ny, nx) [1/longer side]."""
    way, gradient = functional.value_and_gradient(functional.start)
    grid = functional.grid
    return way, gradient.reshape(grid.ny, grid.nx) / np.sqrt(grid.hx * grid.hy)


def way_when_stiffer(functional, where, factor):
    """The displacement after the viscosity of some cells is multiplied by a factor."""
    values = np.where(where, factor, 1.0) * VISCOSITY
    fluid = replace(functional.setup(functional.start).fluid, viscosity=Painted(values))
    setup = replace(functional.setup(functional.start), fluid=fluid)
    return functional.value(functional.variables.pack(setup))


def check(cells=96, device=None):
    """The gradient predicts the effect of stiffening, and where it is largest. Returns the figures."""
    functional = nose_functional(cells, device)
    way, by = sensitivity(functional)
    grid = functional.grid
    holds = by <= np.quantile(by, 0.05)
    elsewhere = np.roll(holds, grid.nx // 4, axis=1)
    little = 1.02
    lost = way - way_when_stiffer(functional, holds, little)
    foretold = -float(by[holds].sum()) * grid.hx * grid.hy * np.log(little)
    figures = {
        "way_px": way * 1024,
        "lost_of_foretold": lost / foretold,
        "lost_here": (way - way_when_stiffer(functional, holds, 10.0)) / way,
        "lost_elsewhere": (way - way_when_stiffer(functional, elsewhere, 10.0)) / way,
    }
    assert abs(figures["lost_of_foretold"] - 1) < 0.03, figures
    assert figures["lost_here"] > 3 * abs(figures["lost_elsewhere"]), figures
    assert figures["way_px"] > 5, figures
    return figures


def drawn(functional):
    """The picture, dimmed, under the sensitivity: red holds the nose, blue lets it go."""
    picture = read_picture(PICTURE)
    _, by = sensitivity(functional)
    shown = Painted(np.clip(-by, 0, None)), Painted(np.clip(by, 0, None))
    width, height = picture.width, picture.height
    strong = np.quantile(np.abs(by), 0.995)
    grid = Grid(width, height, functional.grid.width, functional.grid.height)
    holds, frees = (np.clip(paint.sample(grid) / strong, 0, 1)[..., None] ** 0.7 for paint in shown)
    pixels = 0.6 * picture.pixels[..., :3]
    pixels = pixels * (1 - holds) + holds * np.array([0.9, 0.06, 0.02])
    pixels = pixels * (1 - frees) + frees * np.array([0.02, 0.15, 0.9])
    return replace(picture, pixels=pixels.astype(np.float32))


def main():
    """Draw the picture, and check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--output", default="sensitivity.png")
    parser.add_argument("--cells", type=int, default=128)
    parser.add_argument("--device", default=None)
    options = parser.parse_args()
    write_picture(options.output, drawn(nose_functional(options.cells, options.device)))
    for name, value in check(device=options.device).items():
        print(f"{name}: {value:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
