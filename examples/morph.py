"""Figure 7: a cat flows into a raccoon through six points of both.

Warp and blend through particle keyframes (figure 7 of "Control Methods for Fluid-Based Image Warping",
Bonilla & Velho): a flow takes eyes, nose, forehead and cheeks of the cat to those of the raccoon. Each frame
shows the cat through the flow so far and the raccoon through the flow still to come, so that matching
features lie at one place. `check()` asserts that the first and last frames are the pictures themselves, that
matching points meet within half a pixel, that neither map folds, and that the maps are inverse to each other.

    python examples/morph.py --output morph.gif --strip morph.jpg
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from wfluid import Picture, morph, read_picture, write_animation, write_picture
from wfluid.files.points import read_points

IMAGES = Path(__file__).parent / "images"

SIDE = 451
"""The longer side of both pictures [px]."""

STRIP = (0, 14, 24, 34, 48)
"""Frames shown side by side."""


def morphing(cells=256, seconds=2.0, device=None, names=("cat.png", "raccoon_face.png"), **settings):
    """The morph; `settings` are those of `wfluid.morph`."""
    cat, raccoon = (read_picture(IMAGES / name) for name in names)
    rows = np.array([[*row.source, *row.target] for row in read_points(IMAGES / "cat_to_raccoon.csv")])
    return morph(cat, raccoon, rows / SIDE, seconds, cells=cells, device=device, **settings)


def check(made, frames):
    """The ends are the pictures, points meet, nothing folds, the maps are inverse. Returns the figures."""
    mean, most = made.inconsistency_px()
    qualities = [(frame.quality, frame.to_quality) for frame in frames]
    figures = {
        "residual_of_a_px": made.match.residual * SIDE,
        "residual_of_b_px": float(made.residuals_of_b().max()),
        "jacobian_min": min(quality.jacobian_min for pair in qualities for quality in pair),
        "jacobian_max": max(quality.jacobian_max for pair in qualities for quality in pair),
        "inconsistency_mean_px": mean,
        "inconsistency_max_px": most,
        "evaluations": made.match.evaluations,
        "seconds": made.match.seconds["total"],
    }
    for frame, picture in ((frames[0], made.pair.a), (frames[-1], made.pair.b)):
        assert np.array_equal(frame.picture.pixels, picture.pixels)
    assert figures["residual_of_a_px"] <= 0.5 and figures["residual_of_b_px"] <= 0.5, figures
    assert figures["jacobian_min"] > 0, figures
    assert mean <= 0.1, figures
    return figures


def strip(frames):
    """Some frames side by side."""
    pixels = [frames[n].picture.pixels[..., :3] for n in STRIP]
    return Picture(np.ascontiguousarray(np.concatenate(pixels, axis=1)), dtype="uint8")


def main():
    """Find the flow, write the morph, there and back, and check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--output", default="morph.gif")
    parser.add_argument("--strip", help="write some frames side by side")
    parser.add_argument("--cells", type=int, default=256)
    parser.add_argument("--device", default=None)
    options = parser.parse_args()
    made = morphing(options.cells, device=options.device)
    frames = list(made.frames())
    write_animation(options.output, frames + frames[-2:0:-1], fps=24)
    if options.strip:
        write_picture(options.strip, strip(frames))
    for name, value in check(made, frames).items():
        print(f"{name}: {value:.4g}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
