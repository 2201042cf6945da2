"""What is said of a result that is not good enough, and the exit code that goes with it."""

from __future__ import annotations

import sys
from collections.abc import Callable

from wfluid.animation.animation import Animation
from wfluid.animation.loops import Seam
from wfluid.cli.exits import Exit
from wfluid.cli.report import Report
from wfluid.keyframes.match import REACHED, STOPPED, Match

STREAMED = 0.5
"""Part of the longest displacement that an oscillating loop may stream before that is noted."""


def judge_match(match: Match, side: float, timed: bool) -> Exit:
    """Say which points are not where they should be, with their times if they are `timed`."""
    if match.status == REACHED:
        return Exit.DONE
    worst, allowed = (f"{length * side:.3g} px" for length in (match.residual, match.tolerance))
    text = f"the farthest point is {worst} from its keyframe, {allowed} are allowed"
    print(f"wfluid: {match.status}: {text}", file=sys.stderr)
    for arrival in match.arrivals:
        if arrival.residual > match.tolerance:
            print(f"wfluid: {arrival.describe(side, timed=timed)}", file=sys.stderr)
    return Exit.INTERRUPTED if match.status == STOPPED else Exit.FAILED


def judge_folds(least: float) -> Exit:
    """Say whether a map folds, whose least det J is given."""
    if least > 0:
        return Exit.DONE
    advice = "leave out points that pass close by one another, or use more cells"
    print(f"wfluid: the picture folds over itself (det J {least:.2g}); {advice}", file=sys.stderr)
    return Exit.FAILED


def judge_loop(animation: Animation, seam: Seam, report: Report, note: Callable[[str], None]) -> None:
    """Note a loop that had to be bent far to close."""
    drift, longest = seam.drift_max, report.extremes["displacement_max_px"]
    side = max(animation.picture.width, animation.picture.height)
    if animation.loop == "oscillate" and drift * side > STREAMED * longest:
        note(
            f"the flow streams {drift * side:.0f} px over the loop, which was taken off its frames; "
            "a loop of one period, more viscosity or a smaller force streams less"
        )
