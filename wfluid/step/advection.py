"""What is carried from the feet: the velocity, v(foot), and the map, d(foot) + foot; with the transposes.

A transpose has two parts. What arrives is scattered back to the points around the foot from which it was
read; and, times the slope there, it is the gradient of the foot.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector, vector, where
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
        self._where = where(grid, fluid.walls, self.layout)
        self._paper = fluid.scheme == "paper"
        self.carried = vector(self.layout, device, 2)

    carried: Vector
    """The velocity that the last step carried along, with ghosts."""

    def allow_gradients(self) -> None:
        """Allocate what the transposes need."""
        attach_gradients(self.carried, self.layout)
        self._own_feet = [vector(self.layout, self.device, 2) for _ in range(2)]
        self._places = [new_places(self.layout, self.device) for _ in range(2)]

    def carry_velocity(self, velocity: Vector, foot: Vector) -> Vector:
        """The velocity (with ghosts) carried along the flow, with ghosts. A face's foot is a mean of two."""
        program = advection.advect_face_bilinear if self._paper else advection.advect_face_cubic
        with together():
            for f, before, out in zip(velocity, (1, self.layout.pitch), self.carried, strict=True):
                program.launch(self.layout, self.device, [f, *foot, before, *self._where], [out])
        with together():
            for f, ghosts in zip(self.carried, self._velocity_ghosts, strict=True):
                ghosts.fill(f)
        record(partial(self._carry_velocity_back, velocity, foot), [*velocity, *foot], self.carried)
        return self.carried

    def _carry_velocity_back(self, velocity: Vector, foot: Vector) -> None:
        """Add to the gradients of the velocity and of the feet."""
        layout, device = self.layout, self.device
        with together():
            for place, before in zip(self._places, (1, layout.pitch), strict=True):
                advection_adjoint.place_feet.launch(layout, device, [*foot, before, *self._where], place)
        self._scatter(velocity, self._places, bars(self.carried), bars(velocity), self._velocity_ghosts)
        with together():
            for own, ghosts in zip(self._own_feet, self._velocity_ghosts, strict=True):
                for f in own:
                    ghosts.fill(f)
        with together():
            for axis, foot_bar in enumerate(bars(foot)):
                inputs = [*(own[axis] for own in self._own_feet), layout.pitch]
                advection_adjoint.add_feet_of_faces.launch(layout, device, inputs, [foot_bar])

    def carry_map(self, displacement: Vector, foot: Vector, out: Vector) -> None:
        """Carry the displacement (with ghosts) of the map along: out, with ghosts."""
        program = transport.carry_map_bilinear if self._paper else transport.carry_map_cubic
        program.launch(self.layout, self.device, [*displacement, *foot, *self._where], out)
        with together():
            for d, ghosts in zip(out, self._moved_ghosts, strict=True):
                ghosts.fill(d)
        record(partial(self._carry_map_back, displacement, foot, out), [*displacement, *foot], out)

    def _carry_map_back(self, displacement: Vector, foot: Vector, out: Vector) -> None:
        """Add to the gradients of the displacement and of the feet."""
        layout, device, place = self.layout, self.device, self._places[0]
        advection_adjoint.place_feet.launch(layout, device, [*foot, 0, *self._where], place)
        self._scatter(displacement, [place, place], bars(out), bars(displacement), self._moved_ghosts)
        with together():
            for axis, (out_bar, foot_bar) in enumerate(zip(bars(out), bars(foot), strict=True)):
                inputs = [*(own[axis] for own in self._own_feet), out_bar]
                advection_adjoint.add_feet_of_centres.launch(layout, device, inputs, [foot_bar])

    def _scatter(
        self, fields: Vector, places: Sequence, arrived: Vector, outs: Vector, ghosts: Sequence[Ghosts]
    ) -> None:
        """Add what arrived to the gradients of the fields it was read from; find those of its own feet.

        Components scatter into arrays of their own, so two threads may work at once.
        """
        layout, device = self.layout, self.device
        slopes, scattered = advection_adjoint.foot_adjoint_cubic, scatter.scatter_cubic
        if self._paper:
            slopes, scattered = advection_adjoint.foot_adjoint_bilinear, scatter.scatter_bilinear
        with together():
            for f, place, f_bar, own in zip(fields, places, arrived, self._own_feet, strict=True):
                slopes.launch(layout, device, [f, *place, f_bar, layout.pitch], own)
        with together():
            for turn, (place, f_bar, out) in enumerate(zip(places, arrived, outs, strict=True)):
                inputs = [*place, f_bar, layout.nx, layout.pitch]
                scattered.launch(layout, device, inputs, [out], turn=turn)
        for out, own in zip(outs, ghosts, strict=True):
            own.fold(out)
