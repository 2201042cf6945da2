"""The picture seen through a map: host side of `kernels/lookup.py`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import warp as wp

from wfluid.device import LAUNCHES, Replay, exclusive, free_cores, helpers
from wfluid.grid import Grid
from wfluid.kernels import lookup
from wfluid.kernels.cells import HALO, Layout, Real, whole_spans
from wfluid.picture import Picture
from wfluid.state import field
from wfluid.walls import Ghosts, Walls

FILTERS = {
    "nearest": lookup.look_up_nearest,
    "bilinear": lookup.look_up_bilinear,
    "cubic": lookup.look_up_cubic,
    "lanczos": lookup.look_up_lanczos,
}
EDGES = {"clamp": 0, "mirror": 1, "wrap": 2, "transparent": 3}

STRIPS = 8
"""Most threads that share a look-up."""

_QUAD = 4


def check_look_up(filter: str, edge: str) -> None:
    """Refuse a filter or an edge that does not exist.

    Raises:
        ValueError: with those that do.
    """
    for name, value, known in (("filter", filter, FILTERS), ("edge", edge, EDGES)):
        if value not in known:
            raise ValueError(f"{name} {value!r}: expected one of {', '.join(known)}")


class PictureOnDevice:
    """A picture's channels in device memory, four at a time, ready to be looked up in.

    With the transparent edge a picture without alpha gains one, so that what lies outside shows.
    """

    def __init__(self, picture: Picture, transparent: bool, device: wp.Device):
        pixels = np.asarray(picture.pixels, dtype=np.float32)
        self.alpha = picture.alpha
        if transparent and self.alpha is None:
            self.alpha = pixels.shape[2]
            pixels = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)
        self.height, self.width, self.channels = pixels.shape
        padded = np.pad(pixels, ((0, 0), (0, 0), (0, -self.channels % _QUAD)))
        self.quads = [
            wp.array(
                np.ascontiguousarray(padded[..., first : first + _QUAD]).reshape(-1, _QUAD),
                dtype=lookup.Pixel,
                device=device,
            )
            for first in range(0, padded.shape[2], _QUAD)
        ]


class LookUp:
    """Renders a picture through displacements on a fluid's grid, at a size of its own.

    `edge` holds for axes between walls; a periodic axis always wraps. On a CPU the rows are shared
    between its cores.
    """

    @exclusive
    def __init__(
        self,
        picture: Picture,
        grid: Grid,
        walls: Walls,
        device: wp.Device,
        *,
        width: int | None = None,
        height: int | None = None,
        filter: str = "cubic",
        edge: str = "clamp",
    ):
        check_look_up(filter, edge)
        self.device = device
        self.picture = picture
        self._source = PictureOnDevice(picture, edge == "transparent", device)
        self._program = FILTERS[filter]
        self._edges = [EDGES["wrap" if periodic else edge] for periodic in walls.periodic]
        self.width, self.height = width or picture.width, height or picture.height
        self._grid = Layout(grid.nx, grid.ny)
        self._strip = Layout(grid.nx, self.height)
        self._layout = Layout(self.width, self.height)
        self._columns = _cubic_tables(grid.nx, self.width, -1, device)
        self._rows = _cubic_tables(grid.ny, self.height, HALO, device)
        rules = (walls.moved_x_rules(), walls.moved_y_rules())
        self._ghosts = [Ghosts(self._strip, axis, device) for axis in rules]
        self._stretched = [field(self._strip, device) for _ in range(2)]
        self._still = field(self._grid, device)
        self._coordinates = [field(self._layout, device) for _ in range(2)]
        self._out = [
            wp.zeros(self._layout.size, dtype=lookup.Pixel, device=device) for _ in self._source.quads
        ]
        threads = 1 if device.is_cuda else min(free_cores(), STRIPS)
        self._replay = Replay(device, self._look_up, helpers(threads))

    def launch(self, d_x: wp.array, d_y: wp.array) -> None:
        """Compute the coordinates and pixels of `render`, left in device memory."""
        with LAUNCHES:
            for d, ghosts, out in zip((d_x, d_y), self._ghosts, self._stretched, strict=True):
                lookup.stretch_y.launch(self._strip, self.device, [d, *self._rows, self._grid.pitch], [out])
                ghosts.fill(out)
        self._replay.launch()

    def render(self, d_x: wp.array, d_y: wp.array) -> Picture:
        """The picture under the displacements d_x, d_y [cells], fields with ghosts."""
        self.launch(d_x, d_y)
        quads = [self._to_numpy(out) for out in self._out]
        pixels = np.concatenate(quads, axis=2) if len(quads) > 1 else quads[0]
        pixels = np.array(pixels[..., : self._source.channels], dtype=np.float32, order="C")  # a copy
        return replace(self.picture, pixels=pixels, alpha=self._source.alpha)

    @property
    def untouched(self) -> Picture:
        """What a still map shows, to the bit; with the transparent edge it has its alpha."""
        pixels, alpha = self.picture.pixels, self.picture.alpha
        if (self.width, self.height) != (self.picture.width, self.picture.height):
            still = self._still
            return self.render(still, still)
        if alpha != self._source.alpha:
            pixels = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)
        return replace(self.picture, pixels=np.array(pixels), alpha=self._source.alpha)

    def source_of(self, d_x: wp.array, d_y: wp.array) -> np.ndarray:
        """Where each pixel's colour comes from: (height, width, 2), x and y [px of the source].

        Counted from the centre of the source's first pixel.
        """
        self.launch(d_x, d_y)
        layout = self._layout
        grids = [
            f.numpy()[: layout.size // layout.pitch * layout.pitch].reshape(-1, layout.pitch)
            for f in self._coordinates
        ]
        cut = slice(HALO, HALO + self.height), slice(HALO, HALO + self.width)
        return np.stack([grid[cut] for grid in grids], axis=2)

    def _to_numpy(self, out: wp.array) -> np.ndarray:
        layout = self._layout
        rows = layout.size // layout.pitch
        grid = out.numpy()[: rows * layout.pitch].reshape(rows, layout.pitch, _QUAD)
        return grid[HALO : HALO + self.height, HALO : HALO + self.width]

    def _look_up(self) -> None:
        source = self._source
        sizes = ((source.width, self.width, self._grid.nx), (source.height, self.height, self._grid.ny))
        for axis, (pixels, outputs, cells) in enumerate(sizes):
            step = pixels / outputs
            place = [step / 2 - 0.5, step * (axis == 0), step * (axis == 1), pixels / cells]
            inputs = [self._stretched[axis], *self._columns, self._strip.pitch, *place]
            lookup.stretch_x.launch(self._layout, self.device, inputs, [self._coordinates[axis]])
        for quad, out in zip(source.quads, self._out, strict=True):
            inputs = [quad, *self._coordinates, source.width, source.height, *self._edges]
            self._program.launch(self._layout, self.device, inputs, [out])


def _cubic_tables(cells: int, pixels: int, start: int, device: wp.Device) -> list[wp.array]:
    """Catmull-Rom tables from `cells` centres to `pixels` centres of one axis.

    The index of the centre before each pixel, counted from `start`, and four weights.
    """
    position = (np.arange(whole_spans(pixels)) + 0.5) * (cells / pixels) - 0.5
    position = np.minimum(position, cells - 0.5)  # the padding of the last span reads inside
    before = np.floor(position).astype(int)
    t = position - before
    weights = [_outer(t), _inner(t), _inner(1 - t), _outer(1 - t)]
    index = wp.array(before + start, dtype=wp.int32, device=device)
    return [index, *(wp.array(weight, dtype=Real, device=device) for weight in weights)]


def _outer(t: np.ndarray) -> np.ndarray:
    return t * (-0.5 + t * (1.0 - 0.5 * t))


def _inner(t: np.ndarray) -> np.ndarray:
    return 1.0 + t * t * (-2.5 + 1.5 * t)
