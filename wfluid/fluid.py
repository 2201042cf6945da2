"""What the picture is made of: the fluid's parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from wfluid.walls import Walls

SCHEMES = ("standard", "paper")
SOLVERS = ("multigrid", "jacobi")

VISCOSITY_LIMIT = 1e3
"""Largest viscosity the solver is tested with [longer side^2/s]."""


@dataclass(frozen=True, kw_only=True)
class Fluid:
    """Viscosity, walls, and how the equations are solved.

    Raises:
        ValueError: a value outside its range, with the range.
    """

    viscosity: float = 0.001
    """Kinematic viscosity mu [longer side^2/s], 0 … 1000. The paper's figure 2: 0.001 … 0.005."""
    walls: Walls | str = field(default_factory=Walls)
    """Condition at the picture's edges: a `Walls`, or "free-slip", "no-slip", "periodic" or two of
    them as "x,y"."""
    scheme: str = "standard"
    """"standard": midpoint traces, cubic interpolation; "paper": Euler traces, bilinear interpolation
    and Jacobi solves, to reproduce it."""
    solver: str | None = None
    """"multigrid" (the standard scheme's default) or "jacobi" (the paper's)."""
    pressure_cycles: int = 3
    """Multigrid cycles a projection: 3 leave 3e-4 of the divergence, 4 leave 1.4e-5."""
    diffusion_tolerance: float = 7e-3
    """Part of a step's viscous change that a diffusion may leave undone, 1e-12 … 0.5: Chebyshev sweeps
    where few of them do, else two or more multigrid cycles."""
    sweeps: int = 50
    """Jacobi sweeps a solve, with solver="jacobi"."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", Walls.parse(self.walls))
        if not (math.isfinite(self.viscosity) and 0 <= self.viscosity <= VISCOSITY_LIMIT):
            raise ValueError(f"viscosity {self.viscosity}: expected 0 … {VISCOSITY_LIMIT:g}")
        _one_of("scheme", self.scheme, SCHEMES)
        if self.solver is None:
            object.__setattr__(self, "solver", "jacobi" if self.scheme == "paper" else "multigrid")
        _one_of("solver", self.solver, SOLVERS)
        for name in ("pressure_cycles", "sweeps"):
            if not (isinstance(getattr(self, name), int) and getattr(self, name) >= 1):
                raise ValueError(f"{name} {getattr(self, name)}: expected a whole number from 1 on")
        if not 1e-12 <= self.diffusion_tolerance <= 0.5:
            raise ValueError(f"diffusion_tolerance {self.diffusion_tolerance}: expected 1e-12 … 0.5")


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ValueError(f"{name} {value!r}: expected one of {', '.join(known)}")
