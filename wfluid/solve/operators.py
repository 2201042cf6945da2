"""The linear equations of a step, as levels of the multigrid hierarchy."""

from __future__ import annotations

from typing import Protocol

import warp as wp

from wfluid.domain.walls import Walls
from wfluid.fields.arrays import Scalars, Vector, field, vector
from wfluid.fields.ghosts import Ghosts
from wfluid.kernels.cell.layout import Layout
from wfluid.kernels.cell.strips import together
from wfluid.kernels.solve import algebra, five_point, stress
from wfluid.solve.chebyshev import chebyshev_factors
from wfluid.solve.multigrid import Level, Location

SMOOTHED = 0.45
"""Least eigenvalue of D^-1 A that the sweeps of a five-point equation damp. Errors below it are smooth: the
coarser level reduces them. Measured at 256 x 256: after three cycles the residual is 2.3e-4 to 3.0e-4 of b
for any value from 0.3 to 0.6."""

SMOOTHED_STRESS = 0.14
"""Least eigenvalue of M^-1 A that the sweeps of the coupled equation damp; the greatest is 1."""

SWEEPS_STRESS = 2
"""Sweeps on each side of the coarse correction in the coupled equation."""

STRESS_NUMBERS = ("normal_x", "normal_y", "shear_x", "shear_y", "cross")
"""Coefficients of the coupled equation (`kernels/solve/stress`)."""

FIVE_POINT_INTERVAL = (0.8, 1.0)
"""Interval of the eigenvalues of a cycle times A for the five-point equations."""

STRESS_INTERVAL = (0.65, 1.0)
"""Interval of the eigenvalues of a cycle times A for the coupled equation with smooth viscosity.

The least one measured is 0.78 for constant viscosity, 0.72 at a contrast of 50."""


class FivePoint(Level):
    """The operator A = shift - scale Lap with constant coefficients, of one component.

    Diffusion has shift 1 and scale dt mu, pressure without drag shift 0 and scale 1.
    """

    def __init__(self, nx: int, ny: int, size: tuple[float, float], points: Location, device: wp.Device):
        super().__init__(nx, ny, size, [points], device)
        self.numbers = Scalars(
            device, "centre", "ax", "ay", "centre_factor", "neighbour_factor", "first", "second", "plain"
        )
        self.rates = (self.numbers.first, self.numbers.second)
        self.plain = self.numbers.plain
        self.least = 0.0

    def set_coefficients(self, shift: float, scale: float) -> None:
        """Set the operator to shift - scale Lap."""
        ax, ay = scale / self.h[0] ** 2, scale / self.h[1] ** 2
        centre = shift + 2 * ax + 2 * ay
        self.least = shift / centre
        first, second = chebyshev_factors(max(self.least, SMOOTHED), 2 - self.least, 2)
        self.numbers.set(
            centre=centre,
            ax=ax,
            ay=ay,
            centre_factor=(first + second - first * second) / centre,
            neighbour_factor=first * second / centre**2,
            first=first / centre,
            second=second / centre,
            plain=1 / centre,
        )
        self.centre = centre

    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x."""
        c = self.numbers
        inputs = [*b, *x, c.centre, c.ax, c.ay, self.layout.pitch]
        five_point.residual.launch(self.layout, self.device, inputs, out)

    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate b; the rates contain 1 / centre."""
        algebra.scale.launch(self.layout, self.device, [*b, rate], out)

    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate (b - A x)."""
        c = self.numbers
        inputs = [*b, *x, rate, c.centre, c.ax, c.ay, self.layout.pitch]
        five_point.jacobi.launch(self.layout, self.device, inputs, out)

    def smooth_from_zero(self, b: Vector, rates, spare: Vector, out: Vector) -> None:
        """Sweep from zero; the two sweeps of a cycle take one pass.

        Reads the ghosts of b, fills those of out.
        """
        if rates is not self.rates:
            super().smooth_from_zero(b, rates, spare, out)
            return
        c = self.numbers
        inputs = [*b, c.centre_factor, c.neighbour_factor, c.ax, c.ay, self.layout.pitch]
        five_point.first_two_sweeps.launch(self.layout, self.device, inputs, out)
        self.fill(out)


class FaceCoefficients(Protocol):
    """Coefficients on the faces of a grid."""

    @property
    def layout(self) -> Layout:
        """Layout of the grid."""

    @property
    def beta(self) -> Vector:
        """On x-faces and on y-faces, ghosts filled."""


class VariablePoisson(Level):
    """The operator A q = -div (beta grad q) with beta on the faces: pressure with drag."""

    def __init__(self, medium: FaceCoefficients, size: tuple[float, float], walls: Walls, device: wp.Device):
        layout = medium.layout
        super().__init__(layout.nx, layout.ny, size, [Location(walls.centre_rules())], device)
        self.medium = medium
        self.numbers = Scalars(device, "ax", "ay", "first", "second", "plain")
        self.rates = (self.numbers.first, self.numbers.second)
        self.plain = self.numbers.plain
        first, second = chebyshev_factors(SMOOTHED, 2.0, 2)
        ax, ay = (h**-2 for h in self.h)
        self.numbers.set(ax=ax, ay=ay, first=first, second=second, plain=1.0)

    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x."""
        inputs = [*b, *x, *self.medium.beta, self.numbers.ax, self.numbers.ay, self.layout.pitch]
        five_point.residual_beta.launch(self.layout, self.device, inputs, out)

    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate b / centre."""
        inputs = [*b, *self.medium.beta, rate, self.numbers.ax, self.numbers.ay, self.layout.pitch]
        five_point.first_sweep_beta.launch(self.layout, self.device, inputs, out)

    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate (b - A x) / centre."""
        inputs = [*b, *x, *self.medium.beta, rate, self.numbers.ax, self.numbers.ay, self.layout.pitch]
        five_point.jacobi_beta.launch(self.layout, self.device, inputs, out)


