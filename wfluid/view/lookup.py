"""The picture seen through a map: host side of `kernels/view/lookup.py`."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.domain.piecewise import catmull_rom
from wfluid.domain.walls import Walls
from wfluid.fields.arrays import Vector, field, interior, read, upload, vector, zeros
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.graph import CapturedGraph
from wfluid.kernels.cell.layout import HALO, Layout, whole_spans
from wfluid.kernels.cell.strips import together
from wfluid.kernels.view import lookup
from wfluid.pictures.picture import Picture, PictureLike, picture_of
from wfluid.pictures.sampling import EDGES, check_look_up
from wfluid.system.threads import free_cores, helpers

_PROGRAMS = {
    "nearest": lookup.look_up_nearest,
    "bilinear": lookup.look_up_bilinear,
    "cubic": lookup.look_up_cubic,
    "lanczos": lookup.look_up_lanczos,
}

LOOKUP_THREADS = 8
"""Largest number of threads that share a look-up."""

QUAD = 4
"""Channels that are looked up at once."""


class PictureOnDevice:
    """A picture's channels in device memory, four to an array.

    With `transparent`, a picture without alpha gets an opaque alpha channel, so that places outside are
    transparent.
    """

    def __init__(self, picture: Picture, transparent: bool, device: wp.Device):
        pixels = np.asarray(picture.pixels, dtype=np.float32)
        self.alpha = picture.alpha
        if transparent and self.alpha is None:
            self.alpha = pixels.shape[2]
            pixels = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)
        self.height, self.width, self.channels = pixels.shape
        self.quads = [upload(quad.reshape(-1, QUAD), device, lookup.Pixel) for quad in quads_of(pixels)]


def quads_of(pixels: np.ndarray) -> list[np.ndarray]:
    """Pixels (height, width, channels) as arrays of four channels; the last one is padded with 0."""
    padded = np.pad(pixels, ((0, 0), (0, 0), (0, -pixels.shape[2] % QUAD)))
    firsts = range(0, padded.shape[2], QUAD)
    return [np.ascontiguousarray(padded[..., first : first + QUAD]) for first in firsts]


class LookUp:
    """Renders a picture through displacements on a fluid's grid, at any size.

    `edge` applies to axes between walls; a periodic axis always wraps. On a CPU the cores share the rows.
    `stretch`, `place` and `read`, in this order, contain launches only, so that other graphs can capture
    them.
    """

    def __init__(
        self,
        picture: PictureLike,
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
        picture = picture_of("LookUp.picture", picture)
        self.device, self.grid, self.walls = device, grid, walls
        self.picture, self.filter = picture, filter
        self.source = PictureOnDevice(picture, edge == "transparent", device)
        self._program = _PROGRAMS[filter]
        self.edges = [EDGES.index("wrap" if periodic else edge) for periodic in walls.periodic]
        self.width, self.height = width or picture.width, height or picture.height
        self.slopes = self.source.width / grid.nx, self.source.height / grid.ny
        self.strip = Layout(grid.nx, self.height)
        self.layout = Layout(self.width, self.height)
        self._columns = _tables(*cubic_weights(grid.nx, self.width), -1, device)
        self._rows = _tables(*cubic_weights(grid.ny, self.height), HALO, device)
        rules = (walls.displacement_x_rules(), walls.displacement_y_rules())
        self._ghosts = [Ghosts(self.strip, axis, device) for axis in rules]
        self.stretched = vector(self.strip, device, 2)
        self._still = field(Layout(grid.nx, grid.ny), device)
        self.coordinates = vector(self.layout, device, 2)
        self.shown = [zeros(self.layout.size, device, lookup.Pixel) for _ in self.source.quads]
        self._replay: CapturedGraph | None = None

    source: PictureOnDevice
    """The source picture."""
    edges: list[int]
    """Index in `EDGES` of the edge along x and y."""
    slopes: tuple[float, float]
    """Size of a cell along x and y [px of the source]."""
    strip: Layout
    """Layout of displacements in rows of pixels and columns of cells."""
    layout: Layout
    """Layout of the rendered pixels."""
    stretched: Vector
    """Displacements in rows of pixels and columns of cells, with ghosts; the result of `stretch`."""
    coordinates: Vector
    """Source of each pixel along x and y [px of the source]; the result of `place`."""
    shown: list[wp.array]
    """Rendered pixels, four channels in each array; the result of `read`."""

    def stretch(self, d_x: wp.array, d_y: wp.array) -> None:
        """Interpolate displacements [cells], fields with ghosts, to rows of pixels; launches only."""
        pitch = self.strip.pitch  # columns are the grid's
        with together():
            for d, out in zip((d_x, d_y), self.stretched, strict=True):
                lookup.stretch_y.launch(self.strip, self.device, [d, *self._rows, pitch], [out])
        with together():
            for out, ghosts in zip(self.stretched, self._ghosts, strict=True):
                ghosts.fill(out)

    def place(self) -> None:
        """Compute the source of each pixel; launches only."""
        sizes = ((self.source.width, self.width), (self.source.height, self.height))
        with together():
            for axis, (pixels, outputs) in enumerate(sizes):
                step = pixels / outputs
                place = [step / 2 - 0.5, step * (axis == 0), step * (axis == 1), self.slopes[axis]]
                inputs = [self.stretched[axis], *self._columns, self.strip.pitch, *place]
                lookup.stretch_x.launch(self.layout, self.device, inputs, [self.coordinates[axis]])

    def read(self) -> None:
        """Interpolate the picture at the source of each pixel; launches only."""
        source = self.source
        with together():
            for quad, out in zip(source.quads, self.shown, strict=True):
                inputs = [quad, *self.coordinates, source.width, source.height, *self.edges]
                self._program.launch(self.layout, self.device, inputs, [out])

    def launch(self, d_x: wp.array, d_y: wp.array) -> None:
        """Compute the coordinates and pixels of `render` in device memory."""
        self.stretch(d_x, d_y)
        if self._replay is None:
            threads = 1 if self.device.is_cuda else min(free_cores(), LOOKUP_THREADS)
            self._replay = CapturedGraph(self.device, self._look_up, helpers(threads))
        self._replay.launch()

    def render(self, d_x: wp.array, d_y: wp.array) -> Picture:
        """The picture under the displacements d_x, d_y [cells], fields with ghosts; alpha is clamped."""
        shown = self.interpolate(d_x, d_y)
        if shown.alpha is not None:  # filters overshoot, which colours may
            opacity = shown.pixels[..., shown.alpha]
            np.clip(opacity, *self._opacities, out=opacity)
        return shown

    def interpolate(self, d_x: wp.array, d_y: wp.array) -> Picture:
        """The same as the filter gives it, which is what `PictureMisfit` measures: alpha may overshoot."""
        self.launch(d_x, d_y)
        quads = [interior(read(out), self.layout) for out in self.shown]
        pixels = np.concatenate(quads, axis=2) if len(quads) > 1 else quads[0]
        pixels = np.array(pixels[..., : self.source.channels], dtype=np.float32, order="C")  # a copy
        return replace(self.picture, pixels=pixels, alpha=self.source.alpha)

    @cached_property
    def _opacities(self) -> tuple[float, float]:
        """The smallest and largest alpha: 0 and 1, unless those of the picture are beyond."""
        alpha = self.picture.alpha
        opacity = np.zeros(1) if alpha is None else self.picture.pixels[..., alpha]
        return min(0.0, float(opacity.min())), max(1.0, float(opacity.max()))

    @property
    def untouched(self) -> Picture:
        """The picture under the identity map, without rounding; alpha is added for the transparent edge."""
        pixels, alpha = self.picture.pixels, self.picture.alpha
        if (self.width, self.height) != (self.picture.width, self.picture.height):
            still = self._still
            return self.render(still, still)
        if alpha != self.source.alpha:
            pixels = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)
        return replace(self.picture, pixels=np.array(pixels), alpha=self.source.alpha)

    def source_of(self, d_x: wp.array, d_y: wp.array) -> np.ndarray:
        """Source of each pixel: (height, width, 2), x and y [px of the source].

        The origin is the centre of the source's first pixel.
        """
        self.launch(d_x, d_y)
        return np.stack([interior(read(f), self.layout) for f in self.coordinates], axis=2)

    def _look_up(self) -> None:
        self.place()
        self.read()


def cubic_weights(cells: int, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Catmull-Rom interpolation from `cells` to `pixels` centres of one axis, padded to complete spans.

    Returns the index of the centre before each pixel, -1 … cells - 1, and the weights (4, …) of four centres,
    of which that is the second.
    """
    position = (np.arange(whole_spans(pixels)) + 0.5) * (cells / pixels) - 0.5
    position = np.minimum(position, cells - 0.5)  # the padding of the last span reads inside
    before = np.floor(position).astype(int)
    return before, catmull_rom(position - before)


def _tables(before: np.ndarray, weights: np.ndarray, start: int, device: wp.Device) -> list[wp.array]:
    """The tables in device memory; indices of centres are offset by `start`."""
    return [upload(before + start, device, wp.int32), *(upload(weight, device) for weight in weights)]
