"""The keyframes of a scene, in domain units."""

from __future__ import annotations

from dataclasses import dataclass

from wfluid.domain.paths import Place
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.model.gaussian_forces import GaussianForce


@dataclass(frozen=True)
class Aims:
    """What a scene wants of its points."""

    keyframes: tuple[ParticleKeyframe, ...]
    """Where they should be, and when."""
    pins: tuple[Place, ...]
    """Those that stay [longer side]."""
    found: tuple[GaussianForce, ...]
    """Forces found before."""
    tolerance: float
    """Residual that is good enough [longer side]."""
    seed: int
    """Of the search."""
    side: float
    """The longer side, in the scene's pixels."""
