"""Painted viscosity and freezing: the same force on three fluids.

Section III of "Control Methods for Fluid-Based Image Warping" (Bonilla & Velho): an oscillating force on the
raccoon with one viscosity everywhere; with a painted viscosity that makes the mask around its eyes 10,000
times stiffer, so that the eyes move but keep their shape; and with frozen eyes, which viscosity cannot do.
Below each animation is the picture that was painted.

    python examples/variable_viscosity.py --output variable_viscosity.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from wfluid import Animation, Drawing, Fluid, Freeze, Painted, Picture, Timeline, parse_force, read_picture
from wfluid.files.output import open_output

IMAGES = Path(__file__).parent / "images"
STIFF, STILL = IMAGES / "raccoon_mask.png", IMAGES / "raccoon_eyes.png"

VISCOSITY, CONTRAST, DRAG = 0.001, 1e4, 1e4

PUSH = "640,420:40,26:period=1,radius=80"

STEPS_PER_SECOND = 24


def fluids():
    """The three fluids by name."""
    stiff = Painted(read_picture(STIFF), scale=CONTRAST * VISCOSITY, floor=VISCOSITY)
    still = Freeze(read_picture(STILL), strength=DRAG)
    return {
        f"viscosity {VISCOSITY}": Fluid(viscosity=VISCOSITY),
        f"stiff x {CONTRAST:g}": Fluid(viscosity=stiff),
        f"frozen {DRAG:g}/s": Fluid(viscosity=VISCOSITY, freeze=still),
    }


def animations(duration=1.0, fps=12.0, cells=192, width=320, device=None):
    """The same force in each of the fluids."""
    picture = read_picture(IMAGES / "raccoon.jpg")
    drawing = Drawing(picture.width, picture.height, max(duration, 1.0))
    force = drawing.force(parse_force("push", PUSH))
    timeline = Timeline(duration, fps, round(STEPS_PER_SECOND / fps))
    height = round(width * picture.height / picture.width)
    size = {"cells": cells, "width": width, "height": height, "device": device}
    return [Animation(picture, fluid, (force,), timeline, **size) for fluid in fluids().values()]


def green_strain(frame):
    """Size of the map's Green strain (F^T F - 1) / 2 at every cell: 0 where the picture keeps its shape."""
    grid, (d_x, d_y) = frame.map.grid, np.moveaxis(frame.map.displacement, -1, 0)
    (xy, xx), (yy, yx) = (np.gradient(d, grid.hy, grid.hx) for d in (d_x, d_y))
    xx, yy = 1 + xx, 1 + yy
    along_x, along_y = (xx**2 + yx**2 - 1) / 2, (xy**2 + yy**2 - 1) / 2
    return np.sqrt(along_x**2 + along_y**2 + (xx * xy + yx * yy) ** 2 / 2)


def check(frames_of_each):
    """The stiff mask keeps its shape, the frozen eyes stay in place, and nothing folds.

    `frames_of_each` holds the frames of each animation. Returns the figures asserted.
    """
    grid = frames_of_each[0][0].map.grid
    stiff = Painted(read_picture(STIFF)).sample(grid) > 0.95
    paint = Painted(read_picture(STILL)).sample(grid)
    still, around = paint > 0.95, (paint < 0.01) & _near(paint > 0.01, round(0.04 * grid.nx))
    strain = [
        np.mean([green_strain(frame)[stiff].mean() for frame in frames[1:]]) for frames in frames_of_each
    ]
    moved = max(
        (np.hypot(*np.moveaxis(frame.map.displacement, -1, 0)) for frame in frames_of_each[2]),
        key=lambda way: way[around].mean(),
    )
    figures = {
        "strain_ratio": float(strain[1] / strain[0]),
        "still_ratio": float(moved[still].mean() / moved[around].mean()),
        "around_px": float(moved[around].mean() * 1024),
        "jacobian_min": min(frame.quality.jacobian_min for frames in frames_of_each for frame in frames),
    }
    assert figures["strain_ratio"] <= 0.12, figures
    assert figures["still_ratio"] <= 0.01, figures
    assert figures["around_px"] > 3, figures
    assert figures["jacobian_min"] > 0.5, figures
    return figures


def _near(where, cells):
    """The cells of a mask, and those within `cells` of it."""
    out = where.copy()
    for _ in range(cells):
        out[1:] |= out[:-1]
        out[:-1] |= out[1:]
        out[:, 1:] |= out[:, :-1]
        out[:, :-1] |= out[:, 1:]
    return out


def sheet(frames):
    """The three frames of one time, and below them the painted viscosity and the freeze mask."""
    top = [labelled(frame.picture.pixels, name) for frame, name in zip(frames, fluids(), strict=True)]
    height, width = top[0].shape[:2]
    dim = 0.2 * read_picture(IMAGES / "raccoon.jpg").resized(width, height).pixels
    controls = [dim]
    for path in (STIFF, STILL):
        paint = read_picture(path).resized(width, height).pixels[..., :1]
        controls.append(dim + (1 - dim) * paint)
    names = ("one number", "viscosity, painted", "freeze mask")
    bottom = [labelled(control, name) for control, name in zip(controls, names, strict=True)]
    return Picture(np.vstack([np.hstack(top), np.hstack(bottom)]), dtype="uint8")


def labelled(pixels, text):
    """The pixels with a text on them."""
    image = oiio.ImageBuf(np.ascontiguousarray(pixels))
    size = max(10, image.spec().height // 14)
    oiio.ImageBufAlgo.render_text(image, size // 2, 2 * size, text, size, textcolor=(1, 1, 1), shadow=2)
    return image.get_pixels(oiio.FLOAT)


def main():
    """Write the animation and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="variable_viscosity.gif", help="x.gif, x.mp4 or x.####.png")
    parser.add_argument("--frames", type=int, default=13, help="frames to make, at 12 a second (13)")
    parser.add_argument("--cells", type=int, default=192, help="cells along the longer side (192)")
    parser.add_argument("--width", type=int, default=320, help="width of each panel [px] (320)")
    parser.add_argument("--device", default=None, help="cpu (default), cuda, …")
    options = parser.parse_args()
    if options.frames < 2:
        parser.error("--frames: expected 2 or more")
    made = animations((options.frames - 1) / 12, 12.0, options.cells, options.width, options.device)
    frames_of_each = [list(animation.frames()) for animation in made]
    output = open_output(options.output, 12.0)
    for frames in zip(*frames_of_each, strict=True):
        output.write(sheet(frames))
    output.close()
    print(f"{output.written[-1]}: {options.frames} frames")
    if options.frames > 12:
        print(check(frames_of_each))
    return 0


if __name__ == "__main__":
    sys.exit(main())
