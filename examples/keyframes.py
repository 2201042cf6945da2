"""Figure 3: arrows on the cat, and the forces that take its points to the arrows' tips.

Particle keyframes (section III of "Control Methods for Fluid-Based Image Warping", Bonilla & Velho): eyes,
nose, mouth and cheeks follow arrows, the forehead and the roots of the ears are pinned. Only the arrows are
given; a search with the adjoint gradient finds the forces. `check()` asserts that every point is within a
quarter of a pixel of its target, both along the flow and in the picture, and that nothing folds.

    python examples/keyframes.py --output keyframes.gif --plot keyframes.png
"""

import argparse
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

PICTURE = Path(__file__).parent / "images" / "cat.png"

SIDE = 451
"""The cat's longer side [px]."""

ARROWS = {
    "left eye": ((172, 115), (158, 103)),
    "right eye": ((318, 137), (334, 127)),
    "nose": ((265, 245), (262, 226)),
    "left mouth": ((205, 262), (184, 250)),
    "right mouth": ((310, 262), (328, 251)),
}
"""Points and their targets [px]."""

PINS = ((235, 40), (60, 60), (392, 95))
"""Pinned points [px]."""

TOLERANCE = 0.25 / SIDE


def matched(cells=256, seconds=1.0, arrows=tuple(ARROWS), device=None):
    """The forces that move the cat's points along the arrows, or along some of them."""
    animation = Animation(
        read_picture(PICTURE), Fluid(viscosity=0.005), [], Timeline(seconds, 24, 2), cells, device=device
    )
    keyframes = [
        ParticleKeyframe((x / SIDE, y / SIDE), (to_x / SIDE, to_y / SIDE), seconds)
        for (x, y), (to_x, to_y) in map(ARROWS.get, arrows)
    ]
    pins = [(x / SIDE, y / SIDE) for x, y in PINS]
    return match_keyframes(animation, keyframes, pins=pins, tolerance=TOLERANCE)


def check(match):
    """Every target is reached, in the flow and in the picture, without a fold. Returns the figures."""
    figures = {
        "residual_px": match.residual * SIDE,
        "jacobian_min": match.jacobian[0],
        "jacobian_max": match.jacobian[1],
        "forces": len(match.found),
        "evaluations": match.evaluations,
        "seconds": match.seconds["total"],
    }
    assert figures["residual_px"] <= 0.25, [arrival.describe(SIDE) for arrival in match.arrivals]
    assert figures["jacobian_min"] > 0.5, figures
    return figures


def main():
    """Find the forces, write the animation, there and back, and check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--output", default="keyframes.gif")
    parser.add_argument("--plot", help="draw the figure too (needs matplotlib)")
    parser.add_argument("--cells", type=int, default=256)
    parser.add_argument("--device", default=None)
    options = parser.parse_args()
    match = matched(options.cells, device=options.device)
    frames = list(match.animation.frames())
    write_animation(options.output, frames + frames[-2:0:-1], fps=24)
    if options.plot:
        from wfluid.keyframes.plot import plot_match

        plot_match(match, options.plot)
    for name, value in check(match).items():
        print(f"{name}: {value:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
