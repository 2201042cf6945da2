"""The free numbers of a setup as one flat vector, with a scaled slice for each name.

Users give names as text ("forces[0].vector"). Everything else uses addresses ("forces", 0, "vector").
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from typing import Any

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.domain.showing import short_repr
from wfluid.model.densities import PaintedSource
from wfluid.model.fluid import Fluid
from wfluid.model.force import FieldForce, Force, GaussianImpulse
from wfluid.model.painted import Painted
from wfluid.model.uniform_forces import Buoyancy

POSITIVE = ("radius", "period", "viscosity")
"""Numbers that must stay positive: the vector has their logarithms, so no bounds are needed."""

VELOCITY, VISCOSITY = "velocity", "fluid.viscosity"

Address = tuple[str | int, ...]
"""The attributes and indices that lead from a setup to numbers in it."""


@dataclass(frozen=True)
class Setup:
    """What is simulated: a fluid, the forces on it, and the velocity it begins with."""

    fluid: Fluid
    """The fluid."""
    forces: tuple[Force, ...]
    """The forces on it, with groups replaced by their forces."""
    velocity: np.ndarray
    """Velocity at the beginning [longer side/s], (2, ny, nx): u on the first nx x-faces, v on the first
    ny y-faces. Values on walls are ignored: there it is 0."""

    __repr__ = short_repr

    def number(self, name: str) -> object:
        """The number or numbers with a name such as "forces[0].vector"."""
        return _follow(self, address_of(name))


@dataclass(frozen=True)
class Free:
    """Numbers of a `Setup` that may vary.

    Raises:
        ValueError: a scale that is not positive and finite.
    """

    name: str
    """Their name: "forces[0].vector", "forces[*].center", "forces[2].envelope.values",
    "fluid.viscosity", "fluid.densities[0].sources[1].rate", "velocity"."""
    scale: float = 1.0
    """The change of the number for a change by 1 in the vector, in the number's unit; for radii, periods and
    viscosities the change of the logarithm."""
    parts: Sequence[bool] | np.ndarray | None = None
    """A mask of the numbers' shape, True for those that may vary; all by default."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale of {self.name}: {self.scale} is not a positive number")


@dataclass(frozen=True, eq=False)
class Slice:
    """The part of the vector with the numbers of one name."""

    name: str
    """As in `Free`, with an index for every [*]."""
    address: Address
    """The same as an address."""
    entries: slice
    """Their entries in the vector."""
    shape: tuple[int, ...]
    """Shape of the numbers, including the fixed ones."""
    scale: float
    """As in `Free`; of fields over the grid divided by the square root of a cell's area, so that the
    vector's inner product is the integral over the picture."""
    logarithm: bool
    """Whether the entries are logarithms."""
    mask: np.ndarray = field(repr=False)
    """True for numbers that may vary, others are fixed."""

    def packed(self, values: np.ndarray) -> np.ndarray:
        """The entries for these numbers."""
        values = values[self.mask]
        return (np.log(values) if self.logarithm else values) / self.scale

    def numbers(self, m: np.ndarray, fixed: np.ndarray) -> np.ndarray:
        """The numbers for the vector's entries, together with the fixed ones."""
        values, varying = np.array(fixed, dtype=np.float64), m[self.entries] * self.scale
        values[self.mask] = np.exp(varying) if self.logarithm else varying
        return values

    def pull_back(self, gradient: np.ndarray, values: np.ndarray) -> np.ndarray:
        """The gradient with respect to the entries, from that with respect to the numbers."""
        gradient = np.broadcast_to(gradient, self.shape)[self.mask] * self.scale
        return gradient * values[self.mask] if self.logarithm else gradient


