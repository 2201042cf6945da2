"""Traces along the velocity: the feet of all centres, and points; with transposes.

foot = x - dt v(x - dt v(x) / 2)        with scheme "paper": x - dt v(x)
point = p + dt v(p + dt v(p) / 2)

The foot (departure point) of a cell is the place from which the flow brings what arrives at its centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import Vector, lookup_args, vector, zeros
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.adjoint import advection as advection_adjoint
from wfluid.kernels.adjoint import scatter
from wfluid.kernels.adjoint import transport as transport_adjoint
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.step import advection, transport
from wfluid.model.fluid import Fluid
from wfluid.step.forcing import Forcing
from wfluid.step.tape import attach_gradients, bars, record


def new_places(layout: Layout, device: wp.Device) -> list[wp.array]:
    """Arrays for the place at which each cell reads a field: the index of the point before it, and the
    fractions of a cell from there, along x and y.
    """
    return [zeros(layout.size, device, wp.int32), *vector(layout, device, 2)]


class Feet:
    """Traces the feet of all centres, and moves points."""

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
        self.foot = vector(self.layout, device, 2)

    foot: Vector
    """The feet of the last trace, relative to the centres [cells], with ghosts."""

    def allow_gradients(self) -> None:
        """Allocate the arrays of the transposes."""
        attach_gradients(self.foot, self.layout, self.device)
        self._centre_bar, self._middle_bar = (vector(self.layout, self.device, 2) for _ in range(2))
        self._places = [new_places(self.layout, self.device) for _ in range(2)]

    def _numbers(self, forcing: Forcing) -> list:
        """The scalar arguments of the kernels: dt / h along both axes, and those of look-ups."""
        return [forcing.dt_hx, forcing.dt_hy, *self._lookup_args]

    def trace(self, velocity: Vector, forcing: Forcing) -> Vector:
        """The feet of all centres, with ghosts."""
        program = advection.trace_euler if self._paper else advection.trace_midpoint
        program.launch(self.layout, self.device, [*velocity, *self._numbers(forcing)], self.foot)
        with together():
            for f, ghosts in zip(self.foot, self._moved_ghosts, strict=True):
                ghosts.fill(f)
        record(partial(self._trace_back, velocity, forcing), velocity, self.foot)
        return self.foot

    def _trace_back(self, velocity: Vector, forcing: Forcing) -> None:
        """Add to the velocity's gradient: for its values at the middle of each trace, and at the centre."""
        layout, device, numbers = self.layout, self.device, self._numbers(forcing)
        velocity_bar, foot_bar, centre_bar = bars(velocity), bars(self.foot), self._centre_bar
        if self._paper:
            inputs = [*velocity, *foot_bar, *numbers]
            advection_adjoint.trace_euler_adjoint.launch(layout, device, inputs, centre_bar)
        else:
            middle_bar, places = self._middle_bar, [array for place in self._places for array in place]
            advection_adjoint.place_middles.launch(layout, device, [*velocity, *numbers], places)
            inputs, outputs = [*velocity, *foot_bar, *places, *numbers], [*middle_bar, *centre_bar]
            advection_adjoint.trace_midpoint_adjoint.launch(layout, device, inputs, outputs)
            with together():
                for axis, (place, f, out) in enumerate(
                    zip(self._places, middle_bar, velocity_bar, strict=True)
                ):
                    inputs = [*place, f, layout.nx, layout.pitch]
                    scatter.scatter_bilinear.launch(layout, device, inputs, [out], turn=axis)
        with together():
            for f, ghosts in zip(centre_bar, self._moved_ghosts, strict=True):
                ghosts.fill(f)
        with together():
            for f, stride, out in zip(centre_bar, (1, layout.pitch), velocity_bar, strict=True):
                inputs = [f, stride, layout.nx]
                advection_adjoint.add_face_means.launch(layout, device, inputs, [out])
        self._fold(velocity_bar)

    def carry_points(self, points: Vector, velocity: Vector, forcing: Forcing, out: Vector) -> None:
        """out = the points (x, y) [cells] after the step."""
        inputs = [*points, *velocity, *self._numbers(forcing)]
        transport.carry_points.launch(len(points[0]), self.device, inputs, out)
        if len(points[0]):
            backward = partial(self._carry_points_back, points, velocity, forcing, out)
            record(backward, [*points, *velocity], out)

    def _carry_points_back(self, points: Vector, velocity: Vector, forcing: Forcing, out: Vector) -> None:
        """Write the gradient of the points before the step; add to the velocity's."""
        velocity_bar = bars(velocity)
        inputs = [*points, *velocity, *bars(out), *self._numbers(forcing)]
        outputs = [*velocity_bar, *bars(points)]
        program = transport_adjoint.carry_points_adjoint
        program.launch(len(points[0]), self.device, inputs, outputs, turn=0)
        self._fold(velocity_bar)

    def _fold(self, velocity_bar: Vector) -> None:
        """Fold the ghosts of a velocity's gradient."""
        for f, ghosts in zip(velocity_bar, self._velocity_ghosts, strict=True):
            ghosts.fold(f)
