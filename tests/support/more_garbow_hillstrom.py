"""Every problem of J. J. Moré, B. S. Garbow, K. E. Hillstrom, Testing Unconstrained Optimization Software,
ACM Transactions on Mathematical Software 7 (1981), 17-41: f(x) = sum of r_i(x)^2, from the standard start.

Numbered and in the order of the paper's section 3. Where a dimension is free, those are taken for which the
paper gives a minimum, else 10, or 20 for the extended problems. Residuals are analytic in the complex plane
about the reals, so that a complex step checks their Jacobians.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Vector = np.ndarray
Matrix = np.ndarray


@dataclass(frozen=True, eq=False)
class Problem:
    """One problem, with what the paper says of its minima."""

    name: str
    """With the dimension where that is free."""
    residuals: Callable[[Vector], Vector]
    jacobian: Callable[[Vector], Matrix]
    start: Vector
    """The standard one."""
    minima: tuple[float, ...] = (0.0,)
    """All values that the paper gives, six digits each, local and infinitely far minima included."""

    def value_and_gradient(self, x: Vector) -> tuple[float, Vector]:
        """Sum of squares; where it overflows, infinite or nan."""
        with np.errstate(all="ignore"):
            residuals = self.residuals(x)
            return float(residuals @ residuals), 2 * self.jacobian(x).T @ residuals


def numbers(text: str) -> Vector:
    """A table of the paper's."""
    return np.array(text.split(), dtype=float)


def rosenbrock() -> Problem:
    """1."""

    def residuals(x: Vector) -> Vector:
        return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])

    def jacobian(x: Vector) -> Matrix:
        return np.array([[-20 * x[0], 10], [-1, 0]])

    return Problem("Rosenbrock", residuals, jacobian, np.array([-1.2, 1.0]))


def freudenstein_roth() -> Problem:
    """2."""

    def residuals(x: Vector) -> Vector:
        a, b = x
        return np.array([-13 + a + ((5 - b) * b - 2) * b, -29 + a + ((b + 1) * b - 14) * b])

    def jacobian(x: Vector) -> Matrix:
        b = x[1]
        return np.array([[1, 10 * b - 3 * b**2 - 2], [1, 3 * b**2 + 2 * b - 14]])

    return Problem("Freudenstein-Roth", residuals, jacobian, np.array([0.5, -2.0]), (0.0, 48.9842))


def powell_badly_scaled() -> Problem:
    """3."""

    def residuals(x: Vector) -> Vector:
        return np.array([1e4 * x[0] * x[1] - 1, np.exp(-x[0]) + np.exp(-x[1]) - 1.0001])

    def jacobian(x: Vector) -> Matrix:
        return np.array([[1e4 * x[1], 1e4 * x[0]], -np.exp(-x)])

    return Problem("Powell badly scaled", residuals, jacobian, np.array([0.0, 1.0]))


def brown_badly_scaled() -> Problem:
    """4."""

    def residuals(x: Vector) -> Vector:
        return np.array([x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2])

    def jacobian(x: Vector) -> Matrix:
        return np.array([[1, 0], [0, 1], [x[1], x[0]]])

    return Problem("Brown badly scaled", residuals, jacobian, np.array([1.0, 1.0]))


def beale() -> Problem:
    """5."""
    i = np.arange(1, 4)
    y = numbers("1.5 2.25 2.625")

    def residuals(x: Vector) -> Vector:
        return y - x[0] * (1 - x[1] ** i)

    def jacobian(x: Vector) -> Matrix:
        return np.stack([x[1] ** i - 1, x[0] * i * x[1] ** (i - 1)], axis=1)

    return Problem("Beale", residuals, jacobian, np.array([1.0, 1.0]))


def jennrich_sampson() -> Problem:
    """6, m = 10."""
    i = np.arange(1, 11)

    def residuals(x: Vector) -> Vector:
        return 2 + 2 * i - np.exp(i * x[0]) - np.exp(i * x[1])

    def jacobian(x: Vector) -> Matrix:
        return -i[:, None] * np.exp(np.outer(i, x))

    return Problem("Jennrich-Sampson", residuals, jacobian, np.array([0.3, 0.4]), (124.362,))


