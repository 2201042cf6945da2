"""What resists the flow, painted over the grid: viscosity mu and drag alpha, on every level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import assign, from_numpy, where, zeros
from wfluid.fields.ghosts import Ghosts
from wfluid.fields.state import State
from wfluid.kernels.adjoint import transport as transport_adjoint
from wfluid.kernels.solve import stress
from wfluid.kernels.step import transport
from wfluid.model.fluid import Fluid
from wfluid.model.painted import Painted, check_painted, sample_at
from wfluid.solve.multigrid import hierarchy
from wfluid.solve.operators import CoefficientLevel
from wfluid.solve.transfer import Averaging
from wfluid.step.tape import attach_gradients, record

REACH = 3
"""Cells over which a jump is looked for: coarser levels see the rise of a few cells as one."""


@dataclass(frozen=True)
class Stiffness:
    """How hard a medium makes the coupled equation; what its solver is chosen by."""

    least: float
    """A bound below the eigenvalues of M^-1 A, M the row sums of |A|."""
    greatest: float
    """A bound above those of A."""
    jump: float
    """Largest ratio of row sums within `REACH` cells."""


class Coefficients:
    """A fluid's viscosity and drag on every grid of the hierarchy; a coarse cell has the mean of its cells.

    The finest grid follows the fluid through time (`set_time`) or the picture (`carry`); `coarsen` brings
    the others up to date.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.size = (grid.width, grid.height)
        grids = hierarchy(grid.nx, grid.ny, self.size)
        self.levels = [CoefficientLevel(*cells, fluid.walls, device) for cells in grids]
        pairs = [(fine.layout, coarse.layout) for fine, coarse in pairwise(self.levels)]
        self._means = [Averaging(*pair, device) for pair in pairs]
        self._face_means = [
            [
                Averaging(*pair, device, faces, fluid.walls.periodic)
                for faces in ((True, False), (False, True))
            ]
            for pair in pairs
        ]
        self.dt = zeros(1, device)
        self._now: tuple[float, float] | None = None
        top = self.levels[0]
        self._painted = (
            CoefficientLevel(grid.nx, grid.ny, fluid.walls, device) if fluid.viscosity_moves else top
        )
        self.mu = np.zeros((grid.ny, grid.nx))
        self.alpha = fluid.freeze.sample(grid) if fluid.freeze else np.zeros((grid.ny, grid.nx))
        from_numpy(self.alpha, top.alpha, top.layout)

    def set_time(self, t: float, dt: float) -> bool:
        """Take the viscosity at time t and the step dt; whether anything changed.

        Raises:
            ValueError: the viscosity at that time is negative, not finite or above the limit.
        """
        now = (t if self.changes else 0.0, dt)
        if now == self._now:
            return False
        self.mu = self.at(t)
        from_numpy(self.mu, self._painted.mu, self._painted.layout)
        self.fill_painted()
        assign([dt], self.dt)
        self._now = now
        return True

    def at(self, t: float) -> np.ndarray:
        """The viscosity where it is painted at time t [s], (ny, nx).

        Raises:
            ValueError: it is negative, not finite or above the limit.
        """
        mu = sample_at(self.fluid.viscosity, self.grid, t)
        check_painted(mu)
        return np.broadcast_to(mu, self.mu.shape)

    def bound_over(self, times: Sequence[float], dt: float) -> None:
        """Let the bounds of `stiffness` hold for the viscosity at all these times, and steps of dt.

        Raises:
            ValueError: as `at`.
        """
        self.invalidate()
        assign([dt], self.dt)
        self.mu = self.at(times[0])
        for t in times[1:]:
            self.mu = np.maximum(self.mu, self.at(t))

    def fill_painted(self) -> None:
        """Fill the ghosts of the viscosity where it is painted: launches only."""
        self._painted.fill()

    def invalidate(self) -> None:
        """Have the next `set_time` begin anew."""
        self._now = None

    @property
    def painted_mu(self) -> wp.array:
        """The viscosity where it is painted, with ghosts; that of the finest level where it does not move."""
        return self._painted.mu

    @property
    def changes(self) -> bool:
        """Whether the viscosity depends on the time."""
        return not isinstance(self.fluid.viscosity, float | Painted)

    def allow_gradients(self) -> None:
        """Allocate the gradient of the viscosity, where the fluid is and where it is painted."""
        layout = self.levels[0].layout
        attach_gradients([self.painted_mu, self.levels[0].mu], layout)

    def carry(self, state: State) -> None:
        """Take the viscosity along with the picture: launches only."""
        layout, painted, top = self.levels[0].layout, self._painted, self.levels[0]
        inputs = [painted.mu, state.d_x, state.d_y, *where(self.grid, self.fluid.walls, layout)]
        transport.carried_along.launch(layout, self.device, inputs, [top.mu])
        record(partial(self._carry_back, state), [painted.mu, state.d_x, state.d_y], [top.mu])

    def _carry_back(self, state: State) -> None:
        """Add to the gradients of the painted viscosity, ghosts included, and of the displacement."""
        layout, painted, top = self.levels[0].layout, self._painted, self.levels[0]
        numbers = where(self.grid, self.fluid.walls, layout)
        inputs = [painted.mu, state.d_x, state.d_y, top.mu.grad, *numbers]
        outputs = [painted.mu.grad, state.d_x.grad, state.d_y.grad]
        transport_adjoint.carried_along_adjoint.launch(layout, self.device, inputs, outputs, turn=0)

    def fold_painted(self) -> None:
        """The transpose of `fill_painted`: what ghosts have of the gradient goes to the cells."""
        if self.fluid.viscosity_moves:
            rules = self.fluid.walls.centre_rules()
            Ghosts(self.levels[0].layout, rules, self.device).fold(self.painted_mu.grad)

    def coarsen(self) -> None:
        """Bring every level up to date with the finest: launches only."""
        top = self.levels[0]
        top.fill()
        for beta, along in zip(top.beta, (1, top.layout.pitch), strict=True):
            stress.drag_factor.launch(top.layout, self.device, [top.alpha, self.dt, along], [beta])
        top.fill_beta()
        for means, face_means, (fine, coarse) in zip(
            self._means, self._face_means, pairwise(self.levels), strict=True
        ):
            means.average(fine.mu, coarse.mu)
            means.average(fine.alpha, coarse.alpha)
            coarse.fill()
            for faces, beta, to in zip(face_means, fine.beta, coarse.beta, strict=True):
                faces.average(beta, to)
            coarse.fill_beta()

    def stiffness(self, dt: float) -> Stiffness:
        """The bounds for a step dt. Paint that moves, or is still to come, may lie beside any other."""
        moves = self.fluid.viscosity_moves
        hx, hy = self.grid.hx, self.grid.hy
        per_mu = 4 * dt * (max(2 / hx**2 + 1 / hy**2, 1 / hx**2 + 2 / hy**2) + 1 / (hx * hy))
        drag = 1 + dt * self.alpha
        rows = drag + per_mu * self.mu
        return Stiffness(
            least=float(1 / (1 + per_mu * self.mu.max() / drag.min())),
            greatest=float(drag.max() + per_mu * self.mu.max()),
            jump=_steepest(rows) if self._now and not moves else float(rows.max() / drag.min()),
        )

    def drag_jump(self, dt: float) -> float:
        """Largest ratio of 1 + dt alpha within `REACH` cells."""
        return _steepest(1 + dt * self.alpha)


def _steepest(values: np.ndarray) -> float:
    """Largest ratio of positive values within `REACH` cells along an axis."""
    logs = np.log(values)
    along = (np.abs(logs[REACH:] - logs[:-REACH]), np.abs(logs[:, REACH:] - logs[:, :-REACH]))
    return float(np.exp(max(steps.max(initial=0.0) for steps in along)))
