"""Checks of forces against the picture: places and vectors given in pixels instead of the longer side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from wfluid.domain.envelopes import Envelope, Instantaneous
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import CONVERSION, Path, Place
from wfluid.domain.walls import Walls
from wfluid.model.densities import Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, LocalForce
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.model.uniform_forces import Wind

ARROW = 10.0
"""Length from which the numbers of a vector may be pixels: shorter arrows are hardly drawn."""

CARRIED = 1.0
"""Displacement by such a force that no picture shows [longer side]."""

_SAMPLES = 64
"""Intervals of time in which a displacement is summed."""


def check_units(
    forces: Sequence[Force], fluid: Fluid, extent: tuple[float, float], side: int, end: float
) -> None:
    """Check the centres and vectors of forces, and the centres of sources, for numbers in pixels.

    `extent` is the picture's width and height [longer side], `side` its longer side [px], `end` the time up
    to which the forces act [s].

    Raises:
        ValueError: a centre outside the picture, or a vector that looks like pixels; the message has the
            conversion.
    """
    sources = [source for density in fluid.densities for source in density.sources]
    for thing in (*forces, *sources):
        if isinstance(thing, LocalForce | Source):
            _check_center(thing, fluid.boundary, extent, side)
    if fluid.inertia:
        for force in forces:
            if isinstance(force, GaussianForce | Wind) and math.hypot(*force.vector) >= ARROW:
                _check_vector(force, fluid, side, end)


def check_inside(name: str, place: Place, extent: tuple[float, float], side: int) -> None:
    """Check that a place lies in the picture.

    Raises:
        ValueError: it does not; the message has the conversion.
    """
    if not all(0 <= at <= size for at, size in zip(place, extent, strict=True)):
        raise ValueError(_outside(name, place, extent, side))


def _outside(name: str, place: Place, extent: tuple[float, float], side: int) -> str:
    (x, y), (width, height) = place, extent
    return (
        f"{name} ({x:g}, {y:g}) lies outside the picture, {width:g} x {height:g} longer sides: {CONVERSION}, "
        f"here {side}"
    )


def _check_center(thing: LocalForce | Source, walls: Walls, extent: tuple[float, float], side: int) -> None:
    """Refuse a fixed centre, or a path, that lies outside the picture; a periodic axis has no outside."""
    center = getattr(thing, "path", None) or getattr(thing, "center", None)
    if not isinstance(center, tuple | Path):
        return
    places = center.places if isinstance(center, Path) else [center]
    for axis, size in enumerate(extent):
        if not walls.periodic[axis] and all(not 0 <= place[axis] <= size for place in places):
            name = f"{type(thing).__name__}.{'path' if hasattr(thing, 'path') else 'center'}"
            raise ValueError(_outside(name, places[0], extent, side))


def _check_vector(force: GaussianForce | Wind, fluid: Fluid, side: int, end: float) -> None:
    """Refuse a vector of a pixel arrow's length that would carry the picture by more than its longer side."""
    (x, y), per_unit, acting = force.vector, *_reach(force.envelope, end)
    carried = math.hypot(x, y) * acting
    if isinstance(force, GaussianForce):
        carried = min(carried, _through_viscosity(force, fluid, end))
    if carried <= CARRIED:
        return
    pressure = 2 if isinstance(force, GaussianForce) else 1  # cancels half of a Gaussian push
    factor = pressure / (side * per_unit)
    raise ValueError(
        f"{type(force).__name__}.vector ({x:g}, {y:g}) would carry the picture {carried:.2g} times its "
        f"longer side: if it is an arrow of {x:g}, {y:g} pixels, write ({x * factor:.3g}, {y * factor:.3g})"
    )


def _reach(envelope: Envelope, end: float) -> tuple[float, float]:
    """Displacement of a free particle by an acceleration of 1 up to `end`; and while the force acts [s^2]."""
    times = np.linspace(0.0, end, _SAMPLES + 1)
    gained = np.array([envelope.integral(a, b) for a, b in pairwise(times)])
    speed = np.append(0.0, np.cumsum(gained))
    places = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * (end / _SAMPLES)))
    acts = (
        _SAMPLES if isinstance(envelope, Instantaneous) else int(np.flatnonzero(gained).max(initial=-1)) + 1
    )
    swings = 2 if isinstance(envelope, Oscillator) else 1  # its arrow is the amplitude
    return float(np.ptp(places)) / swings, float(np.ptp(places[: acts + 1]))


def _through_viscosity(force: GaussianForce, fluid: Fluid, end: float) -> float:
    """Displacement by a force whose velocity a uniform viscosity takes away [longer side]."""
    viscosity = fluid.viscosity.values.max() if isinstance(fluid.viscosity, Painted) else fluid.viscosity
    if not isinstance(viscosity, float) or viscosity <= 0:
        return math.inf
    times = np.linspace(0.0, end, _SAMPLES + 1)
    impulse = sum(abs(force.envelope.integral(a, b)) for a, b in pairwise(times))
    return math.hypot(*force.vector) * impulse * force.radius**2 / (2 * float(viscosity))