def helical_valley() -> Problem:
    """7."""

    def residuals(x: Vector) -> Vector:
        turns = np.arctan(x[1] / x[0]) / (2 * np.pi) + (0.5 if x[0].real < 0 else 0.0)
        return np.array([10 * (x[2] - 10 * turns), 10 * (np.sqrt(x[0] ** 2 + x[1] ** 2) - 1), x[2]])

    def jacobian(x: Vector) -> Matrix:
        radius = np.hypot(x[0], x[1])
        turns = np.array([-x[1], x[0], 0]) / (2 * np.pi * radius**2)
        along = np.array([x[0], x[1], 0]) / radius
        return np.array([[0, 0, 10] - 100 * turns, 10 * along, [0, 0, 1]])

    return Problem("Helical valley", residuals, jacobian, np.array([-1.0, 0.0, 0.0]))


def bard() -> Problem:
    """8."""
    u = np.arange(1.0, 16)
    v = 16 - u
    w = np.minimum(u, v)
    y = numbers("0.14 0.18 0.22 0.25 0.29 0.32 0.35 0.39 0.37 0.58 0.73 0.96 1.34 2.10 4.39")

    def residuals(x: Vector) -> Vector:
        return y - (x[0] + u / (v * x[1] + w * x[2]))

    def jacobian(x: Vector) -> Matrix:
        below = (v * x[1] + w * x[2]) ** 2
        return np.stack([-np.ones(15), u * v / below, u * w / below], axis=1)

    return Problem("Bard", residuals, jacobian, np.ones(3), (8.21487e-3, 17.4286))


def gaussian() -> Problem:
    """9."""
    t = (8 - np.arange(1, 16)) / 2
    half = numbers("0.0009 0.0044 0.0175 0.0540 0.1295 0.2420 0.3521")
    y = np.concatenate([half, [0.3989], half[::-1]])

    def residuals(x: Vector) -> Vector:
        return x[0] * np.exp(-x[1] * (t - x[2]) ** 2 / 2) - y

    def jacobian(x: Vector) -> Matrix:
        away = t - x[2]
        bell = np.exp(-x[1] * away**2 / 2)
        return np.stack([bell, -x[0] * bell * away**2 / 2, x[0] * bell * x[1] * away], axis=1)

    return Problem("Gaussian", residuals, jacobian, np.array([0.4, 1.0, 0.0]), (1.12793e-8,))


def meyer() -> Problem:
    """10."""
    t = 45 + 5 * np.arange(1.0, 17)
    y = numbers(
        "34780 28610 23650 19630 16370 13720 11540 9744 8261 7030 6005 5147 4427 3820 3307 2872",
    )

    def residuals(x: Vector) -> Vector:
        return x[0] * np.exp(x[1] / (t + x[2])) - y

    def jacobian(x: Vector) -> Matrix:
        below = t + x[2]
        grown = np.exp(x[1] / below)
        return np.stack([grown, x[0] * grown / below, -x[0] * grown * x[1] / below**2], axis=1)

    return Problem("Meyer", residuals, jacobian, np.array([0.02, 4000.0, 250.0]), (87.9458,))


def gulf() -> Problem:
    """11, m = 99. The paper's "y_i m i x_2" is a misprint of y_i - x_2, as its own minimiser shows."""
    t = np.arange(1, 100) / 100
    y = 25 + (-50 * np.log(t)) ** (2 / 3)

    def residuals(x: Vector) -> Vector:
        away = np.sqrt((y - x[1]) ** 2)
        return np.exp(-(away ** x[2]) / x[0]) - t

    def jacobian(x: Vector) -> Matrix:
        away = np.abs(y - x[1])
        power = away ** x[2]
        left = np.exp(-power / x[0])
        by_second = left * x[2] * away ** (x[2] - 1) * np.sign(y - x[1]) / x[0]
        return np.stack([left * power / x[0] ** 2, by_second, -left * power * np.log(away) / x[0]], axis=1)

    return Problem("Gulf", residuals, jacobian, np.array([5.0, 2.5, 0.15]))


def box() -> Problem:
    """12, m = 10."""
    t = np.arange(1, 11) / 10
    known = np.exp(-t) - np.exp(-10 * t)

    def residuals(x: Vector) -> Vector:
        return np.exp(-t * x[0]) - np.exp(-t * x[1]) - x[2] * known

    def jacobian(x: Vector) -> Matrix:
        return np.stack([-t * np.exp(-t * x[0]), t * np.exp(-t * x[1]), -known], axis=1)

    return Problem("Box", residuals, jacobian, np.array([0.0, 10.0, 20.0]))


