"""Advection from the feet: of the velocity, v(foot), and of the map, d(foot) + foot; with the transposes.

A transpose has two parts. It scatters the gradient of each result to the points around the foot, from which
the result was interpolated. The same gradient times the field's slope at the foot is that of the foot.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector, lookup_args, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.adjoint import advection as advection_adjoint
from wfluid.kernels.adjoint import scatter
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.step import advection, transport
from wfluid.model.fluid import Fluid
from wfluid.step.feet import new_places
from wfluid.step.tape import attach_gradients, bars, record


class Advection:
    """Carries the velocity and the map from the feet."""

    def __init__(
        self,
        grid: Grid,
        fluid: Fluid,
        device: wp.Device,
        velocity_ghosts: Sequence[Ghosts],
        moved_ghosts: Sequence[Ghosts],
    ):
        self.device, self.layout = device, Layout(grid.nx, grid.ny)
        self._velocity_ghosts, self._moved_ghosts = velocity_ghosts, moved_ghosts
        self._lookup_args = lookup_args(grid, fluid.boundary, self.layout)
        self._paper = fluid.scheme == "paper"
        self.carried = vector(self.layout, device, 2)

    carried: Vector
    """The velocity after the last step's advection, with ghosts."""

    def allow_gradients(self) -> None:
        """Allocate the arrays of the transposes."""
        attach_gradients(self.carried, self.layout, self.device)
        self._feet_bar = [vector(self.layout, self.device, 2) for _ in range(2)]
        self._places = [new_places(self.layout, self.device) for _ in range(2)]

    def carry_velocity(self, velocity: Vector, foot: Vector) -> Vector:
        """The velocity (with ghosts) after advection, with ghosts.

        The foot of a face is the mean of the feet of the two centres beside it.
        """
        program = advection.advect_face_bilinear if self._paper else advection.advect_face_cubic
        with together():
            for f, stride, out in zip(velocity, (1, self.layout.pitch), self.carried, strict=True):
                program.launch(self.layout, self.device, [f, *foot, stride, *self._lookup_args], [out])
        with together():
            for f, ghosts in zip(self.carried, self._velocity_ghosts, strict=True):
                ghosts.fill(f)
        record(partial(self._carry_velocity_back, velocity, foot), [*velocity, *foot], self.carried)
        return self.carried

    def _carry_velocity_back(self, velocity: Vector, foot: Vector) -> None:
        """Add to the gradients of the velocity and of the feet."""
        layout, device = self.layout, self.device
        with together():
            for place, stride in zip(self._places, (1, layout.pitch), strict=True):
                inputs = [*foot, stride, *self._lookup_args]
                advection_adjoint.place_feet.launch(layout, device, inputs, place)
        self._scatter(velocity, self._places, bars(self.carried), bars(velocity), self._velocity_ghosts)
        with together():
            for face_foot_bar, ghosts in zip(self._feet_bar, self._velocity_ghosts, strict=True):
                for f in face_foot_bar:
                    ghosts.fill(f)
        with together():
            for axis, foot_bar in enumerate(bars(foot)):
                inputs = [*(face_foot_bar[axis] for face_foot_bar in self._feet_bar), layout.pitch]
                advection_adjoint.add_feet_of_faces.launch(layout, device, inputs, [foot_bar])

    def carry_map(self, displacement: Vector, foot: Vector, out: Vector) -> None:
        """out = the displacement of the map (with ghosts) after advection, with ghosts."""
        program = transport.carry_map_bilinear if self._paper else transport.carry_map_cubic
        program.launch(self.layout, self.device, [*displacement, *foot, *self._lookup_args], out)
        with together():
            for d, ghosts in zip(out, self._moved_ghosts, strict=True):
                ghosts.fill(d)
        record(partial(self._carry_map_back, displacement, foot, out), [*displacement, *foot], out)

    def _carry_map_back(self, displacement: Vector, foot: Vector, out: Vector) -> None:
        """Add to the gradients of the displacement and of the feet."""
        layout, device, place = self.layout, self.device, self._places[0]
        advection_adjoint.place_feet.launch(layout, device, [*foot, 0, *self._lookup_args], place)
        self._scatter(displacement, [place, place], bars(out), bars(displacement), self._moved_ghosts)
        with together():
            for axis, (out_bar, foot_bar) in enumerate(zip(bars(out), bars(foot), strict=True)):
                inputs = [*(component_bar[axis] for component_bar in self._feet_bar), out_bar]
                advection_adjoint.add_feet_of_centres.launch(layout, device, inputs, [foot_bar])

    def _scatter(
        self, fields: Vector, places: Sequence, carried_bar: Vector, outs: Vector, ghosts: Sequence[Ghosts]
    ) -> None:
        """The transpose of interpolating two `fields` at `places`, from the gradients of the results.

        Adds to `outs`, the gradients of the fields. Writes `_feet_bar`, for each field the gradient of its
        feet along x and y. The fields have separate outputs, so two threads may work at once.
        """
        layout, device = self.layout, self.device
        slopes, scattered = advection_adjoint.foot_adjoint_cubic, scatter.scatter_cubic
        if self._paper:
            slopes, scattered = advection_adjoint.foot_adjoint_bilinear, scatter.scatter_bilinear
        with together():
            for f, place, f_bar, feet_bar in zip(fields, places, carried_bar, self._feet_bar, strict=True):
                slopes.launch(layout, device, [f, *place, f_bar, layout.pitch], feet_bar)
        with together():
            for axis, (place, f_bar, out) in enumerate(zip(places, carried_bar, outs, strict=True)):
                inputs = [*place, f_bar, layout.nx, layout.pitch]
                scattered.launch(layout, device, inputs, [out], turn=axis)
        for out, out_ghosts in zip(outs, ghosts, strict=True):
            out_ghosts.fold(out)
