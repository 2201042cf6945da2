"""What the picture is made of: the fluid's parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.checks import check_word
from wfluid.domain.limits import CYCLES, SCHEMES, SOLVERS, VISCOSITY
from wfluid.domain.walls import Wall, Walls
from wfluid.model.densities import Density
from wfluid.model.painted import Freeze, Keyed, Painted, Quantity, as_quantity, check_painted


@dataclass(frozen=True, kw_only=True)
class Fluid:
    """Viscosity, walls, and how the equations are solved.

    Raises:
        ValueError: a value outside its range, with the range.
    """

    viscosity: Quantity | np.ndarray = VISCOSITY
    """Kinematic viscosity mu [longer side^2/s], 0 … 1000: a number (the paper's figure 2: 0.001 …
    0.005), an array (height, width) of any size over the picture, a `Painted` picture, `Keyed` ones, or
    a function of the time [s] that gives any of these."""
    viscosity_moves: bool = False
    """Whether a painted viscosity moves with the picture, instead of staying where it is painted."""
    freeze: Freeze | None = None
    """What holds parts of the picture in place."""
    densities: Sequence[Density] = ()
    """What is dissolved in it: ink, smoke; each with a name of its own."""
    walls: Walls | str = field(default_factory=Walls)
    """Condition at the picture's edges: a `Walls`, or "free-slip", "no-slip", "periodic" or two of
    them as "x,y"."""
    scheme: str = SCHEMES[0]
    """"standard": midpoint traces, cubic interpolation; "paper": Euler traces, bilinear interpolation
    and Jacobi solves, to reproduce it."""
    solver: str | None = None
    """"multigrid" (the standard scheme's default) or "jacobi" (the paper's)."""
    pressure_cycles: int = CYCLES
    """Multigrid cycles a projection: 3 leave 3e-4 of the divergence, 4 leave 1.4e-5."""
    diffusion_tolerance: float = 7e-3
    """Part of a step's viscous change that a diffusion may leave undone, 1e-14 … 0.5: Chebyshev sweeps
    where few of them do, else two or more multigrid cycles."""
    pressure_tolerance: float = 5e-4
    """Part of a projection that may be left undone where drag jumps and it is solved to a tolerance instead
    of by `pressure_cycles`, 1e-14 … 0.5."""
    sweeps: int = 50
    """Jacobi sweeps a solve, with solver="jacobi"."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", Walls.parse(self.walls))
        object.__setattr__(self, "viscosity", as_quantity("viscosity", self.viscosity))
        keys = self.viscosity.keys.values() if isinstance(self.viscosity, Keyed) else [self.viscosity]
        for painted in keys:
            if isinstance(painted, Painted):
                check_painted(painted.values)
        if self.freeze is not None and not isinstance(self.freeze, Freeze):
            raise TypeError(f"freeze: expected Freeze(mask), got {type(self.freeze).__name__}")
        object.__setattr__(self, "densities", tuple(self.densities))
        if not all(isinstance(density, Density) for density in self.densities):
            raise TypeError("densities: expected Density objects")
        if len(set(self.density_names)) < len(self.densities):
            raise ValueError(f"densities {', '.join(self.density_names)}: two have one name")
        check_word("scheme", self.scheme, SCHEMES)
        default = "jacobi" if self.scheme == "paper" else "multigrid"
        solver = default if self.solver is None else self.solver
        check_word("solver", solver, SOLVERS)
        object.__setattr__(self, "solver", solver)
        for name in ("pressure_cycles", "sweeps"):
            if not (isinstance(getattr(self, name), int) and getattr(self, name) >= 1):
                raise ValueError(f"{name} {getattr(self, name)}: expected a whole number from 1 on")
        for name in ("diffusion_tolerance", "pressure_tolerance"):
            if not 1e-14 <= getattr(self, name) <= 0.5:
                raise ValueError(f"{name} {getattr(self, name)}: expected 1e-14 … 0.5")

    @property
    def density_names(self) -> tuple[str, ...]:
        """What the densities are called."""
        return tuple(density.name for density in self.densities)

    @property
    def boundary(self) -> Walls:
        """`walls`, which a fluid turns into `Walls` when it is made."""
        return Walls.parse(self.walls)

    @property
    def uniform(self) -> bool:
        """Whether one viscosity, and no drag, holds everywhere and at all times."""
        return isinstance(self.viscosity, float) and self.freeze is None

    @property
    def separable(self) -> bool:
        """Whether the two components of the velocity may be diffused apart from each other."""
        walls = self.boundary
        return self.uniform and Wall.NO_SLIP not in (walls.x, walls.y)
