"""The settings of a morph: timing curves, blending, order of frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from wfluid.domain.curves import Curve, curve_of
from wfluid.domain.limits import DELAY, DELAY_LIMIT, EASE
from wfluid.domain.timeline import Timeline
from wfluid.model.painted import Painted, as_weight
from wfluid.pictures.blend import check_light


@dataclass(frozen=True)
class MorphSettings:
    """Timing, curves and blending of a morph.

    Raises:
        ValueError: an unknown curve or space to blend in, keys of a curve outside the duration, or a delay
            outside 0 … 0.9.
    """

    timeline: Timeline
    """Times of the frames; the first frame is the first picture, the last frame the second."""
    warp_curve: str | Curve | Mapping[float, float] = EASE
    """Fraction of the points' ways that is covered: "linear", "ease", or values 0 … 1 by time [s]."""
    blend_curve: str | Curve | Mapping[float, float] = EASE
    """Weight of the second picture in the blend, given in the same way."""
    blend: str = "linear"
    """Space to blend in: "linear" light or "display" values."""
    mask: Painted | None = None
    """Timing mask, or a picture or an array of it, 1 (white) where the morph happens first."""
    delay: float = DELAY
    """Delay where the mask is black, a fraction of the duration."""
    reverse: bool = False
    """Whether the frames are shown in reverse, from the second picture to the first."""
    pingpong: bool = False
    """Whether the frames between the ends are repeated in reverse after the last, for an endless loop."""

    def __post_init__(self) -> None:
        for name in ("warp_curve", "blend_curve"):
            object.__setattr__(self, name, curve_of(getattr(self, name), self.timeline.duration))
        check_light(self.blend)
        object.__setattr__(self, "mask", as_weight("timing mask", self.mask))
        if not 0 <= self.delay <= DELAY_LIMIT:
            raise ValueError(f"delay {self.delay}: expected a part of the time, 0 … {DELAY_LIMIT}")
        if self.mask is not None and self.mask.values.max() > 1:
            raise ValueError("a timing mask: expected values 0 … 1")

    @property
    def order(self) -> list[int]:
        """Indices of the frames, counted from the first picture, in the order of display."""
        frames = list(range(self.timeline.frames))
        frames = frames[::-1] if self.reverse else frames
        return frames + frames[-2:0:-1] if self.pingpong else frames
