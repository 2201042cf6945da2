"""Two pictures made to cover one frame, with the same channels, so that they can be blended."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.limits import FITS
from wfluid.domain.paths import Place
from wfluid.pictures.picture import Picture


@dataclass(frozen=True, eq=False)
class PicturePair:
    """Two pictures of one kind; the second fitted to the frame of the first."""

    a: Picture
    """The first picture."""
    b: Picture
    """The visible part of the second picture, to be stretched over the frame."""
    window: Window
    """The pixels of the second picture that are visible."""
    size: tuple[int, int]
    """Width and height of the second picture before it was cropped [px]."""
    notes: tuple[str, ...]
    """Changes to the pictures that a user should know."""

    def place(self, point: Place, extent: tuple[float, float]) -> Place:
        """The place of a point of the second picture [px] in a frame of that extent [longer side].

        Raises:
            ValueError: a point outside the picture, or in a part that is cropped.
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
    """A rectangle of a picture that covers a frame; it exceeds the picture where there are bars."""

    x: int
    """Left edge [px]."""
    y: int
    """Top edge [px]."""
    width: int
    """Width [px], 1 or more."""
    height: int
    """Height [px], 1 or more."""

    def pixels(self, extent: tuple[float, float]) -> np.ndarray:
        """Pixels of the picture along x and y that correspond to one longer side of the frame."""
        return np.array([self.width / extent[0], self.height / extent[1]])


def window(size: tuple[int, int], frame: tuple[int, int], fit: str) -> Window:
    """The window of a picture that covers a frame, sizes as (width, height) [px], to the nearest pixel.

    "fill" shows the largest middle part with the frame's aspect, "fit" the full picture with bars,
    "stretch" the full picture with its aspect changed.

    Raises:
        ValueError: an unknown fit.
    """
    check_word("fit", fit, FITS)
    width, height = size
    if fit == "stretch":
        return Window(0, 0, width, height)
    aspect = frame[0] / frame[1]
    if (width > height * aspect) == (fit == "fill"):
        visible = max(1, round(height * aspect)), height
    else:
        visible = width, max(1, round(width / aspect))
    return Window((width - visible[0]) // 2, (height - visible[1]) // 2, *visible)


def cropped(picture: Picture, through: Window) -> Picture:
    """The pixels in a window; outside the picture they are 0: black, and transparent where there is alpha."""
    if (through.x, through.y, through.width, through.height) == (0, 0, picture.width, picture.height):
        return picture
    pixels = np.zeros((through.height, through.width, picture.pixels.shape[2]), dtype=np.float32)
    x, y = max(0, -through.x), max(0, -through.y)
    part = picture.pixels[max(0, through.y) :, max(0, through.x) :][: through.height - y, : through.width - x]
    pixels[y : y + part.shape[0], x : x + part.shape[1]] = part
    return replace(picture, pixels=pixels)


def paired(a: Picture, b: Picture, fit: str) -> PicturePair:
    """The pair of pictures of a morph: fitted as by `window`, with the same channels as by `alike`.

    Raises:
        ValueError: an unknown fit, or pictures that cannot be blended.
    """
    through = window((b.width, b.height), (a.width, a.height), fit)
    first, second, notes = alike(a, b)
    return PicturePair(first, cropped(second, through), through, (b.width, b.height), tuple(notes))


def alike(a: Picture, b: Picture) -> tuple[Picture, Picture, list[str]]:
    """Both pictures with the same channels, and notes on what was added: colours for grey, opaque alpha.

    Raises:
        ValueError: numbers of colours that differ and are not 1 and 3; data with colours.
    """
    if a.data != b.data:
        raise ValueError("one picture has colours, the other numbers (data): they cannot be blended")
    if (a.pixels.shape[2], a.alpha) == (b.pixels.shape[2], b.alpha):
        return a, b, []
    pixels = [picture.pixels[..., picture.color_channels] for picture in (a, b)]
    notes, names = [], ("the first", "the second")
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
    first, second = (
        replace(picture, pixels=values, alpha=alpha) for picture, values in zip((a, b), pixels, strict=True)
    )
    return first, second, notes
