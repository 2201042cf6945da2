"""The adjoint of a step: from gradients with respect to the state after it to those with respect to the state
before it, to the forces and to the viscosity.

A step's stages are gone through in opposite order, each transposed about what the step began with; feet
and pushes, which cost little, are computed again, so that of each step only its state need be kept. A
linear solve with a symmetric solver M is its own transpose, so none of its sweeps or iterates is
recorded; conjugate gradients are so only up to their tolerance. x_bar stands for the gradient of an
objective with respect to x.
"""

from __future__ import annotations

from functools import partial

import warp as wp

from wfluid.fields.arrays import Scalars, Vector, field, fill, vector, zeros
from wfluid.fields.device import load_kernels
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.kernels.adjoint import advection as advection_adjoint
from wfluid.kernels.adjoint import forces as forces_adjoint
from wfluid.kernels.adjoint import scatter
from wfluid.kernels.adjoint import transport as transport_adjoint
from wfluid.kernels.adjoint import viscosity as viscosity_adjoint
from wfluid.kernels.cell.program import ADJOINT
from wfluid.kernels.cell.strips import alone, together
from wfluid.kernels.solve import algebra
from wfluid.step.forcing import Forcing
from wfluid.step.step import Step


class StepAdjoint:
    """The transposes of steps of dt [s] with `stages`, which must not be at work elsewhere. They only launch.

    With `of_viscosity` the gradient with respect to viscosity is found as well, which is right only as
    far as the diffusion is solved; with `effort` that of half the squares of what forces add.
    """

    def __init__(self, stages: Step, dt: float, of_viscosity: bool = False, effort: float = 0.0):
        self.stages, self.device, self.layout = stages, stages.device, stages.layout
        load_kernels(stages.device, ADJOINT)
        self._effort = effort
        grid, layout, device = stages.grid, stages.layout, stages.device
        self._moves = stages.fluid.viscosity_moves
        self._of_viscosity = of_viscosity or self._moves
        self.mu_bar = field(layout, device)
        self._mu_bar = field(layout, device) if self._moves else self.mu_bar
        self._projected_bar, self._carried_bar = (vector(layout, device, 2) for _ in range(2))
        self._own_feet = [vector(layout, device, 2) for _ in range(4)]
        self._foot_bar, self._centre_bar = (vector(layout, device, 2) for _ in range(2))
        self._places = [(zeros(layout.size, device, wp.int32), *vector(layout, device, 2)) for _ in range(3)]
        paper = stages.fluid.scheme == "paper"
        self._scatter = scatter.scatter_bilinear if paper else scatter.scatter_cubic
        self._foot_adjoint = (
            advection_adjoint.foot_adjoint_bilinear if paper else advection_adjoint.foot_adjoint_cubic
        )
        self._effort_bar = vector(layout, device, 2) if effort else ()
        x, y = 1 / grid.hx, 1 / grid.hy
        numbers = Scalars(device, x=x, y=y, xx=grid.hx**-2, yy=grid.hy**-2, dt=dt)
        self._inverse_h, self._inverse_h2 = [numbers.x, numbers.y], [numbers.xx, numbers.yy]
        self._dt = numbers.dt

    mu_bar: wp.array
    """The gradient with respect to viscosity where it is painted, at centres, added to by every step."""

    def fold_viscosity(self) -> None:
        """Bring what steps added to `mu_bar` for ghosts to the cells; after all of them."""
        if self._moves:
            Ghosts(self.layout, self.stages.fluid.walls.centre_rules(), self.device).fold(self.mu_bar)

    def reverse(self, state: State, impulses: Forcing, out_bar: State, bar: State) -> None:
        """`bar` = the gradient with respect to `state`, from `out_bar`, that after the step from it.

        Gradients come without ghosts. Those of `out_bar` are written over.
        """
        stages = self.stages
        if self._moves:
            stages.follow_medium(state)
        stages.trace(state, impulses)
        if self._of_viscosity:
            carried = stages.advect(stages.push(state, impulses))
            diffused = stages.diffuse(stages.subtract_pressure(carried, state, impulses))
        carried_bar = self._solves(impulses, out_bar, bar)
        if self._of_viscosity:
            self._viscosity(diffused)
        pushed = stages.push(state, impulses)
        self._carry(pushed, carried_bar, state, out_bar, bar)
        self._push(pushed, state, impulses, bar)
        self._densities(state, impulses, out_bar, bar)
        self._trace(state, impulses, out_bar, bar)
        if self._moves:
            inputs = [stages.medium.painted_mu, state.d_x, state.d_y, self._mu_bar, *stages.where]
            outputs = [self.mu_bar, bar.d_x, bar.d_y]
            program = transport_adjoint.carried_along_adjoint
            program.launch(self.layout, self.device, inputs, outputs, turn=0)

    def _solves(self, impulses: Forcing, out_bar: State, bar: State) -> Vector:
        """Through projection, diffusion and the pressure kept: the gradient of the carried velocity."""
        stages = self.stages
        projected, carried = (out_bar.u, out_bar.v), self._projected_bar
        stages.fill(projected)
        q_bar = out_bar.q if stages.medium else None
        stages.projection.adjoint(projected, carried, stages.fill, q_bar)
        if impulses.swells:
            impulses.prescribe_adjoint(stages.projection.adjoint_answer)
        stages.fill(carried)
        if stages.diffusion.how.iterations:
            stages.diffusion.adjoint(carried, self._carried_bar)
            carried = self._carried_bar
            stages.fill(carried)
        if stages.medium:
            stages.projection.kept_adjoint(carried, out_bar.q, impulses.kept, bar.q)
        return carried

    def _viscosity(self, diffused: Vector) -> None:
        """Add to the gradient with respect to viscosity where the fluid is now."""
        stages, pitch = self.stages, self.layout.pitch
        answer = stages.diffusion.adjoint_answer
        if self._moves:
            alone(lambda: fill(0.0, self._mu_bar))
        if stages.medium:
            inputs = [*diffused, *answer, self._dt, *self._inverse_h, pitch]
            viscosity_adjoint.take_dissipation.launch(self.layout, self.device, inputs, [self._mu_bar])
            return
        for f, found in zip(diffused, answer, strict=True):
            inputs = [f, found, self._dt, *self._inverse_h2, pitch]
            viscosity_adjoint.add_diffused.launch(self.layout, self.device, inputs, [self._mu_bar])

    def _carry(self, pushed: Vector, carried_bar: Vector, state: State, out_bar: State, bar: State) -> None:
        """Through advection and the map's transport: pushed velocity, displacement, and every point's foot.

        Components scatter apart from each other, so two threads may.
        """
        stages, layout, device, pitch = self.stages, self.layout, self.device, self.layout.pitch
        fields = (*pushed, state.d_x, state.d_y)
        arrived = (*carried_bar, out_bar.d_x, out_bar.d_y)
        outs = (bar.u, bar.v, bar.d_x, bar.d_y)
        alone(lambda: fill(0.0, *outs, *bar.rho))
        places = [self._places[n] for n in (0, 1, 2, 2)]
        with together():
            for place, before in zip(self._places, (1, pitch, 0), strict=True):
                inputs = [*stages.foot, before, *stages.where]
                advection_adjoint.place_feet.launch(layout, device, inputs, place)
        with together():
            for f, place, f_bar, own in zip(fields, places, arrived, self._own_feet, strict=True):
                self._foot_adjoint.launch(layout, device, [f, *place, f_bar, pitch], own)
        with together():
            for turn, (place, f_bar, out) in enumerate(zip(places, arrived, outs, strict=True)):
                inputs = [*place, f_bar, layout.nx, pitch]
                self._scatter.launch(layout, device, inputs, [out], turn=turn)
        for f, ghosts in zip(outs, (*stages.velocity_ghosts, *stages.moved_ghosts), strict=True):
            ghosts.fold(f)
        with together():
            for own, ghosts in zip(self._own_feet, stages.velocity_ghosts, strict=False):
                for f in own:
                    ghosts.fill(f)
        with together():
            for axis, moved in enumerate((out_bar.d_x, out_bar.d_y)):
                inputs = [*(own[axis] for own in self._own_feet), moved, self.layout.pitch]
                out = [self._foot_bar[axis]]
                advection_adjoint.foot_gradient.launch(self.layout, self.device, inputs, out)

    def _push(self, pushed: Vector, state: State, impulses: Forcing, bar: State) -> None:
        """Through the forces, with their effort."""
        velocity_bar = (bar.u, bar.v)
        if self._effort:
            velocity_bar, effort_bar = self._effort_bar, velocity_bar
            axes = zip(effort_bar, pushed, (state.u, state.v), velocity_bar, strict=True)
            for f_bar, after, before, out in axes:
                inputs = [f_bar, after, before, self._effort]
                forces_adjoint.effort_added.launch(self.layout, self.device, inputs, [out])
        impulses.push_adjoint(velocity_bar, state, bar.rho)

    def _densities(self, state: State, impulses: Forcing, out_bar: State, bar: State) -> None:
        """Through the densities' diffusion, sources and transport."""
        stages, foot = self.stages, self._own_feet[0]
        for n, density in enumerate(stages.densities):
            pour_adjoint = partial(impulses.pour_adjoint, n)
            inputs = [state.rho[n], stages.foot, stages.where, pour_adjoint]
            density.adjoint(out_bar.rho[n], *inputs, bar.rho[n], foot)
            density.fold(bar.rho[n])
            for f, to in zip(foot, self._foot_bar, strict=True):
                algebra.add.launch(self.layout, self.device, [f], [to])

    def _trace(self, state: State, impulses: Forcing, out_bar: State, bar: State) -> None:
        """Through the feet and the points, which both follow the velocity that the step begins with."""
        stages, layout, device, pitch = self.stages, self.layout, self.device, self.layout.pitch
        velocity, velocity_bar, centre_bar = (state.u, state.v), (bar.u, bar.v), self._centre_bar
        step = [impulses.dt_hx, impulses.dt_hy, *stages.where]
        inputs = [*velocity, *self._foot_bar, *step]
        if stages.fluid.scheme == "paper":
            advection_adjoint.trace_euler_adjoint.launch(layout, device, inputs, centre_bar)
        else:
            places, middle_bar = self._places[:2], self._own_feet[0]
            read = [array for place in places for array in place]
            advection_adjoint.place_middles.launch(layout, device, [*velocity, *step], read)
            inputs, outputs = [*velocity, *self._foot_bar, *read, *step], [*middle_bar, *centre_bar]
            advection_adjoint.trace_midpoint_adjoint.launch(layout, device, inputs, outputs)
            with together():
                for turn, (place, f) in enumerate(zip(places, middle_bar, strict=True)):
                    inputs, out = [*place, f, layout.nx, pitch], velocity_bar[turn]
                    scatter.scatter_bilinear.launch(layout, device, inputs, [out], turn=turn)
        with together():
            for f, ghosts in zip(centre_bar, stages.moved_ghosts, strict=True):
                ghosts.fill(f)
        with together():
            for f, before, out in zip(centre_bar, (1, pitch), velocity_bar, strict=True):
                inputs = [f, before, layout.nx]
                advection_adjoint.add_face_means.launch(layout, device, inputs, [out])
        inputs = [state.p_x, state.p_y, *velocity, out_bar.p_x, out_bar.p_y, *step]
        outputs = [*velocity_bar, bar.p_x, bar.p_y]
        transport_adjoint.carry_points_adjoint.launch(len(state.p_x), self.device, inputs, outputs, turn=0)
        for f, ghosts in zip(velocity_bar, stages.velocity_ghosts, strict=True):
            ghosts.fold(f)