class ViscousStress(Level):
    """The operator A v = v + dt alpha v - dt div (mu (grad v + grad v^T)), which couples u and v.

    If not `coupled`, it is A f = f + dt alpha f - dt div (mu grad f) for each component f.
    """

    def __init__(
        self,
        medium: CoefficientLevel,
        size: tuple[float, float],
        walls: Walls,
        device: wp.Device,
        coupled: bool = True,
    ):
        layout = medium.layout
        points = [Location(walls.u_rules(), (True, False)), Location(walls.v_rules(), (False, True))]
        super().__init__(layout.nx, layout.ny, size, points, device)
        self.medium, self._coupled = medium, coupled
        self.weights = vector(layout, device, 2)
        rates = [f"rate_{n}" for n in range(SWEEPS_STRESS)]
        weighed = [f"weighed_{name}" for name in STRESS_NUMBERS]
        self.numbers = Scalars(device, "dt", "plain", *STRESS_NUMBERS, *weighed, *rates)
        self.rates = tuple(getattr(self.numbers, rate) for rate in rates)
        self.plain = self.numbers.plain

    def set_step(self, dt: float, least: float, plain: bool = False) -> None:
        """Set the time step dt [s]; the eigenvalues of M^-1 A on the finest level are at least `least`.

        M is the row sums of |A|, or with `plain` the diagonal of A, of an operator that is not coupled.
        """
        hx, hy = self.h
        rates = chebyshev_factors(max(least, SMOOTHED_STRESS), 1.0, SWEEPS_STRESS)
        normal, cross = (2, 1) if self._coupled else (1, 0)
        numbers = {
            "normal_x": normal * dt / hx**2,
            "normal_y": normal * dt / hy**2,
            "shear_x": dt / hx**2,
            "shear_y": dt / hy**2,
            "cross": cross * dt / (hx * hy),
        }
        # a row's other entries sum to as much as the viscous part of its diagonal
        part = 0.5 if plain else 1.0
        weighed = {f"weighed_{name}": part * value for name, value in numbers.items()}
        swept = {f"rate_{n}": rate for n, rate in enumerate(rates)}
        self.numbers.set(dt=dt, plain=1.0, **numbers, **weighed, **swept)

    def weigh(self) -> None:
        """Compute M^-1, the weights of the sweeps, after the medium or the step change: launches only."""
        with together():
            for axis, medium in enumerate(self._axes("weighed_")):
                stress.weight.launch(self.layout, self.device, medium, [self.weights[axis]])

    def _axes(self, kind: str = "") -> tuple[list, list]:
        """Medium, coefficients and strides of u, then of v with the axes exchanged, as in `stress`.

        The coefficients are those of the operator, or with `kind` "weighed_" those of its weights.
        """
        c, medium, pitch = self.numbers, [self.medium.mu, self.medium.alpha], self.layout.pitch
        normal_x, normal_y, shear_x, shear_y, cross = (getattr(c, kind + name) for name in STRESS_NUMBERS)
        return (
            [*medium, c.dt, normal_x, shear_y, cross, 1, pitch],
            [*medium, c.dt, normal_y, shear_x, cross, pitch, 1],
        )

    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x."""
        with together():
            for component, medium in enumerate(self._axes()):
                inputs = [b[component], x[component], x[1 - component], *medium]
                stress.residual.launch(self.layout, self.device, inputs, [out[component]])

    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate M^-1 b."""
        with together():
            for component in (0, 1):
                inputs = [b[component], self.weights[component], rate]
                stress.first_sweep.launch(self.layout, self.device, inputs, [out[component]])

    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate M^-1 (b - A x)."""
        with together():
            for component, medium in enumerate(self._axes()):
                fields = [b[component], x[component], x[1 - component]]
                inputs = [*fields, *medium, self.weights[component], rate]
                stress.sweep.launch(self.layout, self.device, inputs, [out[component]])


class CoefficientLevel:
    """Viscosity, drag and face coefficients on one grid."""

    def __init__(self, nx: int, ny: int, walls: Walls, device: wp.Device):
        self.layout = Layout(nx, ny)
        self.mu = field(self.layout, device)
        """Viscosity [longer side^2/s] at centres, ghosts filled."""
        self.alpha = field(self.layout, device)
        """Drag [1/s] at centres, ghosts filled."""
        self.beta = vector(self.layout, device, 2)
        """1 / (1 + dt alpha) on x-faces and on y-faces, ghosts filled."""
        self._ghosts = Ghosts(self.layout, walls.centre_rules(), device)

    def fill(self) -> None:
        """Fill the ghosts of mu and alpha by even reflection at walls."""
        self._ghosts.fill(self.mu)
        self._ghosts.fill(self.alpha)

    def fill_beta(self) -> None:
        """Fill the ghosts of beta. Its values on walls have no effect, since no fluid crosses a wall."""
        for beta in self.beta:
            self._ghosts.fill(beta)
