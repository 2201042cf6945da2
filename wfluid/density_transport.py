"""A density's part of a step: carried along the flow, poured, diffused."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import warp as wp

from wfluid.density import Density
from wfluid.diffusion import ScalarDiffusion
from wfluid.fluid import Fluid
from wfluid.grid import Grid
from wfluid.kernels import transport, transport_adjoint
from wfluid.kernels.cells import Layout
from wfluid.linear import Solve
from wfluid.multigrid import Points
from wfluid.state import Vector, field, from_numpy
from wfluid.walls import Ghosts


class DensityTransport:
    """Steps one density of a fluid."""

    def __init__(self, density: Density, grid: Grid, fluid: Fluid, device: wp.Device):
        self.density, self.device, self.layout = density, device, Layout(grid.nx, grid.ny)
        rules = fluid.walls.centre_rules()
        self._ghosts = Ghosts(self.layout, rules, device)
        self._diffusion = None
        if density.diffusion:
            self._diffusion = ScalarDiffusion(grid, fluid, Points(rules), device, conserved=True)
        self._carried = field(self.layout, device)
        self._initial = None if density.initial is None else density.initial.on(grid)

    def begin(self, rho: wp.array) -> None:
        """Give a density its initial values."""
        if self._initial is not None:
            from_numpy(self._initial, rho, self.layout)
            self._ghosts.fill(rho)

    def plan(self, dt: float) -> Solve:
        """Make ready for steps of dt; what the diffusion's solve will be."""
        return self._diffusion.plan(dt * self.density.diffusion) if self._diffusion else Solve("none", 0)

    def _diffuses(self) -> bool:
        return bool(self._diffusion and self._diffusion.how.iterations)

    def advance(
        self,
        rho: wp.array,
        foot: Vector,
        where: Sequence[int],
        pour: Callable[[wp.array], None],
        out: wp.array,
    ) -> None:
        """Out = the density a step later, with ghosts; `pour` adds what its sources do: launches only."""
        carried = self._carried if self._diffuses() else out
        transport.carry_density.launch(self.layout, self.device, [rho, *foot, *where], [carried])
        pour(carried)
        self._ghosts.fill(carried)
        if self._diffuses():
            self._diffusion.diffuse(carried, out)

    def adjoint(
        self,
        out_bar: wp.array,
        rho: wp.array,
        foot: Vector,
        where: Sequence[int],
        pour_adjoint: Callable[[wp.array], None],
        rho_bar: wp.array,
        foot_bar: Vector,
    ) -> None:
        """The transpose of `advance`: adds to `rho_bar`, writes `foot_bar`: launches only."""
        carried_bar = out_bar
        if self._diffuses():
            carried_bar = self._carried
            self._diffusion.adjoint(out_bar, carried_bar)
        pour_adjoint(carried_bar)
        inputs, outputs = [rho, *foot, carried_bar, *where], [rho_bar, *foot_bar]
        transport_adjoint.carry_density_adjoint.launch(self.layout, self.device, inputs, outputs, turn=0)

    def fold(self, rho_bar: wp.array) -> None:
        """Add the gradients with respect to ghosts to those of the cells they copy."""
        self._ghosts.fold(rho_bar)