class Variables:
    """The free numbers of a setup.

    Raises:
        ValueError: nothing is free, a name that does not exist or cannot vary (with those that can), a
            name twice, a mask of another shape, or a positive quantity that is 0.
    """

    def __init__(self, setup: Setup, free: Sequence[Free], grid: Grid):
        self.setup, self.grid = setup, grid
        self._known = known_names(setup)
        self.slices: list[Slice] = []
        at = 0
        if isinstance(free, Free) or not all(isinstance(wanted, Free) for wanted in free):
            raise TypeError("free: expected a list of Free(name, …)")
        for wanted in free:
            for name in self._matching(wanted.name):
                if any(name == other.name for other in self.slices):
                    raise ValueError(f"{name} is free twice")
                address = address_of(name)
                values, parts = self._values(address), wanted.parts
                mask = np.broadcast_to(True, values.shape) if parts is None else np.asarray(parts)
                if mask.dtype != bool:
                    raise ValueError(f"{name}: parts are a mask of True and False, not of {mask.dtype}")
                if mask.shape != values.shape:
                    raise ValueError(f"{name}: parts of shape {mask.shape}, expected {values.shape}")
                logarithm = address[-1] in POSITIVE
                if logarithm and not np.all(values[mask] > 0):
                    raise ValueError(f"{name} begins at 0: give it a positive value to vary")
                size, scale = int(mask.sum()), wanted.scale
                if values.ndim > 1 and values.shape[-2:] == (grid.ny, grid.nx):
                    scale /= math.sqrt(grid.hx * grid.hy)
                entries = slice(at, at + size)
                self.slices.append(Slice(name, address, entries, values.shape, scale, logarithm, mask))
                at += size
        self.size = at
        if not self.size:
            raise ValueError("nothing is free: name what may vary, such as Free('forces[0].vector')")

    size: int
    """Length of the vector."""

    def _matching(self, name: str) -> list[str]:
        """The names that match one with [*]."""
        pattern = re.escape(name).replace(re.escape("[*]"), r"\[\d+\]")
        found = [known for known in self._known if re.fullmatch(pattern, known)]
        if not found:
            raise ValueError(f"{name} cannot vary here; there is: {', '.join(self._known) or 'nothing'}")
        return found

    def has(self, address: Address) -> bool:
        """Whether any number at an address, or below it, is free."""
        return any(part.address[: len(address)] == address for part in self.slices)

    def _values(self, address: Address, setup: Setup | None = None) -> np.ndarray:
        """The numbers at an address, on the grid if they are painted."""
        value: Any = _follow(setup or self.setup, address)
        return np.array(value.sample(self.grid) if isinstance(value, Painted) else value, dtype=np.float64)

    def pack(self, setup: Setup | None = None) -> np.ndarray:
        """The vector for a setup, which differs from the first in free numbers only; by default for that."""
        return np.concatenate([part.packed(self._values(part.address, setup)) for part in self.slices])

    def unpack(self, m: np.ndarray) -> Setup:
        """The setup for a vector.

        Raises:
            ValueError: not `size` finite numbers, with the name of the first that is not; or numbers that a
                force or fluid refuses.
        """
        m = np.asarray(m, dtype=np.float64)
        if m.shape != (self.size,):
            raise ValueError(f"controls of shape {m.shape}: expected ({self.size},)")
        setup = self.setup
        for part in self.slices:
            if not np.all(np.isfinite(m[part.entries])):
                raise ValueError(f"controls: {part.name} is not finite")
            setup = _replaced(setup, part.address, part.numbers(m, self._values(part.address)))
        return setup

    def pull_back(self, gradients: Mapping[Address, np.ndarray], m: np.ndarray) -> np.ndarray:
        """The gradient with respect to the vector at m, from those with respect to the numbers."""
        out = np.zeros(self.size)
        for part in self.slices:
            values = part.numbers(m, self._values(part.address))
            out[part.entries] = part.pull_back(np.asarray(gradients.get(part.address, 0.0)), values)
        return out


def known_names(setup: Setup) -> list[str]:
    """The names of all numbers of a setup that can vary."""
    names = []
    for n, force in enumerate(setup.forces):
        names += [f"forces[{n}].{key}" for key in _slopes_of(force)]
    if isinstance(setup.fluid.viscosity, float | Painted):
        names.append(VISCOSITY)
    for d, density in enumerate(setup.fluid.densities):
        for n, source in enumerate(density.sources):
            names += [f"fluid.densities[{d}].sources[{n}].{key}" for key in _slopes_of(source)]
    return [*names, VELOCITY]


def address_of(name: str) -> Address:
    """The address for a name."""
    return tuple(int(word) if word.isdigit() else word for word in re.findall(r"\w+", name))


def _slopes_of(force: Any) -> list[str]:
    """Names of the numbers of a force or a source for which its `pull_back` gives gradients."""
    if isinstance(force, PaintedSource):
        return list(force.pull_back(0.0, 1.0, 0.0))
    if isinstance(force, FieldForce):
        return list(force.pull_back(0.0, 1.0, [0.0] * len(force.integrals(0.0, 1.0))))
    if isinstance(force, Buoyancy):
        return list(force.pull_back(0.0, 1.0, (0.0, 0.0)))
    return list(force.pull_back(0.0, 1.0, GaussianImpulse((0.0, 0.0), 0.0)))


def _follow(thing: Any, address: Address) -> Any:
    """What is at an address within a thing."""
    for key in address:
        thing = thing[key] if isinstance(key, int) else getattr(thing, key)
    return thing


def _replaced(thing: Any, address: Address, value: np.ndarray) -> Any:
    """A copy of a thing with another value at an address."""
    if not address:
        return _like(thing, value)
    key, rest = address[0], address[1:]
    if isinstance(key, int):
        return (*thing[:key], _replaced(thing[key], rest, value), *thing[key + 1 :])
    if isinstance(thing, type) or not is_dataclass(thing):
        raise TypeError(f"{type(thing).__name__} is no dataclass")
    return replace(thing, **{key: _replaced(getattr(thing, key), rest, value)})  # type: ignore[type-var]


def _like(old: Any, value: np.ndarray) -> Any:
    """A value as the type of the old one."""
    if isinstance(old, Painted):
        return Painted(value)
    if isinstance(old, np.ndarray):
        return value
    return (
        float(value) if value.ndim == 0 else tuple(map(tuple, value) if value.ndim > 1 else map(float, value))
    )
