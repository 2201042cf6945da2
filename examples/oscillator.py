"""The raccoon moves its nose and mouth: oscillating forces on one picture.

Figures 5 and 6 of "Control Methods for Fluid-Based Image Warping" (Bonilla & Velho): a diagonal
oscillator on the nose and one on the mouth, a quarter of a period behind it, animate a single photograph.

    python examples/oscillator.py --output raccoon.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from wfluid import Animation, Drawing, Fluid, Timeline, parse_force, read_picture, write_animation

PICTURE = Path(__file__).parent / "images" / "raccoon.jpg"

NOSE = "621,451:22,15:period=1,radius=55"
MOUTH = "640,510:10,7:period=1,radius=38,start=0.25"

PERIOD = 1.0
AMPLITUDE = float(np.hypot(22, 15))


def animation(periods=2.0, fps=15.0, cells=256, width=480, device=None):
    """The two oscillators on the raccoon, as an `Animation`."""
    picture = read_picture(PICTURE)
    duration = periods * PERIOD
    longest = max(duration, PERIOD)  # a shorter run shows the beginning of the same motion
    drawing = Drawing(picture.width, picture.height, longest)
    forces = [drawing.force(parse_force("push", push)) for push in (NOSE, MOUTH)]
    height = round(width * picture.height / picture.width)
    return Animation(
        picture,
        Fluid(viscosity=0.001),
        forces,
        Timeline(duration, fps),
        cells=cells,
        width=width,
        height=height,
        device=device,
    )


def check(frames):
    """The nose swings along its arrow and stays near its place; areas are kept; nothing folds.

    `frames` are those of `animation`, longest periods of them. Returns the figures asserted.
    """
    frames = list(frames)
    side = max(frames[0].picture.width, frames[0].picture.height)
    grid = frames[0].map.grid
    row, column = int(451 / 1024 / grid.hy), int(621 / 1024 / grid.hx)
    # source_of is the backward map: where the nose is now, the displacement is minus its motion
    way = -1024 * np.array([frame.map.displacement[row, column] for frame in frames])
    along = way @ (22, 15) / AMPLITUDE
    across = way @ (-15, 22) / AMPLITUDE
    figures = {
        "swing_px": float(along.max() - along.min()) / 2,
        "drift_px": float(abs(along.max() + along.min())) / 2,
        "across_px": float(np.abs(across).max()),
        "jacobian_min": min(frame.quality.jacobian_min for frame in frames),
        "jacobian_max": max(frame.quality.jacobian_max for frame in frames),
        "frame_side_px": side,
    }
    assert 0.5 * AMPLITUDE < figures["swing_px"] < 1.5 * AMPLITUDE, figures
    assert figures["drift_px"] < 0.5 * AMPLITUDE, figures
    assert 0.95 < figures["jacobian_min"] <= figures["jacobian_max"] < 1.05, figures
    return figures


def main():
    """Write the animation and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="raccoon.gif", help="x.gif or x.####.png (raccoon.gif)")
    parser.add_argument("--frames", type=int, default=31, help="frames to make, at 15 a second (31)")
    parser.add_argument("--cells", type=int, default=256, help="cells along the longer side (256)")
    parser.add_argument("--width", type=int, default=480, help="width of the frames [px] (480)")
    parser.add_argument("--device", default=None, help="cpu (default), cuda, …")
    options = parser.parse_args()
    if options.frames < 2:
        parser.error("--frames: expected 2 or more")
    made = animation((options.frames - 1) / 15, 15.0, options.cells, options.width, options.device)
    seen = []

    def kept():
        for frame in made.frames():
            seen.append(frame)
            yield frame

    written = write_animation(options.output, kept(), fps=15.0)
    print(f"{written[-1]}: {len(seen)} frames")
    if options.frames > 15 and (options.frames - 1) % 15 == 0:
        print(check(seen))
    return 0


if __name__ == "__main__":
    sys.exit(main())
