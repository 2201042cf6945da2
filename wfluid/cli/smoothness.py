"""How smoothly a run moves its picture: longest displacement beside the longest arrow, and strain."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from wfluid.animation.frame import Frame
from wfluid.morphing.frame import MorphFrame

FARTHEST = 2.0
"""Longest displacement without a warning, in lengths of the longest arrow."""

LEAST_WAY = 2 / 512
"""Displacements up to this one are never too long [longer side]."""

STRAIN_LIMIT = 1.0
"""Largest log-strain without a warning: lengths change by a factor of at most e = 2.7."""


@dataclass
class Smoothness:
    """Displacement and strain of a run, collected frame by frame."""

    side: float
    """The longer side [px]."""
    arrow: float | None = None
    """The longest arrow [longer side]; None if not everything that moves has one."""
    longest: float = field(default=0.0, init=False)
    """The longest displacement [longer side]."""
    log_strain: float = field(default=0.0, init=False)
    """The largest log-strain of a frame; 99 % of its cells have less."""
    time: float = field(default=0.0, init=False)
    """Time of that frame [s]."""
    frame: int = field(default=0, init=False)
    """Number of that frame, from 0."""

    def add(self, frame: Frame) -> None:
        """Add the measures of a frame; of a morph, those of both pictures."""
        to_quality = frame.to_quality if isinstance(frame, MorphFrame) else None
        for quality in filter(None, (frame.quality, to_quality)):
            self.longest = max(self.longest, quality.displacement_max)
            if quality.log_strain > self.log_strain:
                self.log_strain, self.frame, self.time = quality.log_strain, frame.index, frame.time

    def as_dict(self) -> dict[str, Any]:
        """The figures as the report has them."""
        return {
            "longest_px": self.longest * self.side,
            "longest_arrow_px": None if self.arrow is None else self.arrow * self.side,
            "log_strain_p99": self.log_strain,
            "log_strain_p99_frame": self.frame,
        }

    def __str__(self) -> str:
        """In words."""
        arrow = "" if self.arrow is None else f", the longest arrow has {self.arrow * self.side:.3g} px"
        return (
            f"moved by at most {self.longest * self.side:.3g} px{arrow}, "
            f"stretched by a factor of at most {math.exp(self.log_strain):.3g} in 99 % of the picture"
        )

    def complaint(self) -> str:
        """What is too rough, in words; empty if nothing is."""
        found = []
        if self.arrow is not None and self.longest > max(FARTHEST * self.arrow, LEAST_WAY):
            found.append(
                f"moves by up to {self.longest * self.side:.3g} px, more than twice its longest arrow of "
                f"{self.arrow * self.side:.3g} px"
            )
        if self.log_strain > STRAIN_LIMIT:
            found.append(
                f"is distorted: 1 % of frame {self.frame} ({self.time:.3g} s) is stretched by a factor of "
                f"more than {math.exp(self.log_strain):.2g}"
            )
        return f"the picture {' and '.join(found)}" if found else ""
