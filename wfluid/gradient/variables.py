"""The numbers that may vary, as one flat vector: named slices, scaled, packed and unpacked in one place."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from typing import Any

import numpy as np

from wfluid.domain.grid import Grid
from wfluid.model.densities import PaintedSource
from wfluid.model.fluid import Fluid
from wfluid.model.force import FieldForce, Force, GaussianImpulse
from wfluid.model.painted import Painted
from wfluid.model.uniform_forces import Buoyancy

POSITIVE = ("radius", "period", "viscosity")
"""Numbers that must stay positive: it is their logarithms that vary, so no bounds are needed."""

VELOCITY, VISCOSITY = "velocity", "fluid.viscosity"


@dataclass(frozen=True)
class Setup:
    """What is simulated: a fluid, the forces on it, and the velocity it begins with."""

    fluid: Fluid
    """What the picture is made of."""
    forces: tuple[Force, ...]
    """What moves it; groups are their forces."""
    velocity: np.ndarray
    """Velocity at the beginning [longer side/s], (2, ny, nx): u on the first nx x-faces, v on the first
    ny y-faces. On walls it is 0, whatever is here."""

    def number(self, name: str) -> object:
        """What is under a name, such as "forces[0].vector"."""
        return _follow(self, _path(name))


@dataclass(frozen=True)
class Free:
    """Numbers of a `Setup` that may vary.

    Raises:
        ValueError: a scale that is not positive and finite.
    """

    name: str
    """Where they are: "forces[0].vector", "forces[*].center", "forces[2].envelope.values",
    "fluid.viscosity", "fluid.densities[0].sources[1].rate", "velocity"."""
    scale: float = 1.0
    """What a change of one of the variable stands for: in the quantity's own unit; for radii, periods and
    viscosities in their logarithm."""
    parts: Sequence[bool] | np.ndarray | None = None
    """Which of several numbers may vary, as a mask of their shape; all by default."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale of {self.name}: {self.scale} is not a positive number")


@dataclass(frozen=True, eq=False)
class Slice:
    """Where the numbers of one name are in the vector."""

    name: str
    """As in `Free`, with every [*] filled in."""
    entries: slice
    """Of the vector."""
    shape: tuple[int, ...]
    """Of the numbers, those that are fixed included."""
    scale: float
    """As in `Free`; of fields over the grid divided by the square root of a cell's area, so that the
    vector's inner product is the integral over the picture."""
    logarithm: bool
    """Whether it is the logarithms that vary."""
    mask: np.ndarray = field(repr=False)
    """Which of them may vary."""

    def variable(self, values: np.ndarray) -> np.ndarray:
        """The entries that stand for these numbers."""
        values = values[self.mask]
        return (np.log(values) if self.logarithm else values) / self.scale

    def numbers(self, m: np.ndarray, fixed: np.ndarray) -> np.ndarray:
        """The numbers that the vector's entries stand for, with the fixed ones."""
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
        if isinstance(free, Free) or not all(isinstance(one, Free) for one in free):
            raise TypeError("free: expected a list of Free(name, …)")
        for one in free:
            for name in self._matching(one.name):
                if any(name == other.name for other in self.slices):
                    raise ValueError(f"{name} is free twice")
                values = self._get(name)
                mask = np.broadcast_to(True, values.shape) if one.parts is None else np.asarray(one.parts)
                if mask.dtype != bool:
                    raise ValueError(f"{name}: parts are a mask of True and False, not of {mask.dtype}")
                if mask.shape != values.shape:
                    raise ValueError(f"{name}: parts of shape {mask.shape}, expected {values.shape}")
                logarithm = name.rpartition(".")[2] in POSITIVE
                if logarithm and not np.all(values[mask] > 0):
                    raise ValueError(f"{name} begins at 0: give it a positive value to vary")
                size, scale = int(mask.sum()), one.scale
                if values.ndim > 1 and values.shape[-2:] == (grid.ny, grid.nx):
                    scale /= math.sqrt(grid.hx * grid.hy)
                entries = slice(at, at + size)
                self.slices.append(Slice(name, entries, values.shape, scale, logarithm, mask))
                at += size
        self.size = at
        if not self.size:
            raise ValueError("nothing is free: name what may vary, such as Free('forces[0].vector')")

    size: int
    """Length of the vector."""

    def _matching(self, name: str) -> list[str]:
        pattern = re.escape(name).replace(re.escape("[*]"), r"\[\d+\]")
        found = [known for known in self._known if re.fullmatch(pattern, known)]
        if not found:
            raise ValueError(f"{name} cannot vary here; there is: {', '.join(self._known) or 'nothing'}")
        return found

    def has(self, name: str) -> bool:
        """Whether a name, or one that begins with it, is free."""
        return any(one.name == name or one.name.startswith((f"{name}.", f"{name}[")) for one in self.slices)

    def _get(self, name: str, setup: Setup | None = None) -> np.ndarray:
        value = (setup or self.setup).number(name)
        return np.array(value.sample(self.grid) if isinstance(value, Painted) else value, dtype=np.float64)

    def pack(self, setup: Setup | None = None) -> np.ndarray:
        """The vector of a setup, which differs from the first in free numbers only; by default of that."""
        return np.concatenate([one.variable(self._get(one.name, setup)) for one in self.slices])

    def unpack(self, m: np.ndarray) -> Setup:
        """The setup that a vector stands for.

        Raises:
            ValueError: not `size` finite numbers, with the name of the first that is not; or numbers that a
                force or fluid refuses.
        """
        m = np.asarray(m, dtype=np.float64)
        if m.shape != (self.size,):
            raise ValueError(f"controls of shape {m.shape}: expected ({self.size},)")
        setup = self.setup
        for one in self.slices:
            if not np.all(np.isfinite(m[one.entries])):
                raise ValueError(f"controls: {one.name} is not finite")
            setup = _replaced(setup, _path(one.name), one.numbers(m, self._get(one.name)))
        return setup

    def pull_back(self, gradients: Mapping[str, np.ndarray], m: np.ndarray) -> np.ndarray:
        """The gradient with respect to the vector at m, from those with respect to the numbers, by name."""
        out = np.zeros(self.size)
        for one in self.slices:
            values = one.numbers(m, self._get(one.name))
            out[one.entries] = one.pull_back(np.asarray(gradients.get(one.name, 0.0)), values)
        return out


