"""A picture of your own, pushed in the middle: the ten lines that most scripts begin with.

python examples/any_picture.py photo.jpg --output moved.gif
"""

import argparse
import sys
from pathlib import Path

from wfluid import Fluid, GaussianForce, Oscillator, animate, read_picture, write_animation

CAT = Path(__file__).parent / "images" / "cat.png"


def frames(path, count=16, cells=128, device=None):
    """Frames of a picture whose middle swings from side to side."""
    picture = read_picture(path)
    side = max(picture.width, picture.height)
    middle = (picture.width / side / 2, picture.height / side / 2)
    swing = GaussianForce(middle, vector=(2.0, 0.0), radius=0.08, envelope=Oscillator(period=1.0))
    size = {"width": min(picture.width, 480), "cells": cells, "device": device}
    size["height"] = max(1, round(size["width"] * picture.height / picture.width))
    return animate(picture, Fluid(viscosity=0.002), [swing], (count - 1) / 15, fps=15, **size)


def check(made):
    """The picture moves, and nothing folds. Returns the longest displacement [longer side]."""
    qualities = [frame.quality for frame in made]
    reached = max(quality.displacement_max for quality in qualities)
    assert reached > 0.005, reached
    assert min(quality.jacobian_min for quality in qualities) > 0.5, qualities
    return reached


def main():
    """Animate the picture given."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", nargs="?", default=CAT, help="a picture (the cat)")
    parser.add_argument("--output", default="moved.gif", help="x.gif, x.mp4 or x.####.png (moved.gif)")
    parser.add_argument("--frames", type=int, default=16, help="frames to make, at 15 a second (16)")
    parser.add_argument("--cells", type=int, default=128, help="cells along the longer side (128)")
    parser.add_argument("--device", default=None, help="cpu (default), cuda, …")
    options = parser.parse_args()
    if options.frames < 2:
        parser.error("--frames: expected 2 or more")
    made = frames(options.picture, options.frames, options.cells, options.device)
    print(write_animation(options.output, made, fps=15.0)[-1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
