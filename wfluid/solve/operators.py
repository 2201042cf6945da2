"""The linear equations of a step, as levels of the multigrid hierarchy."""

from __future__ import annotations

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
"""Least eigenvalue of D^-1 A that the sweeps of a five-point equation damp; what lies below is smooth and
left to the coarser level. Measured at 256 x 256: three cycles leave 2.3e-4 to 3.0e-4 for any value from
0.3 to 0.6."""

SMOOTHED_STRESS = 0.14
"""The same for the coupled equation, of M^-1 A, M the row sums; the highest is 1."""

SWEEPS_STRESS = 2
"""Sweeps on each side of the coarse correction in the coupled equation."""

FIVE_POINT_INTERVAL = (0.8, 1.0)
"""Where the eigenvalues of a cycle times A lie for the five-point equations."""

STRESS_INTERVAL = (0.65, 1.0)
"""The same for the coupled equation, where viscosity is smooth: 0.78 constant, 0.72 at a contrast of 50."""


class FivePoint(Level):
    """shift - scale Lap, constant, of a scalar: diffusion of one component, pressure without drag.

    Solved for diffusion (shift 1, scale dt mu) and for pressure (shift 0, scale 1).
    """

    def __init__(self, nx: int, ny: int, size: tuple[float, float], points: Location, device: wp.Device):
        super().__init__(nx, ny, size, [points], device)
        self.numbers = Scalars(device, "centre", "ax", "ay", "own", "near", "first", "second", "plain")
        self.rates = (self.numbers.first, self.numbers.second)
        self.plain = self.numbers.plain
        self.least = 0.0

    def set_coefficients(self, shift: float, scale: float) -> None:
        """Take the operator shift - scale Lap."""
        ax, ay = scale / self.h[0] ** 2, scale / self.h[1] ** 2
        centre = shift + 2 * ax + 2 * ay
        self.least = shift / centre
        first, second = chebyshev_factors(max(self.least, SMOOTHED), 2 - self.least, 2)
        self.numbers.set(
            centre=centre,
            ax=ax,
            ay=ay,
            own=(first + second - first * second) / centre,
            near=first * second / centre**2,
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
        """out = rate b; the rates hold 1 / centre."""
        algebra.scale.launch(self.layout, self.device, [*b, rate], out)

    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate (b - A x)."""
        c = self.numbers
        inputs = [*b, *x, rate, c.centre, c.ax, c.ay, self.layout.pitch]
        five_point.jacobi.launch(self.layout, self.device, inputs, out)

    def smooth_from_zero(self, b: Vector, rates, spare: Vector, out: Vector) -> None:
        """The two sweeps of a cycle in one pass; b with ghosts."""
        if rates is not self.rates:
            super().smooth_from_zero(b, rates, spare, out)
            return
        c = self.numbers
        inputs = [*b, c.own, c.near, c.ax, c.ay, self.layout.pitch]
        five_point.first_two_sweeps.launch(self.layout, self.device, inputs, out)
        self.fill(out)


class VariablePoisson(Level):
    """-div (beta grad q), beta on the faces: pressure where drag resists."""

    def __init__(self, medium: CoefficientLevel, size: tuple[float, float], walls: Walls, device: wp.Device):
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
    """v + dt alpha v - dt div (mu (grad v + grad v^T)): variable viscosity and drag, u and v coupled."""

    def __init__(self, medium: CoefficientLevel, size: tuple[float, float], walls: Walls, device: wp.Device):
        layout = medium.layout
        points = [Location(walls.u_rules(), (True, False)), Location(walls.v_rules(), (False, True))]
        super().__init__(layout.nx, layout.ny, size, points, device)
        self.medium = medium
        self.weights = vector(layout, device, 2)
        rates = [f"rate_{n}" for n in range(SWEEPS_STRESS)]
        self.numbers = Scalars(
            device, "dt", "normal_x", "normal_y", "shear_x", "shear_y", "cross", "plain", *rates
        )
        self.rates = tuple(getattr(self.numbers, rate) for rate in rates)
        self.plain = self.numbers.plain

    def set_step(self, dt: float, least: float) -> None:
        """Take the step dt; `least` is a bound below the eigenvalues of M^-1 A on the finest level."""
        hx, hy = self.h
        rates = chebyshev_factors(max(least, SMOOTHED_STRESS), 1.0, SWEEPS_STRESS)
        self.numbers.set(
            dt=dt,
            normal_x=2 * dt / hx**2,
            normal_y=2 * dt / hy**2,
            shear_x=dt / hx**2,
            shear_y=dt / hy**2,
            cross=dt / (hx * hy),
            plain=1.0,
            **{f"rate_{n}": rate for n, rate in enumerate(rates)},
        )

    def weigh(self) -> None:
        """Find M^-1, the weights of the sweeps: launches only; after the medium or the step change."""
        with together():
            for axis, medium in enumerate(self._axes()):
                stress.weight.launch(self.layout, self.device, medium, [self.weights[axis]])

    def _axes(self) -> tuple[list, list]:
        """The medium, the coefficients and the strides of u, then of v: the same with the axes exchanged."""
        c, medium, pitch = self.numbers, [self.medium.mu, self.medium.alpha], self.layout.pitch
        return (
            [*medium, c.dt, c.normal_x, c.shear_y, c.cross, 1, pitch],
            [*medium, c.dt, c.normal_y, c.shear_x, c.cross, pitch, 1],
        )

    def residual(self, b: Vector, x: Vector, out: Vector) -> None:
        """out = b - A x."""
        with together():
            for own, medium in enumerate(self._axes()):
                inputs = [b[own], x[own], x[1 - own], *medium]
                stress.residual.launch(self.layout, self.device, inputs, [out[own]])

    def first_sweep(self, b: Vector, rate: wp.array, out: Vector) -> None:
        """out = rate M^-1 b."""
        with together():
            for own in (0, 1):
                inputs = [b[own], self.weights[own], rate]
                stress.first_sweep.launch(self.layout, self.device, inputs, [out[own]])

    def sweep(self, b: Vector, x: Vector, rate: wp.array, out: Vector) -> None:
        """out = x + rate M^-1 (b - A x)."""
        with together():
            for own, medium in enumerate(self._axes()):
                inputs = [b[own], x[own], x[1 - own], *medium, self.weights[own], rate]
                stress.sweep.launch(self.layout, self.device, inputs, [out[own]])


class CoefficientLevel:
    """Viscosity and drag on one grid."""

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
        """Fill the ghosts of mu and alpha: both continue evenly over a wall."""
        self._ghosts.fill(self.mu)
        self._ghosts.fill(self.alpha)

    def fill_beta(self) -> None:
        """Fill the ghosts of beta. On a wall it means nothing: nothing flows there."""
        for beta in self.beta:
            self._ghosts.fill(beta)