def known_names(setup: Setup) -> list[str]:
    """Everything of a setup that can vary."""
    names = []
    for n, force in enumerate(setup.forces):
        names += [f"forces[{n}].{key}" for key in _slopes_of(force)]
    if isinstance(setup.fluid.viscosity, float | Painted):
        names.append(VISCOSITY)
    for d, density in enumerate(setup.fluid.densities):
        for n, source in enumerate(density.sources):
            names += [f"fluid.densities[{d}].sources[{n}].{key}" for key in _slopes_of(source)]
    return [*names, VELOCITY]


def _slopes_of(what: Any) -> list[str]:
    """Names of the numbers that a force or a source has slopes with."""
    if isinstance(what, PaintedSource):
        return list(what.pull_back(0.0, 1.0, 0.0))
    if isinstance(what, FieldForce):
        return list(what.pull_back(0.0, 1.0, [0.0] * len(what.integrals(0.0, 1.0))))
    if isinstance(what, Buoyancy):
        return list(what.pull_back(0.0, 1.0, (0.0, 0.0)))
    return list(what.pull_back(0.0, 1.0, GaussianImpulse((0.0, 0.0), 0.0)))


def _path(name: str) -> list[str | int]:
    """The steps from a setup to a number: attributes and indices."""
    return [int(word) if word.isdigit() else word for word in re.findall(r"\w+", name)]


def _follow(thing: Any, path: Sequence[str | int]) -> Any:
    for step in path:
        thing = thing[step] if isinstance(step, int) else getattr(thing, step)
    return thing


def _replaced(thing: Any, path: Sequence[str | int], value: np.ndarray) -> Any:
    """The same with another value at the end of the path."""
    if not path:
        return _like(thing, value)
    step, rest = path[0], path[1:]
    if isinstance(step, int):
        return (*thing[:step], _replaced(thing[step], rest, value), *thing[step + 1 :])
    if not is_dataclass(thing):
        raise TypeError(f"{type(thing).__name__} is no dataclass")
    return replace(thing, **{step: _replaced(getattr(thing, step), rest, value)})


def _like(old: Any, value: np.ndarray) -> Any:
    """A value in the form of the old one."""
    if isinstance(old, Painted):
        return Painted(value)
    if isinstance(old, np.ndarray):
        return value
    return (
        float(value) if value.ndim == 0 else tuple(map(tuple, value) if value.ndim > 1 else map(float, value))
    )
