"""The cubic and bilinear look-up of a 1920 x 1080 RGB float picture, beside OpenCV's remap."""

import argparse

import numpy as np
import warp as wp
from timing import alternate

from wfluid.domain.envelopes import Instantaneous
from wfluid.domain.grid import Grid
from wfluid.domain.walls import Walls
from wfluid.fields.device import open_device
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.pictures.picture import Picture
from wfluid.step.solver import Solver
from wfluid.view.lookup import LookUp

WIDTH, HEIGHT = 1920, 1080


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--runs", type=int, default=11)
    options = parser.parse_args()
    device = open_device(options.device)
    picture = Picture(np.random.default_rng(0).random((HEIGHT, WIDTH, 3)).astype(np.float32))
    solver = Solver(Grid.for_picture(WIDTH, HEIGHT), Fluid(), device)
    now, after = solver.rest(), solver.rest()
    for step in range(24):
        solver.step(
            now, after, [GaussianForce((0.5, 0.3), (1, 0.5), 0.1, Instantaneous())], step / 96, 1 / 96
        )
        now, after = after, now
    candidates = {}
    for name in ("bilinear", "cubic"):
        look_up = LookUp(picture, solver.grid, Walls(), device, filter=name)
        candidates[f"{name}, from the fluid's map to pixels in NumPy"] = lambda look_up=look_up: (
            look_up.render(now.d_x, now.d_y)
        )
        candidates[f"{name}, map stretched and looked up"] = lambda look_up=look_up: (
            look_up.launch(now.d_x, now.d_y),
            wp.synchronize_device(device),
        )
        source = look_up.source_of(now.d_x, now.d_y).astype(np.float32)
    try:
        import cv2
    except ImportError:
        cv2 = None
    if cv2:
        x, y = (np.ascontiguousarray(source[..., axis]) for axis in (0, 1))
        for name, flag in (("bilinear", cv2.INTER_LINEAR), ("cubic", cv2.INTER_CUBIC)):
            candidates[f"OpenCV {cv2.__version__} {name}, the map given"] = lambda flag=flag: cv2.remap(
                picture.pixels, x, y, flag
            )
    for name, value in alternate(candidates, options.runs).items():
        print(f"{value * 1e3:8.2f} ms  {name}")


if __name__ == "__main__":
    main()
