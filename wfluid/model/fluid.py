"""The fluid: its material, boundary conditions and numerical scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.checks import check_word, listed
from wfluid.domain.limits import CYCLES, DIFFUSION_LOSS, DIFFUSION_TOLERANCE, SCHEMES, SOLVERS, VISCOSITY
from wfluid.domain.showing import short_repr
from wfluid.domain.walls import Wall, Walls
from wfluid.model.densities import Density
from wfluid.model.painted import Freeze, Keyed, Painted, Quantity, as_quantity, check_painted


@dataclass(frozen=True, kw_only=True)
class Fluid:
    """Material, boundary conditions and numerical scheme of the fluid.

    Raises:
        ValueError: a value outside its range; the message states the range.
        TypeError: a freeze or a density of another type, or a viscosity that is no quantity.
    """

    viscosity: Quantity | np.ndarray = VISCOSITY
    """Kinematic viscosity mu [longer side^2/s], 0 … 1000: a number (0.001 … 0.005 in Bonilla & Velho, figure
    2), an array (height, width) of any size, which covers the picture, a `Painted` picture, `Keyed` values,
    or a function of the time [s] that returns any of these."""
    viscosity_moves: bool = False
    """Whether a painted viscosity moves with the picture; otherwise it stays in place."""
    freeze: Freeze | None = None
    """Mask that holds parts of the picture in place."""
    inertia: bool = True
    """Whether the fluid keeps its velocity when forces end. Without inertia it creeps: the velocity answers
    forces at once, as the Stokes flow that dissipates least, and only ratios of viscosities matter to how it
    deforms the picture."""
    densities: Sequence[Density] = ()
    """Densities such as ink and smoke, with different names; one needs no list."""
    walls: Walls | str = field(default_factory=Walls)
    """Boundary conditions at the edges: `Walls`, or "free-slip", "no-slip", "periodic", or one for each axis
    as "x,y"."""
    scheme: str = SCHEMES[0]
    """"standard": midpoint backtraces and cubic interpolation. "paper", as in Bonilla & Velho: Euler
    backtraces along the velocity after forces, bilinear interpolation, Jacobi solves, and a map that moves
    with the projected velocity. There a painted mu diffuses each component by div(mu grad f), since
    undamped Jacobi sweeps do not converge for the stress, which couples them."""
    solver: str | None = None
    """"multigrid" (default of the standard scheme) or "jacobi" (default of the paper's)."""
    pressure_cycles: int = CYCLES
    """Multigrid cycles per projection: 3 cycles leave 3e-4 of the divergence, 4 leave 1.4e-5."""
    diffusion_tolerance: float = DIFFUSION_TOLERANCE
    """Largest relative error of the viscous change of a step, 1e-14 … 0.5. Chebyshev sweeps are used if few
    suffice, otherwise two or more multigrid cycles, or conjugate gradients beside stiff paint."""
    diffusion_loss: float = DIFFUSION_LOSS
    """How far places of the map may be off after a second of the run by the solves of the diffusion [longer
    side], 1e-9 … 1. Conjugate gradients run until their estimated error allows it; a value below the default
    lowers `diffusion_tolerance` in proportion for sweeps and cycles."""
    pressure_tolerance: float = 5e-4
    """Relative residual of a projection with discontinuous drag, 1e-14 … 0.5; such projections are solved to
    this tolerance, and `pressure_cycles` does not apply."""
    sweeps: int = 50
    """Jacobi sweeps per solve with solver="jacobi"."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", Walls.parse(self.walls))
        object.__setattr__(self, "viscosity", as_quantity("viscosity", self.viscosity))
        keys = self.viscosity.keys.values() if isinstance(self.viscosity, Keyed) else [self.viscosity]
        for painted in keys:
            if isinstance(painted, Painted):
                check_painted(painted.values)
        if self.freeze is not None and not isinstance(self.freeze, Freeze):
            raise TypeError(f"freeze: expected Freeze(mask), got {type(self.freeze).__name__}")
        object.__setattr__(self, "densities", listed("densities", self.densities, Density, "Density objects"))
        if len(set(self.density_names)) < len(self.densities):
            raise ValueError(
                f"densities {', '.join(self.density_names)}: two have one name; give each its own"
            )
        check_word("scheme", self.scheme, SCHEMES)
        if not self.inertia and self.scheme == "paper":
            raise ValueError("scheme paper: its fluid has inertia; leave out the scheme or inertia=False")
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
        if not 1e-9 <= self.diffusion_loss <= 1:
            raise ValueError(f"diffusion_loss {self.diffusion_loss}: expected 1e-9 … 1")

    @property
    def density_names(self) -> tuple[str, ...]:
        """Names of the densities."""
        return tuple(density.name for density in self.densities)

    @property
    def boundary(self) -> Walls:
        """`walls`, which a fluid turns into `Walls` when it is made."""
        return Walls.parse(self.walls)

    @property
    def uniform(self) -> bool:
        """Whether the viscosity is one constant number and there is no drag."""
        return isinstance(self.viscosity, float) and self.freeze is None

    @property
    def separable(self) -> bool:
        """Whether the components of the velocity diffuse independently, with one constant viscosity.

        With no-slip walls only the paper's scheme treats them so; without inertia none does.
        """
        walls = self.boundary
        if self.scheme == "paper":
            return self.uniform
        return self.uniform and self.inertia and Wall.NO_SLIP not in (walls.x, walls.y)
