"""Viscosity mu and drag alpha, the coefficients of a step, on every grid of the multigrid hierarchy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import warp as wp

from wfluid.domain.grid import Grid
from wfluid.fields.arrays import assign, from_numpy, lookup_args, zeros
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
"""Distance [cells] over which a jump is measured: on coarser levels a rise over a few cells is a jump."""


@dataclass(frozen=True)
class Stiffness:
    """Bounds of the coupled equation's matrix A, by which its solver is chosen."""

    least: float
    """A lower bound of the eigenvalues of M^-1 A, M the row sums of |A|."""
    greatest: float
    """An upper bound of the eigenvalues of A."""
    least_row: float
    """Least row sum of |A|."""
    jump: float
    """Largest ratio of row sums `REACH` cells apart."""
    contrast: float
    """Largest ratio of any two row sums."""


class Coefficients:
    """A fluid's viscosity and drag on every grid of the hierarchy; a coarse cell has the mean of its cells.

    `set_time` sets the viscosity for a time, `carry` moves it with the picture: both change the finest grid
    only. `coarsen` then updates the others.
    """

    def __init__(self, grid: Grid, fluid: Fluid, device: wp.Device):
        self.grid, self.fluid, self.device = grid, fluid, device
        self.size = (grid.width, grid.height)
        grids = hierarchy(grid.nx, grid.ny, self.size)
        self.levels = [CoefficientLevel(*cells, fluid.boundary, device) for cells in grids]
        pairs = [(fine.layout, coarse.layout) for fine, coarse in pairwise(self.levels)]
        self._means = [Averaging(*pair, device) for pair in pairs]
        self._face_means = [
            [
                Averaging(*pair, device, faces, fluid.boundary.periodic)
                for faces in ((True, False), (False, True))
            ]
            for pair in pairs
        ]
        self.dt = zeros(1, device)
        self._now: tuple[float, float] | None = None
        top = self.levels[0]
        self._painted = (
            CoefficientLevel(grid.nx, grid.ny, fluid.boundary, device) if fluid.viscosity_moves else top
        )
        self._largest_mu = np.zeros((grid.ny, grid.nx))
        self._several_times = False
        self.set_drag(fluid.freeze.sample(grid) if fluid.freeze else np.zeros((grid.ny, grid.nx)))

    def set_drag(self, alpha: np.ndarray) -> None:
        """Set the drag [1/s] at centres, (ny, nx)."""
        self.alpha, top = alpha, self.levels[0]
        from_numpy(alpha, top.alpha, top.layout)

    def set_time(self, t: float, dt: float) -> bool:
        """Set the viscosity to that at time t, and the step to dt. Returns whether either has changed.

        Raises:
            ValueError: the viscosity at that time is negative, not finite or above the limit.
        """
        now = (t if self.changes else 0.0, dt)
        if now == self._now:
            return False
        mu = self.at(t)
        self._largest_mu, self._several_times = mu, False
        from_numpy(mu, self._painted.mu, self._painted.layout)
        self.fill_painted()
        assign([dt], self.dt)
        self._now = now
        return True

    def at(self, t: float) -> np.ndarray:
        """The painted viscosity at time t [s], before the picture moves it, (ny, nx).

        Raises:
            ValueError: it is negative, not finite or above the limit.
        """
        mu = sample_at(self.fluid.viscosity, self.grid, t)
        check_painted(mu)
        return np.broadcast_to(mu, (self.grid.ny, self.grid.nx))

    def bound_over(self, times: Sequence[float], dt: float) -> None:
        """Set the step to dt, and the bounds of `stiffness` for the viscosity at all these times.

        Raises:
            ValueError: as `at`.
        """
        self.invalidate()
        assign([dt], self.dt)
        largest = self.at(times[0])
        for t in times[1:]:
            largest = np.maximum(largest, self.at(t))
        self._largest_mu, self._several_times = largest, True

    def fill_painted(self) -> None:
        """Fill the ghosts of `painted_mu`: launches only."""
        self._painted.fill()

    def invalidate(self) -> None:
        """Make the next `set_time` set everything again."""
        self._now = None

    @property
    def painted_mu(self) -> wp.array:
        """The painted viscosity, with ghosts: the finest level's, unless the picture moves it."""
        return self._painted.mu

    @property
    def changes(self) -> bool:
        """Whether the viscosity depends on the time."""
        return not isinstance(self.fluid.viscosity, float | Painted)

    def allow_gradients(self) -> None:
        """Allocate the gradients of the viscosity: the painted one and the finest level's."""
        layout = self.levels[0].layout
        attach_gradients([self.painted_mu, self.levels[0].mu], layout, self.device)

    def carry(self, state: State) -> None:
        """Move the viscosity with the picture, by the map of `state`: launches only."""
        layout, painted, top = self.levels[0].layout, self._painted, self.levels[0]
        inputs = [painted.mu, state.d_x, state.d_y, *lookup_args(self.grid, self.fluid.boundary, layout)]
        transport.carried_along.launch(layout, self.device, inputs, [top.mu])
        record(partial(self._carry_back, state), [painted.mu, state.d_x, state.d_y], [top.mu])

    def _carry_back(self, state: State) -> None:
        """Add to the gradients of the painted viscosity, ghosts included, and of the displacement."""
        layout, painted, top = self.levels[0].layout, self._painted, self.levels[0]
        numbers = lookup_args(self.grid, self.fluid.boundary, layout)
        inputs = [painted.mu, state.d_x, state.d_y, top.mu.grad, *numbers]
        outputs = [painted.mu.grad, state.d_x.grad, state.d_y.grad]
        transport_adjoint.carried_along_adjoint.launch(layout, self.device, inputs, outputs, turn=0)

    def fold_painted(self) -> None:
        """The transpose of `fill_painted`: fold the ghosts of the gradient."""
        if self.fluid.viscosity_moves:
            rules = self.fluid.boundary.centre_rules()
            Ghosts(self.levels[0].layout, rules, self.device).fold(self.painted_mu.grad)

    def coarsen(self) -> None:
        """Update every level from the finest: launches only."""
        top = self.levels[0]
        top.fill()
        for beta, stride in zip(top.beta, (1, top.layout.pitch), strict=True):
            stress.drag_factor.launch(top.layout, self.device, [top.alpha, self.dt, stride], [beta])
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
        """The bounds for a step dt.

        Where the viscosity moves, or is that of several times, any two values may become neighbours.
        """
        local = not (self.fluid.viscosity_moves or self._several_times)
        hx, hy = self.grid.hx, self.grid.hy
        per_mu = 4 * dt * (max(2 / hx**2 + 1 / hy**2, 1 / hx**2 + 2 / hy**2) + 1 / (hx * hy))
        drag = 1 + dt * self.alpha
        mu = self._largest_mu
        rows = drag + per_mu * mu
        return Stiffness(
            least=float(1 / (1 + per_mu * mu.max() / drag.min())),
            greatest=float(drag.max() + per_mu * mu.max()),
            least_row=float(rows.min()),
            jump=_steepest(rows) if local else float(rows.max() / drag.min()),
            contrast=float(rows.max() / (rows if local else drag).min()),
        )

    def drag_jump(self, dt: float) -> float:
        """Largest ratio of 1 + dt alpha `REACH` cells apart."""
        return _steepest(1 + dt * self.alpha)


def _steepest(values: np.ndarray) -> float:
    """Largest ratio of positive values `REACH` cells apart along an axis."""
    logs = np.log(values)
    changes = (np.abs(logs[REACH:] - logs[:-REACH]), np.abs(logs[:, REACH:] - logs[:, :-REACH]))
    return float(np.exp(max(change.max(initial=0.0) for change in changes)))
