"""A nose on a leash: one point follows a path, others are pinned.

The raccoon's nose has eight targets on a circle, a quarter of a second apart, while its eyes are pinned:
several keyframes of one particle (section III of "Control Methods for Fluid-Based Image Warping", Bonilla &
Velho). `check()` asserts that the nose is at each target in time.

    python examples/keyframe_path.py --output keyframe_path.gif
"""

import argparse
import math
import sys
from pathlib import Path

from wfluid import (
    Animation,
    Fluid,
    ParticleKeyframe,
    Timeline,
    match_keyframes,
    read_picture,
    write_animation,
)

PICTURE = Path(__file__).parent / "images" / "raccoon.jpg"

SIDE = 1024
"""The raccoon's longer side [px]."""

NOSE, EYES = (621, 451), ((577, 307), (722, 333))

RADIUS, STOPS, SECONDS = 28.0, 8, 2.0
"""Radius of the circle [px], targets on it, and duration of one turn [s]."""


def places(stops=STOPS):
    """Targets and times of the nose: once round a circle above it and back to its place [px, s]."""
    for n in range(1, stops + 1):
        turn = 2 * math.pi * n / STOPS
        at = NOSE[0] + RADIUS * math.sin(turn), NOSE[1] - RADIUS * (1 - math.cos(turn))
        yield at, SECONDS * n / STOPS


def matched(cells=192, width=480, stops=STOPS, device=None):
    """The forces that lead the nose round, or only to the first few targets."""
    animation = Animation(
        read_picture(PICTURE),
        Fluid(viscosity=0.005),
        [],
        Timeline(SECONDS * stops / STOPS, 12, 4),
        cells,
        width=width,
        height=round(width * 768 / 1024),
        device=device,
    )
    nose = (NOSE[0] / SIDE, NOSE[1] / SIDE)
    keyframes = [ParticleKeyframe(nose, (x / SIDE, y / SIDE), time) for (x, y), time in places(stops)]
    eyes = [(x / SIDE, y / SIDE) for x, y in EYES]
    return match_keyframes(animation, keyframes, pins=eyes)


def check(match, stops=STOPS):
    """Every target is reached in time, to a quarter of a pixel of 512, without a fold; the figures."""
    figures = {
        "residual_px": match.residual * SIDE,
        "keyframes": len(match.arrivals),
        "jacobian_min": match.jacobian[0],
        "evaluations": match.evaluations,
        "seconds": match.seconds["total"],
    }
    assert figures["keyframes"] == stops * (1 + len(EYES)), figures
    assert figures["residual_px"] <= 0.25 * SIDE / 512, [arrival.describe(SIDE) for arrival in match.arrivals]
    assert figures["jacobian_min"] > 0.3, figures
    return figures


def main():
    """Find the forces, write the animation, and check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--output", default="keyframe_path.gif")
    parser.add_argument("--cells", type=int, default=192)
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("--device", default=None)
    options = parser.parse_args()
    match = matched(options.cells, options.width, device=options.device)
    write_animation(options.output, match.animation.frames(), fps=12)
    for name, value in check(match).items():
        print(f"{name}: {value:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