def powell_singular(n: int) -> Problem:
    """13, and extended 22."""

    def residuals(x: Vector) -> Vector:
        a, b, c, d = x.reshape(-1, 4).T
        found = [a + 10 * b, np.sqrt(5) * (c - d), (b - 2 * c) ** 2, np.sqrt(10) * (a - d) ** 2]
        return np.stack(found, axis=1).ravel()

    def jacobian(x: Vector) -> Matrix:
        found = np.zeros((n, n))
        for k in range(0, n, 4):
            a, b, c, d = x[k : k + 4]
            second, fourth = 2 * (b - 2 * c), 2 * np.sqrt(10) * (a - d)
            found[k : k + 4, k : k + 4] = [
                [1, 10, 0, 0],
                [0, 0, np.sqrt(5), -np.sqrt(5)],
                [0, second, -2 * second, 0],
                [fourth, 0, 0, -fourth],
            ]
        return found

    name = "Powell singular" if n == 4 else f"Extended Powell singular {n}"
    return Problem(name, residuals, jacobian, np.tile([3.0, -1.0, 0.0, 1.0], n // 4))


def wood() -> Problem:
    """14."""

    def residuals(x: Vector) -> Vector:
        a, b, c, d = x
        valleys = [10 * (b - a**2), 1 - a, np.sqrt(90) * (d - c**2), 1 - c]
        return np.array([*valleys, np.sqrt(10) * (b + d - 2), (b - d) / np.sqrt(10)])

    def jacobian(x: Vector) -> Matrix:
        found = np.zeros((6, 4))
        found[0, :2] = -20 * x[0], 10
        found[1, 0] = found[3, 2] = -1
        found[2, 2:] = -2 * np.sqrt(90) * x[2], np.sqrt(90)
        found[4, [1, 3]] = np.sqrt(10)
        found[5, [1, 3]] = 1 / np.sqrt(10), -1 / np.sqrt(10)
        return found

    return Problem("Wood", residuals, jacobian, np.array([-3.0, -1.0, -3.0, -1.0]))


def kowalik_osborne() -> Problem:
    """15."""
    y = numbers("0.1957 0.1947 0.1735 0.1600 0.0844 0.0627 0.0456 0.0342 0.0323 0.0235 0.0246")
    u = numbers("4 2 1 0.5 0.25 0.167 0.125 0.1 0.0833 0.0714 0.0625")

    def residuals(x: Vector) -> Vector:
        return y - x[0] * (u**2 + u * x[1]) / (u**2 + u * x[2] + x[3])

    def jacobian(x: Vector) -> Matrix:
        above, below = u**2 + u * x[1], u**2 + u * x[2] + x[3]
        by_below = x[0] * above / below**2
        return np.stack([-above / below, -x[0] * u / below, by_below * u, by_below], axis=1)

    start = np.array([0.25, 0.39, 0.415, 0.39])
    return Problem("Kowalik-Osborne", residuals, jacobian, start, (3.07505e-4, 1.02734e-3))


def brown_dennis() -> Problem:
    """16, m = 20."""
    t = np.arange(1, 21) / 5

    def parts(x: Vector) -> tuple[Vector, Vector]:
        return x[0] + t * x[1] - np.exp(t), x[2] + np.sin(t) * x[3] - np.cos(t)

    def residuals(x: Vector) -> Vector:
        one, other = parts(x)
        return one**2 + other**2

    def jacobian(x: Vector) -> Matrix:
        one, other = parts(x)
        return 2 * np.stack([one, one * t, other, other * np.sin(t)], axis=1)

    start = np.array([25.0, 5.0, -5.0, -1.0])
    return Problem("Brown-Dennis", residuals, jacobian, start, (85822.2,))


def osborne_1() -> Problem:
    """17."""
    t = 10 * np.arange(33.0)
    y = numbers("""
        0.844 0.908 0.932 0.936 0.925 0.908 0.881 0.850 0.818 0.784 0.751
        0.718 0.685 0.658 0.628 0.603 0.580 0.558 0.538 0.522 0.506 0.490
        0.478 0.467 0.457 0.448 0.438 0.431 0.424 0.420 0.414 0.411 0.406
    """)

    def residuals(x: Vector) -> Vector:
        return y - (x[0] + x[1] * np.exp(-t * x[3]) + x[2] * np.exp(-t * x[4]))

    def jacobian(x: Vector) -> Matrix:
        one, other = np.exp(-t * x[3]), np.exp(-t * x[4])
        return np.stack([-np.ones(33), -one, -other, t * x[1] * one, t * x[2] * other], axis=1)

    start = np.array([0.5, 1.5, -1.0, 0.01, 0.02])
    return Problem("Osborne 1", residuals, jacobian, start, (5.46489e-5,))


def biggs_exp6() -> Problem:
    """18, m = 13."""
    t = np.arange(1, 14) / 10
    y = np.exp(-t) - 5 * np.exp(-10 * t) + 3 * np.exp(-4 * t)

    def residuals(x: Vector) -> Vector:
        return x[2] * np.exp(-t * x[0]) - x[3] * np.exp(-t * x[1]) + x[5] * np.exp(-t * x[4]) - y

    def jacobian(x: Vector) -> Matrix:
        a, b, e = np.exp(-t * x[0]), np.exp(-t * x[1]), np.exp(-t * x[4])
        return np.stack([-t * x[2] * a, t * x[3] * b, a, -b, -t * x[5] * e, e], axis=1)

    start = np.array([1.0, 2.0, 1.0, 1.0, 1.0, 1.0])
    return Problem("Biggs EXP6", residuals, jacobian, start, (0.0, 5.65565e-3))


def osborne_2() -> Problem:
    """19."""
    t = np.arange(65) / 10
    y = numbers("""
        1.366 1.191 1.112 1.013 0.991 0.885 0.831 0.847 0.786 0.725 0.746 0.679 0.608
        0.655 0.616 0.606 0.602 0.626 0.651 0.724 0.649 0.649 0.694 0.644 0.624 0.661
        0.612 0.558 0.533 0.495 0.500 0.423 0.395 0.375 0.372 0.391 0.396 0.405 0.428
        0.429 0.523 0.562 0.607 0.653 0.672 0.708 0.633 0.668 0.645 0.632 0.591 0.559
        0.597 0.625 0.739 0.710 0.729 0.720 0.636 0.581 0.428 0.292 0.162 0.098 0.054
    """)

    def bells(x: Vector) -> tuple[Matrix, Matrix]:
        away = t[:, None] - x[8:]
        return away, np.exp(-(away**2) * x[5:8])

    def residuals(x: Vector) -> Vector:
        return y - (x[0] * np.exp(-t * x[4]) + bells(x)[1] @ x[1:4])

    def jacobian(x: Vector) -> Matrix:
        decay = np.exp(-t * x[4])[:, None]
        away, bell = bells(x)
        by_width = x[1:4] * bell * away**2
        by_centre = -2 * x[1:4] * bell * away * x[5:8]
        return np.hstack([-decay, -bell, t[:, None] * x[0] * decay, by_width, by_centre])

    start = numbers("1.3 0.65 0.65 0.7 0.6 3 5 7 2 4.5 5.5")
    return Problem("Osborne 2", residuals, jacobian, start, (4.01377e-2,))


def watson(n: int, minimum: float) -> Problem:
    """20."""
    t = np.arange(1, 30)[:, None] / 29
    j = np.arange(n)
    powers = t**j
    slopes = j * t ** np.maximum(j - 1, 0)

    def residuals(x: Vector) -> Vector:
        return np.concatenate([slopes @ x - (powers @ x) ** 2 - 1, [x[0], x[1] - x[0] ** 2 - 1]])

    def jacobian(x: Vector) -> Matrix:
        last = np.zeros((2, n))
        last[0, 0] = 1
        last[1, :2] = -2 * x[0], 1
        return np.vstack([slopes - 2 * (powers @ x)[:, None] * powers, last])

    return Problem(f"Watson {n}", residuals, jacobian, np.zeros(n), (minimum,))


def extended_rosenbrock(n: int) -> Problem:
    """21."""

    def residuals(x: Vector) -> Vector:
        a, b = x.reshape(-1, 2).T
        return np.stack([10 * (b - a**2), 1 - a], axis=1).ravel()

    def jacobian(x: Vector) -> Matrix:
        found = np.zeros((n, n))
        for k in range(0, n, 2):
            found[k : k + 2, k : k + 2] = [[-20 * x[k], 10], [-1, 0]]
        return found

    return Problem(f"Extended Rosenbrock {n}", residuals, jacobian, np.tile([-1.2, 1.0], n // 2))


def penalty_1(n: int, minimum: float) -> Problem:
    """23."""
    weight = np.sqrt(1e-5)

    def residuals(x: Vector) -> Vector:
        return np.append(weight * (x - 1), np.sum(x**2) - 0.25)

    def jacobian(x: Vector) -> Matrix:
        return np.vstack([weight * np.eye(n), 2 * x])

    return Problem(f"Penalty I {n}", residuals, jacobian, np.arange(1.0, n + 1), (minimum,))


def penalty_2(n: int, minimum: float) -> Problem:
    """24."""
    weight = np.sqrt(1e-5)
    y = np.exp(np.arange(2, n + 1) / 10) + np.exp(np.arange(1, n) / 10)
    falling = np.arange(n, 0, -1)

    def residuals(x: Vector) -> Vector:
        grown = np.exp(x / 10)
        pairs, single = grown[1:] + grown[:-1] - y, grown[1:] - np.exp(-0.1)
        return np.concatenate([[x[0] - 0.2], weight * pairs, weight * single, [falling @ x**2 - 1]])

    def jacobian(x: Vector) -> Matrix:
        slopes = np.diag(np.exp(x / 10) / 10)
        pairs, single = slopes[1:] + slopes[:-1], slopes[1:]
        return np.vstack([np.eye(n)[:1], weight * pairs, weight * single, 2 * falling * x])

    return Problem(f"Penalty II {n}", residuals, jacobian, np.full(n, 0.5), (minimum,))


def variably_dimensioned(n: int) -> Problem:
    """25."""
    j = np.arange(1, n + 1)

    def residuals(x: Vector) -> Vector:
        whole = j @ (x - 1)
        return np.concatenate([x - 1, [whole, whole**2]])

    def jacobian(x: Vector) -> Matrix:
        return np.vstack([np.eye(n), j, 2 * (j @ (x - 1)) * j])

    return Problem(f"Variably dimensioned {n}", residuals, jacobian, 1 - j / n)


def trigonometric(n: int) -> Problem:
    """26."""
    i = np.arange(1, n + 1)

    def residuals(x: Vector) -> Vector:
        return n - np.sum(np.cos(x)) + i * (1 - np.cos(x)) - np.sin(x)

    def jacobian(x: Vector) -> Matrix:
        return np.sin(x) + np.diag(i * np.sin(x) - np.cos(x))

    return Problem(f"Trigonometric {n}", residuals, jacobian, np.full(n, 1 / n))


def brown_almost_linear(n: int) -> Problem:
    """27."""

    def residuals(x: Vector) -> Vector:
        return np.append(x[:-1] + np.sum(x) - (n + 1), np.prod(x) - 1)

    def jacobian(x: Vector) -> Matrix:
        others = [np.prod(np.delete(x, j)) for j in range(n)]
        return np.vstack([np.eye(n)[:-1] + 1, others])

    return Problem(f"Brown almost-linear {n}", residuals, jacobian, np.full(n, 0.5), (0.0, 1.0))


def discrete_boundary_value(n: int) -> Problem:
    """28."""
    h = 1 / (n + 1)
    t = np.arange(1, n + 1) * h
    second = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)

    def residuals(x: Vector) -> Vector:
        return second @ x + h**2 * (x + t + 1) ** 3 / 2

    def jacobian(x: Vector) -> Matrix:
        return second + np.diag(1.5 * h**2 * (x + t + 1) ** 2)

    return Problem(f"Discrete boundary value {n}", residuals, jacobian, t * (t - 1))


def discrete_integral_equation(n: int) -> Problem:
    """29."""
    h = 1 / (n + 1)
    t = np.arange(1, n + 1) * h
    kernel = np.where(np.tri(n, dtype=bool), np.outer(1 - t, t), np.outer(t, 1 - t)) * h / 2

    def residuals(x: Vector) -> Vector:
        return x + kernel @ (x + t + 1) ** 3

    def jacobian(x: Vector) -> Matrix:
        return np.eye(n) + 3 * kernel * (x + t + 1) ** 2

    return Problem(f"Discrete integral equation {n}", residuals, jacobian, t * (t - 1))


def broyden_tridiagonal(n: int) -> Problem:
    """30."""
    beside = np.eye(n, k=-1) + 2 * np.eye(n, k=1)

    def residuals(x: Vector) -> Vector:
        return (3 - 2 * x) * x - beside @ x + 1

    def jacobian(x: Vector) -> Matrix:
        return np.diag(3 - 4 * x) - beside

    return Problem(f"Broyden tridiagonal {n}", residuals, jacobian, -np.ones(n))


def broyden_banded(n: int) -> Problem:
    """31."""
    band = np.tri(n, k=1) - np.tri(n, k=-6) - np.eye(n)

    def residuals(x: Vector) -> Vector:
        return x * (2 + 5 * x**2) + 1 - band @ (x * (1 + x))

    def jacobian(x: Vector) -> Matrix:
        return np.diag(2 + 15 * x**2) - band * (1 + 2 * x)

    return Problem(f"Broyden banded {n}", residuals, jacobian, -np.ones(n))


def linear(name: str, n: int, matrix: Matrix, minimum: float) -> Problem:
    """A x - 1."""

    def residuals(x: Vector) -> Vector:
        return matrix @ x - 1

    def jacobian(x: Vector) -> Matrix:
        return matrix

    return Problem(f"{name} {n}", residuals, jacobian, np.ones(n), (minimum,))


def linear_full_rank(n: int, m: int) -> Problem:
    """32."""
    return linear("Linear full rank", n, np.eye(m, n) - 2 / m, m - n)


def linear_rank_1(n: int, m: int) -> Problem:
    """33."""
    matrix = np.outer(np.arange(1, m + 1), np.arange(1, n + 1))
    return linear("Linear rank 1", n, matrix, m * (m - 1) / (2 * (2 * m + 1)))


def linear_rank_1_bordered(n: int, m: int) -> Problem:
    """34: with zero columns and rows."""
    matrix = np.zeros((m, n))
    matrix[1:-1, 1:-1] = np.outer(np.arange(1, m - 1), np.arange(2, n))
    return linear("Linear rank 1 bordered", n, matrix, (m**2 + 3 * m - 6) / (2 * (2 * m - 3)))


def chebyquad(n: int, minimum: float) -> Problem:
    """35."""
    i = np.arange(1, n + 1)
    integrals = np.where(i % 2, 0, -1 / np.maximum(i**2 - 1, 1))

    def polynomials(x: Vector) -> tuple[Matrix, Matrix]:
        """T_i(2 x - 1) and slopes, by the recurrence T_i = 2 (2 x - 1) T_(i-1) - T_(i-2)."""
        z = 2 * x - 1
        values, slopes = [np.ones_like(z), z], [np.zeros_like(z), np.full_like(z, 2)]
        for _ in range(n - 1):
            slopes.append(4 * values[-1] + 2 * z * slopes[-1] - slopes[-2])
            values.append(2 * z * values[-1] - values[-2])
        return np.array(values[1:]), np.array(slopes[1:])

    def residuals(x: Vector) -> Vector:
        return polynomials(x)[0].mean(axis=1) - integrals

    def jacobian(x: Vector) -> Matrix:
        return polynomials(x)[1] / n

    return Problem(f"Chebyquad {n}", residuals, jacobian, i / (n + 1), (minimum,))


PROBLEMS = (
    rosenbrock(),
    freudenstein_roth(),
    powell_badly_scaled(),
    brown_badly_scaled(),
    beale(),
    jennrich_sampson(),
    helical_valley(),
    bard(),
    gaussian(),
    meyer(),
    gulf(),
    box(),
    powell_singular(4),
    wood(),
    kowalik_osborne(),
    brown_dennis(),
    osborne_1(),
    biggs_exp6(),
    osborne_2(),
    watson(6, 2.28767e-3),
    watson(9, 1.39976e-6),
    watson(12, 4.72238e-10),
    extended_rosenbrock(20),
    powell_singular(20),
    penalty_1(4, 2.24997e-5),
    penalty_1(10, 7.08765e-5),
    penalty_2(4, 9.37629e-6),
    penalty_2(10, 2.93660e-4),
    variably_dimensioned(10),
    trigonometric(10),
    brown_almost_linear(10),
    discrete_boundary_value(10),
    discrete_integral_equation(10),
    broyden_tridiagonal(10),
    broyden_banded(10),
    linear_full_rank(10, 20),
    linear_rank_1(10, 20),
    linear_rank_1_bordered(10, 20),
    chebyquad(8, 3.51687e-3),
    chebyquad(9, 0.0),
    chebyquad(10, 6.50395e-3),
)
"""The list was fixed before any minimiser of this repository was run on it."""
