"""Curl noise: a random force without divergence that does not depend on the grid.

Source: R. Bridson, J. Hourihan, M. Nordenstam, Curl-noise for procedural fluid flow, ACM Trans. Graph. 26,
2007.
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
"""Number of plane waves in the sum."""

_SPREAD = 0.5
"""Relative spread of wave numbers: they lie between 1 - this and 1 + this times that of the scale."""

_PEAK = 2 * math.sqrt(2 * MODES)
"""Upper bound of the force relative to its root mean square: all waves and ramps at their steepest."""


@dataclass(frozen=True, kw_only=True)
class NoiseForce(FieldForce):
    """Turbulence: the curl (d psi/d y, -d psi/d x) of a random stream function psi, times the envelope.

    psi is a sum of plane waves with random directions and phases, independent of the grid. Near closed walls
    it falls to 0 over half a scale; along a periodic axis the number of waves is an integer. The force is
    computed by differences of psi at nodes. It is therefore free of divergence up to rounding and acts in
    full, unless there is a `weight`. For noise with a period, `pull_back` is empty.

    Raises:
        ValueError: a value outside its range; the message states the range.
    """

    strength: float
    """Root mean square of the acceleration away from walls [longer side/s^2]."""
    scale: float = 0.2
    """Mean wavelength [longer side], twice the size of an eddy."""
    seed: int = 0
    """Seed of the random numbers, an integer from 0 on."""
    period: float | None = None
    """Time after which the changing noise repeats [s]; by default the noise is constant."""
    envelope: Envelope = field(default_factory=Constant)
    """Factor over time."""
    weight: Painted | None = None
    """Factor over the picture; 1 everywhere by default."""

    def __post_init__(self) -> None:
        self._settle()
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
        """Upper bound of the acceleration, a multiple of the strength [longer side/s^2]."""
        return abs(self.strength) * _PEAK

    def fields(self, grid: Grid, walls: Walls) -> list[tuple[np.ndarray, np.ndarray]]:
        """The curl on faces; with a period, two fields a quarter of a period apart."""
        random = np.random.default_rng(self.seed)
        return [self._curl(random, grid, walls) for _ in range(1 if self.period is None else 2)]

    def integrals(self, start: float, end: float) -> list[float]:
        """The envelope's integral [s]; with a period, the integrals of the envelope times cosine and sine."""
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
    """A stream function at nodes, (ny + 1, nx + 1), whose gradient has root mean square 1."""
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
    # long waves, drawn or rounded, keep the amplitude of the longest allowed wave
    amplitude = math.sqrt(2 / MODES) / np.maximum(np.hypot(*wave), (1 - _SPREAD) * 2 * math.pi / longest)
    x, y = (np.arange(n + 1) * h for n, h in ((grid.nx, grid.hx), (grid.ny, grid.hy)))
    along_x = np.exp(1j * np.outer(x, wave[0]))
    along_y = amplitude * np.exp(1j * (np.outer(y, wave[1]) + phase))
    return (along_y @ along_x.T).real


def _ramps(length: float, grid: Grid, walls: Walls) -> np.ndarray:
    """A factor at nodes, (ny + 1, nx + 1): 1 inside, with smooth ramps of `length` to 0 at closed walls."""
    factors = []
    for n, size, periodic in (
        (grid.ny, grid.height, walls.periodic[1]),
        (grid.nx, grid.width, walls.periodic[0]),
    ):
        at = np.linspace(0.0, size, n + 1)
        s = np.clip(np.minimum(at, size - at) / min(length, size / 2), 0.0, 1.0)
        factors.append(np.ones(n + 1) if periodic else ease(s))
    return np.outer(*factors)
