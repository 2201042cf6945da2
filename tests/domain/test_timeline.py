"""Frame rates and the times of frames."""

from fractions import Fraction

import pytest

from wfluid.domain.timeline import Timeline, exact_rate


@pytest.mark.parametrize(
    ("fps", "exact"),
    [
        (29.97, Fraction(30000, 1001)),
        (23.976, Fraction(24000, 1001)),
        (23.98, Fraction(24000, 1001)),
        (59.94, Fraction(60000, 1001)),
        (119.88, Fraction(120000, 1001)),
        (30000 / 1001, Fraction(30000, 1001)),
        (24.0, Fraction(24)),
        (30.0, Fraction(30)),
        (12.5, Fraction(25, 2)),
        (29.9, Fraction(299, 10)),
    ],
)
def test_a_rounded_rate_is_the_one_that_it_stands_for(fps, exact):
    assert exact_rate(fps) == exact
    assert Timeline(2.0, fps).fps == pytest.approx(float(exact), rel=1e-15)


def test_frames_keep_time_with_television():
    timeline = Timeline(1001 / 30, 29.97)
    assert timeline.frames == 1001 and timeline.end == pytest.approx(1000 * 1001 / 30000, rel=1e-14)
