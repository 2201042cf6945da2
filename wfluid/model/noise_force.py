"""Curl noise: a random force without divergence, the same at any grid (after Bridson, Hourihan &
Nordenstam, Curl-noise for procedural fluid flow, ACM Trans. Graph. 26, 2007).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from wfluid.domain.envelopes import Constant, Envelope, product
from wfluid.domain.grid import Grid
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.piecewise import ease, finite
from wfluid.domain.walls import Walls
from wfluid.model.force import FORCE_LIMIT, FieldForce, on_faces
from wfluid.model.painted import Painted

MODES = 48
"""Waves that are added up."""

_SPREAD = 0.5
"""Wave numbers lie between (1 - this) and (1 + this) of that of the scale."""

_PEAK = 2 * math.sqrt(2 * MODES)
"""Bound of the force over its root mean square: all waves at their steepest, and the slope of the ramps."""


@dataclass(frozen=True, kw_only=True)
class NoiseForce(FieldForce):
    """Turbulence: the curl (d psi/d y, -d psi/d x) of a random stream function psi, times the envelope.

    psi is a sum of plane waves with random directions and phases, so it does not depend on the grid. Over
    half a scale it goes to 0 at closed walls; an axis that wraps has whole waves. Taken as differences of
    psi at nodes the force is free of divergence to rounding, hence acts in full (with a `weight` it is not).
    Of noise that changes `pull_back` gives nothing.

    Raises:
        ValueError: a value outside its range.
    """

    strength: float
    """Root mean square of the acceleration away from walls [longer side/s^2]."""
    scale: float = 0.2
    """Mean wavelength [longer side]: an eddy is half of it."""
    seed: int = 0
    """Which noise: a whole number from 0 on."""
    period: float | None = None
    """Time in which it changes and comes back [s]; it stands still by default."""
    envelope: Envelope = field(default_factory=Constant)
    """Course in time."""
    weight: Painted | None = None
    """Where it acts: a factor painted over the picture."""

    def __post_init__(self) -> None:
        finite("NoiseForce.strength", self.strength)
        if not abs(self.strength) <= FORCE_LIMIT / _PEAK:
            raise ValueError(
                f"NoiseForce: strength {self.strength}: expected at most {FORCE_LIMIT / _PEAK:g}"
            )
        if not 0.001 <= self.scale <= 2:
            raise ValueError(f"NoiseForce: scale {self.scale}: expected 0.001 … 2 longer sides")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ValueError(f"NoiseForce: seed {self.seed!r}: expected a whole number from 0 on")
        if self.period is not None and not (math.isfinite(self.period) and self.period > 0):
            raise ValueError(f"NoiseForce: period {self.period}: expected a positive number")

    @property
    def reach(self) -> float:
        """The strength, several times: no place has more [longer side/s^2]."""
        return abs(self.strength) * _PEAK

    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """The curl on faces; two of them, a quarter of a period apart, where the noise changes."""
        random = np.random.default_rng(self.seed)
        return [self._curl(random, grid, walls) for _ in range(1 if self.period is None else 2)]

    def integrals(self, start: float, end: float) -> list[float]:
        """The envelope's; times cosine and sine of a period where the noise changes."""
        if self.period is None:
            return super().integrals(start, end)
        waves = (Oscillator(period=self.period, phase=phase, centred=False) for phase in (0.25, 0.0))
        return [product(self.envelope, wave).integral(start, end) for wave in waves]

    def _curl(self, random: np.random.Generator, grid: Grid, walls: Walls) -> tuple[np.ndarray, np.ndarray]:
        psi = _waves(random, self.scale, grid, walls)
        psi *= self.strength * _ramps(self.scale / 2, grid, walls)
        force = [np.diff(psi, axis=0)[:, :-1] / grid.hy, -np.diff(psi, axis=1)[:-1] / grid.hx]
        return on_faces(force, self.weight, grid, walls)


def _waves(random: np.random.Generator, scale: float, grid: Grid, walls: Walls) -> np.ndarray:
    """A stream function at the nodes, (ny + 1, nx + 1), whose gradient has a root mean square of 1."""
    angle, phase = random.uniform(0, 2 * math.pi, (2, MODES))
    number = 2 * math.pi / scale * random.uniform(1 - _SPREAD, 1 + _SPREAD, MODES)
    wave = np.stack([number * np.cos(angle), number * np.sin(angle)])
    lengths, longest = (grid.width, grid.height), scale
    for axis, (length, periodic) in enumerate(zip(lengths, walls.periodic, strict=True)):
        if periodic:
            wave[axis] = np.round(wave[axis] * length / (2 * math.pi)) * (2 * math.pi / length)
        else:
            longest = min(longest, 2 * length)  # no eddy is longer than the picture between walls
    still = ~wave.any(axis=0)  # rounded to nothing: one wave along an axis that wraps
    wave[int(not walls.periodic[0]), still] = 2 * math.pi / lengths[int(not walls.periodic[0])]
    # a wave that rounding or the draw made longer is not made steeper for it
    amplitude = math.sqrt(2 / MODES) / np.maximum(np.hypot(*wave), (1 - _SPREAD) * 2 * math.pi / longest)
    x, y = (np.arange(n + 1) * h for n, h in ((grid.nx, grid.hx), (grid.ny, grid.hy)))
    along_x = np.exp(1j * np.outer(x, wave[0]))
    along_y = amplitude * np.exp(1j * (np.outer(y, wave[1]) + phase))
    return (along_y @ along_x.T).real


def _ramps(length: float, grid: Grid, walls: Walls) -> np.ndarray:
    """1 inside, falling smoothly to 0 within `length` of closed walls, at the nodes."""
    factors = []
    for n, size, periodic in (
        (grid.ny, grid.height, walls.periodic[1]),
        (grid.nx, grid.width, walls.periodic[0]),
    ):
        at = np.linspace(0.0, size, n + 1)
        s = np.clip(np.minimum(at, size - at) / min(length, size / 2), 0.0, 1.0)
        factors.append(np.ones(n + 1) if periodic else ease(s))
    return np.outer(*factors)
