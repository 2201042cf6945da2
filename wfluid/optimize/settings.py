"""Settings of a minimisation, and the statuses that it can end with.

Notation: f is the function, g its gradient, n the number of variables, k the number of an iteration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from numbers import Integral


class Status(Enum):
    """Why a minimisation ended."""

    CONVERGED = "converged"
    """The largest entry of the gradient is at most `Settings.gradient_tolerance`."""
    SMALL_CHANGE = "small change"
    """An iteration lowered f by at most `Settings.change_tolerance`, relative to |f|."""
    FLAT = "flat"
    """Ten iterations lowered neither f nor the largest entry of the gradient: rounding prevents progress."""
    NO_PROGRESS = "no progress"
    """No lower point was found, even along -g: gradient and values disagree, or rounding prevents
    progress."""
    ITERATIONS = "iterations"
    """The limit `Settings.iterations` was reached."""
    EVALUATIONS = "evaluations"
    """The limit `Settings.evaluations` was reached, possibly within a line search."""
    STOPPED = "stopped"
    """The callback returned True."""
    NOT_FINITE = "not finite"
    """f or its gradient is not finite at the start."""


@dataclass(frozen=True)
class Settings:
    """Stopping criteria of a minimisation, and parameters of its steps.

    Raises:
        ValueError: a setting outside its legal range; the message states the range.
    """

    memory: int = 10
    """Number of pairs s, y kept, at least 1. Larger values, up to 30, save evaluations of an expensive
    function; each pair costs 5 n multiplications per iteration and 2 n numbers of memory."""
    gradient_tolerance: float = 1e-6
    """`CONVERGED` if max |g_i| <= gradient_tolerance, at least 0 [unit of f / unit of x]. Set it to the
    change of f per unit of x that no longer matters. With 0 only g = 0 counts."""
    change_tolerance: float = 0.0
    """`SMALL_CHANGE` if f_k - f_(k+1) <= change_tolerance max(|f_k|, |f_(k+1)|), at least 0 and below 1. With
    0 the test is off. Set it to about 1e-3 where smaller gains do not justify further evaluations."""
    iterations: int = 1000
    """Largest number of iterations, at least 0; iterations before a resumed state count."""
    evaluations: int = 2000
    """Largest number of evaluations, at least 1; evaluations before a resumed state count. It limits the
    computing time."""
    decrease: float = 1e-3
    """c1 of the line search's condition f(x + a d) <= f(x) + c1 a g.d, above 0 and below 1/2. There is
    rarely a reason to change it."""
    curvature: float = 0.9
    """c2 of the line search's condition |g(x + a d).d| <= c2 |g.d|, above `decrease` and below 1. Smaller
    values make line searches longer and iterations fewer, which rarely saves evaluations."""
    noise: float = 1e-10
    """Relative rounding error of f, at least 0 and below 1. A step may end higher than the lowest value by
    noise |f| if its slope meets the conditions. Use 1e-6 for functions in single precision."""
    first_step: float = 1.0
    """Length |x_1 - x_0| of the first trial step, and of any other without pairs in memory, above 0. Set it
    to the expected order of |x - x_0| if that is not 1."""

    def __post_init__(self) -> None:
        is_count = isinstance(self.memory, Integral)
        legal = {
            "memory": (is_count and self.memory >= 1, "a whole number, at least 1"),
            "gradient_tolerance": (0 <= self.gradient_tolerance < math.inf, "at least 0"),
            "change_tolerance": (0 <= self.change_tolerance < 1, "at least 0, below 1"),
            "iterations": (self.iterations >= 0, "at least 0"),
            "evaluations": (self.evaluations >= 1, "at least 1, that of the start"),
            "decrease": (0 < self.decrease < 0.5, "above 0, below 1/2"),
            "curvature": (self.decrease < self.curvature < 1, "above decrease, below 1"),
            "noise": (0 <= self.noise < 1, "at least 0, below 1"),
            "first_step": (0 < self.first_step < math.inf, "above 0"),
        }
        for name, (is_legal, rule) in legal.items():
            if not is_legal:
                raise ValueError(f"{name} is {getattr(self, name)}, must be {rule}")
