"""One force, three viscosities: the thicker the fluid, the less the picture moves.

Figure 2 of "Control Methods for Fluid-Based Image Warping" (Bonilla & Velho): the same force on the same
picture with mu = 0.001, 0.002 and 0.005, side by side and labelled.

    python examples/viscosity.py --output viscosity.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from wfluid import Animation, Constant, Fluid, GaussianForce, Picture, Timeline, read_picture
from wfluid.files.output import open_output

PICTURE = Path(__file__).parent / "images" / "astronaut.jpg"

VISCOSITIES = (0.001, 0.002, 0.005)

FORCE = GaussianForce(center=(0.44, 0.27), vector=(0.7, 0.35), radius=0.06, envelope=Constant(0.0, 0.5))


def animations(duration=1.0, fps=15.0, cells=192, width=300, device=None):
    """The same animation in each of the fluids."""
    picture = read_picture(PICTURE)
    timeline = Timeline(duration, fps)
    size = {"cells": cells, "width": width, "height": width, "device": device}
    return [Animation(picture, Fluid(viscosity=mu), (FORCE,), timeline, **size) for mu in VISCOSITIES]


def side_by_side(frames):
    """The three frames of one time in a row, each with its viscosity written on it."""
    panels = []
    for frame, viscosity in zip(frames, VISCOSITIES, strict=True):
        image = oiio.ImageBuf(frame.picture.pixels)
        size = max(12, image.spec().height // 16)
        oiio.ImageBufAlgo.render_text(
            image, size // 2, 2 * size, f"viscosity {viscosity}", size, textcolor=(1, 1, 1), shadow=2
        )
        panels.append(image.get_pixels(oiio.FLOAT))
    return Picture(np.concatenate(panels, axis=1), dtype="uint8")


def check(frames_of_each):
    """The longest displacement at the end falls as the viscosity rises, and nothing folds.

    `frames_of_each` holds the frames of each animation. Returns the displacements [px of a 512 px picture].
    """
    last = [frames[-1].quality for frames in frames_of_each]
    reached = [quality.displacement_max * 512 for quality in last]
    assert reached[0] > 1.1 * reached[1] > 1.1 * 1.2 * reached[2], reached
    assert all(0.9 < quality.jacobian_min and quality.jacobian_max < 1.1 for quality in last), last
    return reached


def main():
    """Write the animation and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--output", default="viscosity.gif", help="x.gif, x.mp4 or x.####.png (viscosity.gif)"
    )
    parser.add_argument("--frames", type=int, default=16, help="frames to make, at 15 a second (16)")
    parser.add_argument("--cells", type=int, default=192, help="cells along a side (192)")
    parser.add_argument("--width", type=int, default=300, help="width of each panel [px] (300)")
    parser.add_argument("--device", default=None, help="cpu (default), cuda, …")
    options = parser.parse_args()
    if options.frames < 2:
        parser.error("--frames: expected 2 or more")
    made = animations((options.frames - 1) / 15, 15.0, options.cells, options.width, options.device)
    frames_of_each = [list(animation.frames()) for animation in made]
    output = open_output(options.output, 15.0)
    for frames in zip(*frames_of_each, strict=True):
        output.write(side_by_side(frames))
    output.close()
    print(f"{output.written[-1]}: {options.frames} frames")
    if options.frames > 8:
        print("displacement [px]:", check(frames_of_each))
    return 0


if __name__ == "__main__":
    sys.exit(main())
