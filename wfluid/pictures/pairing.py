"""Two pictures made to cover one frame, with the same channels, so that they can be blended."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from wfluid.domain.paths import Place
from wfluid.pictures.picture import Picture

FITS = ("fill", "fit", "stretch")
"""Cut off what is over; leave bars; change the aspect."""


@dataclass(frozen=True, eq=False)
class PicturePair:
    """Two pictures of one kind; the second fitted to the frame of the first."""

    a: Picture
    """The first picture."""
    b: Picture
    """What is seen of the second, to be stretched over the frame."""
    window: Window
    """What that is."""
    size: tuple[int, int]
    """Width and height of all of the second picture [px]."""
    notes: tuple[str, ...]
    """What was done to them that a user should know."""

    def place(self, point: Place, extent: tuple[float, float]) -> Place:
        """Where in a frame of that extent [longer side] a point of the second picture [px] is seen.

        Raises:
            ValueError: a point that is outside the picture, or cut off.
        """
        (x, y), (width, height), through = point, self.size, self.window
        shown = f"the point {x:.6g},{y:.6g} of the second picture"
        if not (0 <= x <= width and 0 <= y <= height):
            raise ValueError(f"{shown} lies outside it, {width:g} x {height:g}")
        if not (0 <= x - through.x <= through.width and 0 <= y - through.y <= through.height):
            raise ValueError(f"{shown} is cut off: fit or stretch the picture instead of filling the frame")
        return (x - through.x) / through.width * extent[0], (y - through.y) / through.height * extent[1]


@dataclass(frozen=True)
class Window:
    """The pixels of a picture that cover a frame: beyond its edges where there are bars."""

    x: int
    """Of its left edge [px]."""
    y: int
    """Of its top edge [px]."""
    width: int
    """Pixels along x, 1 or more."""
    height: int
    """Pixels along y, 1 or more."""

    def pixels(self, extent: tuple[float, float]) -> np.ndarray:
        """Pixels of the picture that one longer side of the frame shows, along x and y."""
        return np.array([self.width / extent[0], self.height / extent[1]])


def window(size: tuple[int, int], frame: tuple[int, int], how: str) -> Window:
    """What of a picture of a size covers a frame, both (width, height) [px], to the nearest whole pixel.

    "fill" shows its middle, as large as the frame's aspect allows; "fit" all of it with bars; "stretch" all.

    Raises:
        ValueError: no such fit.
    """
    if how not in FITS:
        raise ValueError(f"fit {how!r}: expected one of {', '.join(FITS)}")
    width, height = size
    if how == "stretch":
        return Window(0, 0, width, height)
    aspect = frame[0] / frame[1]
    if (width > height * aspect) == (how == "fill"):
        seen = max(1, round(height * aspect)), height
    else:
        seen = width, max(1, round(width / aspect))
    return Window((width - seen[0]) // 2, (height - seen[1]) // 2, *seen)


def seen(picture: Picture, through: Window) -> Picture:
    """The pixels in a window; outside the picture they are 0: black, and transparent where there is alpha."""
    if (through.x, through.y, through.width, through.height) == (0, 0, picture.width, picture.height):
        return picture
    pixels = np.zeros((through.height, through.width, picture.pixels.shape[2]), dtype=np.float32)
    x, y = max(0, -through.x), max(0, -through.y)
    part = picture.pixels[max(0, through.y) :, max(0, through.x) :][: through.height - y, : through.width - x]
    pixels[y : y + part.shape[0], x : x + part.shape[1]] = part
    return replace(picture, pixels=pixels)


def paired(a: Picture, b: Picture, fit: str) -> PicturePair:
    """Two pictures as a morph needs them: see `window` and `alike`.

    Raises:
        ValueError: no such fit; pictures that cannot be blended.
    """
    through = window((b.width, b.height), (a.width, a.height), fit)
    first, second, notes = alike(a, b)
    return PicturePair(first, seen(second, through), through, (b.width, b.height), tuple(notes))


def alike(a: Picture, b: Picture) -> tuple[Picture, Picture, list[str]]:
    """Both pictures with the same channels, and what was added: grey shown as colour, opaque alpha.

    Raises:
        ValueError: other numbers of colours than 1 and 3 that differ; data and colours.
    """
    if a.data != b.data:
        raise ValueError("one picture has colours, the other numbers (data): they cannot be blended")
    if (a.pixels.shape[2], a.alpha) == (b.pixels.shape[2], b.alpha):
        return a, b, []
    notes, pixels, names = [], [_colours(a), _colours(b)], ("the first", "the second")
    counts = [values.shape[2] for values in pixels]
    if counts[0] != counts[1]:
        if sorted(counts) != [1, 3]:
            raise ValueError(f"{counts[0]} channels and {counts[1]}: pictures of one kind can be blended")
        grey = counts.index(1)
        pixels[grey] = np.repeat(pixels[grey], 3, axis=2)
        notes.append(f"{names[grey]} picture is grey, the other has colours: it is shown as colours")
    alpha = None
    if a.alpha is not None or b.alpha is not None:
        alpha = pixels[0].shape[2]
        for n, picture in enumerate((a, b)):
            if picture.alpha is None:
                opacity = np.ones_like(pixels[n][..., :1])
                notes.append(f"{names[n]} picture has no alpha, the other has: it is taken as opaque")
            else:
                opacity = picture.pixels[..., [picture.alpha]]
            pixels[n] = np.concatenate([pixels[n], opacity], axis=2)
    a, b = (replace(one, pixels=its, alpha=alpha) for one, its in zip((a, b), pixels, strict=True))
    return a, b, notes


def _colours(picture: Picture) -> np.ndarray:
    """All channels but alpha."""
    channels = [channel for channel in range(picture.pixels.shape[2]) if channel != picture.alpha]
    return picture.pixels[..., channels]
