"""Objectives of the state, computed on the device: misfits of maps and densities, and Warp programs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import warp as wp

from wfluid.domain.paths import Place
from wfluid.domain.showing import short_repr
from wfluid.fields.arrays import fill, from_numpy, read, vector, zeros
from wfluid.fields.state import State
from wfluid.fields.sums import InnerProduct
from wfluid.gradient.objectives import Objective, finite_array, places_of
from wfluid.kernels.adjoint import misfit
from wfluid.kernels.solve import algebra
from wfluid.model.painted import Painted
from wfluid.step.step import Step


class StateObjective(Objective):
    """An objective of the fluid at one time."""

    time: float
    """Time at which it is evaluated [s]."""

    @property
    def times(self) -> tuple[float, ...]:
        """`time` alone."""
        return (self.time,)

    @abstractmethod
    def term(self, step: Step, weight: float, particles: slice) -> DeviceObjective:
        """The objective on the device, times `weight`, for the grid and fluid of `step`.

        `particles` are the entries of its particles among the state's.
        """


class DeviceObjective(ABC):
    """An objective of the fluid at one time, on the device, times its weight."""

    @abstractmethod
    def measure(self, state: State) -> None:
        """Compute its value at a state: launches only."""

    @abstractmethod
    def value(self) -> float:
        """The value computed by the last `measure`."""

    @abstractmethod
    def adjoint(self, state: State, bar: State) -> None:
        """Add its gradient with respect to a state to `bar`: launches only."""


@dataclass(frozen=True, eq=False)
class MapMisfit(StateObjective):
    """The misfit of the map: 1/2 the integral over the picture of weight |d - target|^2.

    d is the displacement source - x, as in `State.displacement` [longer side].

    Raises:
        ValueError: a target that is not finite or not (2, ny, nx) of the grid.
    """

    target: np.ndarray
    """Target displacement [longer side], (2, ny, nx)."""
    time: float
    """Time at which it is evaluated [s]."""
    weight: Painted | None = None
    """A factor painted over the picture; 1 by default."""

    __repr__ = short_repr

    def term(self, step: Step, weight: float, particles: slice) -> DeviceObjective:
        """The objective on the device, where displacements are in cells."""
        grid = step.grid
        scales = (grid.hx, grid.hy)
        target = finite_array("MapMisfit.target", self.target, (2, grid.ny, grid.nx))
        targets = [component / h for component, h in zip(target, scales, strict=True)]
        squares = [weight * h**2 * grid.hx * grid.hy for h in scales]
        return _FieldMisfit(step, ("d_x", "d_y"), targets, squares, self.weight)


@dataclass(frozen=True, eq=False)
class DensityMisfit(StateObjective):
    """The misfit of a density: 1/2 the integral over the picture of weight (rho - target)^2.

    Raises:
        ValueError: a density that does not exist; a target that is not finite or not (ny, nx) of the grid.
    """

    density: str
    """Name of the `Density`."""
    target: np.ndarray
    """Target density, (ny, nx)."""
    time: float
    """Time at which it is evaluated [s]."""
    weight: Painted | None = None
    """A factor painted over the picture; 1 by default."""

    __repr__ = short_repr

    def term(self, step: Step, weight: float, particles: slice) -> DeviceObjective:
        """The objective on the device."""
        grid, names = step.grid, step.fluid.density_names
        if self.density not in names:
            there = ", ".join(names) or "none"
            raise ValueError(f"DensityMisfit of {self.density!r}: expected one of the fluid's ({there})")
        target = finite_array("DensityMisfit.target", self.target, (grid.ny, grid.nx))
        squares = [weight * grid.hx * grid.hy]
        return _FieldMisfit(step, (names.index(self.density),), [target], squares, self.weight)


class _FieldMisfit(DeviceObjective):
    """Half the weighted sum of squares of fields at centres minus their targets."""

    def __init__(
        self,
        step: Step,
        names: Sequence[str | int],
        targets: Sequence[np.ndarray],
        squares: Sequence[float],
        paint: Painted | None,
    ):
        self._names, self.layout, self.device, grid = names, step.layout, step.device, step.grid
        fields = len(names)
        self._targets, self._weights, self._residuals, self._weighted = (
            vector(self.layout, self.device, fields) for _ in range(4)
        )
        painted = np.ones((grid.ny, grid.nx)) if paint is None else paint.sample(grid)
        for n, (target, square) in enumerate(zip(targets, squares, strict=True)):
            from_numpy(target, self._targets[n], self.layout)
            from_numpy(square * painted, self._weights[n], self.layout)
        self._inner = InnerProduct(self.layout, self.device, fields)

    def _fields(self, state: State) -> list[wp.array]:
        return [state.rho[name] if isinstance(name, int) else getattr(state, name) for name in self._names]

    def measure(self, state: State) -> None:
        """Compute the weighted squares, summed along rows."""
        self._misfit(state)
        self._inner.along_rows(self._residuals, self._weighted)

    def _misfit(self, state: State) -> None:
        """Compute the residual of each field, and the residual times its weight."""
        for n, f in enumerate(self._fields(state)):
            out = [self._residuals[n], self._weighted[n]]
            inputs = [f, self._targets[n], self._weights[n]]
            misfit.misfit.launch(self.layout, self.device, inputs, out)

    def value(self) -> float:
        """Half the sum of the last `measure` over rows."""
        return 0.5 * self._inner.total()

    def adjoint(self, state: State, bar: State) -> None:
        """Add the weighted residuals."""
        self._misfit(state)
        for weighted, to in zip(self._weighted, self._fields(bar), strict=True):
            algebra.add.launch(self.layout, self.device, [weighted], [to])


@dataclass(frozen=True, eq=False)
class WarpObjective(StateObjective):
    """A user-defined objective: Warp kernels, which Warp differentiates.

    >>> @wp.kernel
    ... def spread(x: wp.array[float], y: wp.array[float], value: wp.array[float]):
    ...     n = wp.tid()
    ...     wp.atomic_add(value, 0, x[n] * x[n] + y[n] * y[n])
    >>> def launch(state, value):
    ...     wp.launch(spread, len(state.p_x), [state.p_x, state.p_y, value])
    >>> objective = WarpObjective(launch, time=1.0, points=[(0.4, 0.5)])

    The program is called once; its launches are captured and repeated. So it must do nothing but launch.
    Fields have ghosts and padded rows: with `state.layout`, the cell in column i of row j is entry
    `first + j * pitch + i`. Values read from other entries have no gradient.

    Raises:
        ValueError: a program that launches nothing, when the objective is first evaluated.
    """

    program: Callable[[State, wp.array], Any]
    """Launches kernels that read the state's arrays (units as `State` says) and add to `value[0]`."""
    time: float
    """Time at which it is evaluated [s]."""
    points: np.ndarray | Sequence[Place] = field(default_factory=lambda: np.empty((0, 2)))
    """Positions of particles at the beginning [longer side], (n, 2). Positions later are the state's p_x and
    p_y [cells]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", places_of("points", self.points))

    def term(self, step: Step, weight: float, particles: slice) -> DeviceObjective:
        """The objective on the device."""
        return _Program(self.program, weight, particles, step.device)


class _Program(DeviceObjective):
    """A user's launches, recorded on a tape of their own."""

    def __init__(
        self, program: Callable[[State, wp.array], Any], weight: float, particles: slice, device: wp.Device
    ):
        self._program, self._weight, self._particles = program, weight, particles
        self._value = zeros(1, device, gradient=True)
        self._no_points = zeros(0, device)

    def measure(self, state: State) -> None:
        """Run the program, recorded on its tape."""
        fill(0.0, self._value)
        entries = self._particles
        p_x, p_y = (p[entries] if entries.stop > entries.start else self._no_points for p in state.particles)
        self._tape = wp.Tape()
        seen = replace(state, p_x=p_x, p_y=p_y)
        with self._tape:
            self._program(seen, self._value)
        if not self._tape.launches:
            raise ValueError("WarpObjective: the program launched no kernel that Warp can differentiate")
        arrays = [a for n in self._tape.launches if not callable(n) for a in (*n[3], *n[4])]
        others = {a.ptr for a in (*seen.arrays, self._value)}
        self._intermediate = [a for a in arrays if isinstance(a, wp.array) and a.grad and a.ptr not in others]

    def value(self) -> float:
        """The program's value times the weight."""
        return self._weight * float(read(self._value)[0])

    def adjoint(self, state: State, bar: State) -> None:
        """Play the tape backward, which adds to the gradients of the state's arrays, `bar`."""
        fill(self._weight, self._value.grad)
        fill(0.0, *(a.grad for a in self._intermediate))
        self._tape.backward()
