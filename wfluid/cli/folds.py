"""Frames in which the picture folds: where, when and how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wfluid.animation.frame import Frame
from wfluid.morphing.frame import MorphFrame
from wfluid.view.quality import MapQuality


@dataclass(frozen=True)
class Fold:
    """The fold of one frame: the cells whose det J is 0 or less."""

    frame: int
    """Number of the frame, from 0."""
    time: float
    """Time of the frame [s]."""
    place: tuple[float, float]
    """Position x, y of the least det J [px of the frame]."""
    jacobian: float
    """The least det J."""
    area: float
    """Area that is folded [square px of the frame]."""
    second: bool
    """Whether the second picture of a morph folds."""

    @classmethod
    def of(cls, frame: Frame, quality: MapQuality, second: bool) -> Fold:
        """The fold of a frame, from the measures of one of its maps."""
        width, height = frame.picture.width, frame.picture.height
        side, (x, y) = max(width, height), quality.jacobian_min_at
        area = quality.fold_fraction * width * height
        return cls(frame.index, frame.time, (x * side, y * side), quality.jacobian_min, area, second)

    def as_dict(self) -> dict[str, Any]:
        """The fold as the report has it."""
        return {
            "frame": self.frame,
            "time": self.time,
            "at_px": list(self.place),
            "jacobian_min": self.jacobian,
            "area_px": self.area,
        }


class Folds:
    """The folds of a run, collected frame by frame."""

    def __init__(self) -> None:
        self.frames: int = 0
        self.first: Fold | None = None
        self.worst: Fold | None = None
        self.area: float = 0.0
        self._seen, self._size = 0, (0, 0)

    frames: int
    """Number of frames that fold."""
    first: Fold | None
    """The fold of the first of these frames."""
    worst: Fold | None
    """The fold with the least det J."""
    area: float
    """The largest area that is folded in a frame [square px]."""

    def add(self, frame: Frame) -> None:
        """Add the folds of a frame; of a morph, those of both pictures."""
        self._seen += 1
        self._size = frame.picture.width, frame.picture.height
        to_quality = frame.to_quality if isinstance(frame, MorphFrame) else None
        folds = [
            Fold.of(frame, quality, second)
            for quality, second in ((frame.quality, False), (to_quality, True))
            if quality and not quality.jacobian_min > 0
        ]
        self.frames += bool(folds)
        for fold in folds:
            self.first = self.first or fold
            self.area = max(self.area, fold.area)
            if self.worst is None or fold.jacobian < self.worst.jacobian:
                self.worst = fold

    def as_dict(self) -> dict[str, Any]:
        """The folds as the report has them."""
        found: dict[str, Any] = {"frames": self.frames, "area_max_px": self.area}
        if self.first and self.worst:
            found |= {"first": self.first.as_dict(), "worst": self.worst.as_dict()}
        return found

    def __str__(self) -> str:
        """In words: how many frames, when, where and how much."""
        if self.first is None or self.worst is None:
            return "the picture does not fold"
        worst, (x, y), (width, height) = self.worst, self.worst.place, self._size
        which = "the second picture" if worst.second else "the picture"
        return (
            f"{which} folds in {self.frames} of {self._seen} frames, first in frame {self.first.frame} "
            f"({self.first.time:.3g} s), most in frame {worst.frame} ({worst.time:.3g} s) "
            f"at {x:.0f},{y:.0f} of {width} x {height} px: det J {worst.jacobian:.2g}, "
            f"up to {self.area:.3g} square px folded"
        )
