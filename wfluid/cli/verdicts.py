"""Messages about results that are not good enough, and their exit codes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from wfluid.animation.animation import Animation
from wfluid.animation.loops import Seam
from wfluid.cli.exits import Exit
from wfluid.cli.folds import Folds
from wfluid.cli.report import Report
from wfluid.cli.smoothness import Smoothness
from wfluid.keyframes.match import REACHED, STOPPED, Match

STREAMED = 0.5
"""Largest drift of an oscillating loop without a note, relative to the largest displacement."""


def judge_match(match: Match, side: float, timed: bool, verbose: bool = False) -> Exit:
    """Print the points that miss their targets, with the times of keyframes if `timed`."""
    if match.status == REACHED:
        return Exit.DONE
    worst, allowed = (f"{length * side:.3g} px" for length in (match.residual, match.tolerance))
    text = f"the farthest point is {worst} from its target: at most {allowed} are allowed"
    if verbose:
        text += f" (after {match.iterations} iterations and {match.evaluations} evaluations)"
    print(f"wfluid: {match.status}: {text}", file=sys.stderr)
    for arrival in match.arrivals:
        if arrival.residual > match.tolerance:
            print(f"wfluid: {arrival.describe(side, timed=timed)}", file=sys.stderr)
    return Exit.INTERRUPTED if match.status == STOPPED else Exit.FAILED


def judge_folds(folds: Folds, least: float, allowed: bool, remedy: str) -> Exit:
    """Print the folds of the frames, or of the flow between them, whose smallest det J is `least`.

    Folds that are allowed are only a warning.
    """
    if not folds.frames and least > 0:
        return Exit.DONE
    text = str(folds) if folds.frames else f"the picture folds, its smallest det J is {least:.2g}"
    if allowed:
        print(f"wfluid: warning: {text}", file=sys.stderr)
        return Exit.DONE
    print(f"wfluid: {text}; try {remedy}; --allow-folds accepts it", file=sys.stderr)
    return Exit.FAILED


def ending(
    written: Sequence[str], report: Report | None, match: Match | None, side: float, seconds: float
) -> str:
    """The last line of a command: what was written, how long it took, and the worst figures.

    `side` is the longer side in the scene's pixels.
    """
    text = f"wrote {', '.join(written) or 'nothing'} in {seconds:.1f} s"
    figures = []
    if report:
        text += f", {report.frames} frame{'s' if report.frames > 1 else ''}"
        seen = report.extremes
        figures.append(str(report.smoothness))
        figures.append(f"areas {seen['jacobian_min']:.2f} … {seen['jacobian_max']:.2f} of what they were")
    if match:
        figures.append(f"the farthest point {match.residual * side:.3g} px from its target")
    return f"{text}: {', '.join(figures)}" if figures else text


def judge_smoothness(smoothness: Smoothness, remedy: str) -> None:
    """Print a warning if the picture moves too far or is strained too much."""
    if complaint := smoothness.complaint():
        print(f"wfluid: warning: {complaint}; try {remedy}", file=sys.stderr)


def judge_loop(animation: Animation, seam: Seam, report: Report, note: Callable[[str], None]) -> None:
    """Note a loop whose frames were corrected by a large drift."""
    drift, longest = seam.drift_max, report.extremes["displacement_max_px"]
    side = max(animation.picture.width, animation.picture.height)
    if animation.loop == "oscillate" and drift * side > STREAMED * longest:
        note(
            f"the picture drifts by {drift * side:.0f} px over a lap, taken off its frames: "
            "a loop of one period, more viscosity or a smaller force drifts less"
        )
