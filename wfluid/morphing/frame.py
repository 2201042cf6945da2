"""One frame of a morph."""

from __future__ import annotations

from dataclasses import dataclass

from wfluid.animation.frame import Frame
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.quality import MapQuality


@dataclass(frozen=True)
class MorphFrame(Frame):
    """A frame of a morph: `map` and `quality` are those of the first picture.

    `points` are the keyframes' points, but with a timing mask, by which they have no one place.
    """

    to_map: CoordinateMap | None = None
    """Where in the second picture, stretched over the frame, its colours come from."""
    to_quality: MapQuality | None = None
    """What that map does to the second picture."""
