"""One force, three viscosities: the thicker the fluid, the less the picture moves.

Figure 2 of "Control Methods for Fluid-Based Image Warping" (Bonilla & Velho): the same oscillating force on
the same picture in three fluids, side by side and labelled. The movement is large in the first one and
imperceptible in the last one. The paper's values, 0.001 to 0.005, are in units that it does not state; in
wfluid's units (`--viscosity`) they would differ by little, since this force meets hardly any friction there.

    python examples/viscosity.py --output viscosity.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from wfluid import Animation, Drawing, Fluid, Picture, Timeline, parse_force, read_picture
from wfluid.files.output import open_output

PICTURE = Path(__file__).parent / "images" / "astronaut.jpg"

VISCOSITIES = (0.01, 0.1, 10.0)

PUSH = "225,140:30,15:period=1,radius=80"


def animations(duration=4.0, fps=15.0, cells=192, width=300, device=None):
    """The same animation in each of the fluids."""
    picture = read_picture(PICTURE)
    force = Drawing(picture.width, picture.height, max(duration, 1.0)).force(parse_force("push", PUSH))
    timeline = Timeline(duration, fps)
    size = {"cells": cells, "width": width, "height": width, "device": device}
    return [
        Animation(picture, Fluid(viscosity=mu, diffusion_tolerance=1e-3), (force,), timeline, **size)
        for mu in VISCOSITIES
    ]


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
    """The longest displacement falls from tens of pixels to less than half of one, and nothing folds.

    `frames_of_each` holds the frames of each animation. Returns the displacements [px of a 512 px picture].
    """
    reached = [max(frame.quality.displacement_max for frame in frames) * 512 for frames in frames_of_each]
    large, middle, imperceptible = reached
    assert large > 30 and imperceptible < 0.5, reached
    assert large > 2 * middle > 2 * 20 * imperceptible, reached
    qualities = [frame.quality for frames in frames_of_each for frame in frames]
    assert all(quality.jacobian_min > 0.95 and quality.jacobian_max < 1.05 for quality in qualities)
    return reached


def main():
    """Write the animation and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--output", default="viscosity.gif", help="x.gif, x.mp4 or x.####.png (viscosity.gif)"
    )
    parser.add_argument("--frames", type=int, default=61, help="frames to make, at 15 a second (61)")
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
    if options.frames > 60:
        print("displacement [px]:", check(frames_of_each))
    return 0


if __name__ == "__main__":
    sys.exit(main())
