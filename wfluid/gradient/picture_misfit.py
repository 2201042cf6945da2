"""The misfit between the warped picture and a target, with the look-up that renders frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from wfluid.domain.showing import short_repr
from wfluid.fields.arrays import field, from_numpy, interior, read, upload, zeros
from wfluid.fields.state import State
from wfluid.gradient.state_objectives import DeviceObjective, StateObjective
from wfluid.kernels.adjoint import misfit
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.view.lookup import Pixel
from wfluid.model.painted import Painted, as_weight
from wfluid.pictures.picture import Picture, picture_of
from wfluid.pictures.sampling import check_look_up
from wfluid.step.step import Step
from wfluid.view.lookup import QUAD, LookUp, quads_of
from wfluid.view.lookup_adjoint import ADJOINTS, LookUpAdjoint


@dataclass(frozen=True, eq=False)
class PictureMisfit(StateObjective):
    """The misfit between the warped picture and a target, in linear light, alpha premultiplied:

        1/2 integral over the picture of weight sum_channels (warped - target)^2    [longer side^2]

    The integral is the mean over the frame's pixels times the picture's area. The frame has the size of
    the target; a larger picture is first shrunk to it, as for the frames of an animation.

    Raises:
        ValueError: a filter without a gradient, an edge that does not exist, a target with other channels
            than the warped picture, or a pixel that is not finite.
    """

    picture: Picture
    """The picture that is warped, stretched over the fluid; anything that `Picture.of` takes."""
    target: Picture
    """The target, with the channels of the warped picture: the transparent edge adds an alpha."""
    time: float
    """Time of the misfit [s]."""
    filter: str = "cubic"
    """Interpolation between pixels: "bilinear" or "cubic"."""
    edge: str = "clamp"
    """Values beyond the picture's edges: "clamp", "mirror", "wrap", "transparent"; periodic axes wrap."""
    weight: Painted | None = None
    """A factor painted over the picture; 1 by default."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.filter not in ADJOINTS:
            raise ValueError(
                f"PictureMisfit: filter {self.filter!r} gives no gradient: expected one of "
                f"{', '.join(ADJOINTS)}"
            )
        check_look_up(self.filter, self.edge)
        object.__setattr__(self, "weight", as_weight("PictureMisfit.weight", self.weight))
        for name in ("picture", "target"):
            object.__setattr__(self, name, picture_of(f"PictureMisfit.{name}", getattr(self, name)))
            pixels = getattr(self, name).pixels
            if pixels.ndim != 3 or not pixels.size:
                raise ValueError(
                    f"PictureMisfit.{name} of shape {pixels.shape}: expected (height, width, channels)"
                )
            if not np.all(np.isfinite(pixels)):
                raise ValueError(f"PictureMisfit.{name}: a pixel is not finite")
        gains = self.edge == "transparent" and self.picture.alpha is None
        shown, wanted = self.picture.pixels.shape[2] + gains, self.target.pixels.shape[2]
        if shown != wanted:
            raise ValueError(
                f"PictureMisfit.target has {wanted} channels: expected the {shown} of the warped picture"
                + (", its alpha for the transparent edge included" if gains else "")
            )

    def term(self, step: Step, weight: float, particles: slice) -> DeviceObjective:
        """The objective on the device, for the grid and walls of `step`."""
        return _PictureTerm(self, step, weight)


class _PictureTerm(DeviceObjective):
    """Half the weighted sum of squares of the warped picture minus the target."""

    def __init__(self, misfit: PictureMisfit, step: Step, weight: float):
        width, height, grid = misfit.target.width, misfit.target.height, step.grid
        self.device, self.layout = step.device, Layout(width, height)
        self._look_up = LookUp(
            misfit.picture.shrunk(width, height),
            grid,
            step.fluid.boundary,
            self.device,
            width=width,
            height=height,
            filter=misfit.filter,
            edge=misfit.edge,
        )
        self._adjoint = LookUpAdjoint(self._look_up)
        self._targets = [self._on_frame(quad) for quad in quads_of(misfit.target.pixels)]
        painted = (
            np.ones((height, width)) if misfit.weight is None else misfit.weight.resampled(width, height)
        )
        self._weight = field(self.layout, self.device)
        from_numpy(
            painted * (weight * grid.width * grid.height / (width * height)), self._weight, self.layout
        )
        self._shown_bar = zeros(self.layout.size, self.device, Pixel)
        self._rows = zeros(len(self._targets) * height, self.device)

    def _on_frame(self, quad: np.ndarray) -> wp.array:
        """Pixels (height, width, 4) on the device, in the look-up's layout."""
        layout = self.layout
        padded = np.zeros((layout.size, QUAD), dtype=quad.dtype)
        interior(padded, layout)[:] = quad
        return upload(padded, self.device, Pixel)

    def _show(self, state: State) -> None:
        """Warp the picture."""
        look_up = self._look_up
        look_up.stretch(state.d_x, state.d_y)
        look_up.place()
        look_up.read()

    def measure(self, state: State) -> None:
        """Compute the weighted squares, summed along rows."""
        self._show(state)
        layout = self.layout
        for n, (shown, target) in enumerate(zip(self._look_up.shown, self._targets, strict=True)):
            inputs = [shown, target, self._weight, layout.nx, layout.pitch, n * layout.ny]
            misfit.row_misfits.launch(layout.ny, self.device, inputs, [self._rows])

    def value(self) -> float:
        """Half the sum of the last `measure` over rows."""
        return 0.5 * float(read(self._rows).sum(dtype=np.float64))

    def adjoint(self, state: State, bar: State) -> None:
        """Apply the transpose of the look-up to the weighted residual."""
        self._show(state)
        self._adjoint.begin()
        for n, (shown, target) in enumerate(zip(self._look_up.shown, self._targets, strict=True)):
            inputs = [shown, target, self._weight]
            misfit.weigh_misfit.launch(self.layout, self.device, inputs, [self._shown_bar])
            self._adjoint.read(n, self._shown_bar)
        self._adjoint.place()
        self._adjoint.stretch(bar.d_x, bar.d_y)
