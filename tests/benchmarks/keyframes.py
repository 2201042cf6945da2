"""Particle keyframes: how near points come, at what cost, beside scikit-image's thin-plate spline.

Each case of the tests, on a picture of 512 pixels, in 48 steps a second. The spline interpolates the same
points at their last destinations, pins and corners in place: at once, but nothing keeps it from folding, and
it has no way between.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from keyframe_cases import CASES, SIDE

LENGTHEN = 1.0
"""Least duration [s]: what the tests do in half of it."""


def spline(case):
    """Residual [px], least det J and seconds of the spline; None without scikit-image."""
    try:
        from skimage.transform import ThinPlateSplineTransform
    except ImportError:
        return None
    last = max(keyframe.time for keyframe in case.keyframes)
    width, height = 1.0, case.height / SIDE
    still = [*case.pins, (0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]
    pairs = [(k.point, k.destination) for k in case.keyframes if k.time == last] + [(p, p) for p in still]
    points, destinations = (SIDE * np.array(column) for column in zip(*pairs, strict=True))
    began = time.perf_counter()
    transform = ThinPlateSplineTransform.from_estimate(destinations, points)
    y, x = np.mgrid[0 : case.height, 0:SIDE] + 0.5
    source = transform(np.stack([x.ravel(), y.ravel()], axis=1)).reshape(case.height, SIDE, 2)
    seconds = time.perf_counter() - began
    down, across = np.gradient(source, axis=0), np.gradient(source, axis=1)
    det = across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0]
    residual = np.linalg.norm(transform(destinations) - points, axis=1).max()
    return f"{residual:.1e} | {det.min():.2f} | {seconds:.2f}"


def lengthened(case, cells):
    """A case on another grid; arrows get more time."""
    short = case.arrows and case.duration < LENGTHEN
    return replace(case, cells=cells, duration=LENGTHEN if short else case.duration)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, default=256)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--only", help="the cases with this in their name")
    options = parser.parse_args()
    print(f"{options.cells} cells on {options.device}; seconds: all (simulation, adjoint, the rest)\n")
    head = "| case | points + pins | steps | forces | iterations | evaluations | s | status | px | det J "
    print(head + "| spline: px | least det J | s |\n" + "|---" * 13 + "|")
    for name, case in CASES.items():
        if options.only and options.only not in name:
            continue
        case = lengthened(case, options.cells)
        match = case.match(options.device)
        spent, (least, greatest) = match.seconds, match.jacobian
        split = ", ".join(f"{spent[key]:.1f}" for key in ("simulation", "adjoint", "optimiser"))
        points = len({keyframe.point for keyframe in case.keyframes})
        print(
            f"| {name} | {points} + {len(case.pins)} | {match.animation.timeline.steps} | {len(match.found)} "
            f"| {match.iterations} | {match.evaluations} | {spent['total']:.1f} ({split}) | {match.status} "
            f"| {match.residual * SIDE:.3f} | {least:.3f} … {greatest:.3f} | {spline(case) or '| |'} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
