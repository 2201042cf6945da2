"""One frame of a morph."""

from __future__ import annotations

from dataclasses import dataclass

from wfluid.animation.frame import Frame
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import MapQuality


@dataclass(frozen=True, repr=False)
class MorphFrame(Frame):
    """A frame of a morph: `map` and `quality` are those of the first picture.

    `points` are the keyframes' points; none with a timing mask, where a point has no single place.
    """

    to_map: CoordinateMap | None = None
    """Backward map into the second picture, which is stretched over the frame."""
    to_quality: MapQuality | None = None
    """Measures of that map."""
