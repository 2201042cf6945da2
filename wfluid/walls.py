"""Wall conditions, and the ghost values that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import warp as wp

from wfluid.kernels import ghosts
from wfluid.kernels.cells import HALO, Layout, Real


class Wall(Enum):
    """What the two edges of an axis do to the fluid."""

    FREE_SLIP = "free-slip"
    """Nothing flows through; the fluid slides along."""
    NO_SLIP = "no-slip"
    """Nothing flows through and the border stays where it is."""
    PERIODIC = "periodic"
    """What leaves on one side comes in on the other: for tileable pictures."""


class Rule(Enum):
    """How a field continues beyond the edges of one axis."""

    EVEN = "even"
    """Points half a cell inside; zero slope at the wall."""
    ODD = "odd"
    """Points half a cell inside; zero value at the wall."""
    FACE = "face"
    """Points on the wall, where the value is zero; odd beyond."""
    PERIODIC = "periodic"
    """The field of the other side."""


@dataclass(frozen=True)
class Walls:
    """The wall condition of each axis: `x` for the left and right edge, `y` for top and bottom."""

    x: Wall = Wall.FREE_SLIP
    y: Wall = Wall.FREE_SLIP

    @classmethod
    def parse(cls, text: str | Walls) -> Walls:
        """Read "free-slip", or one word for each axis: "periodic,no-slip".

        Raises:
            ValueError: a word that is no wall condition, or more than two words.
        """
        if isinstance(text, Walls):
            return text
        words = [word.strip() for word in text.split(",")]
        names = [wall.value for wall in Wall]
        if len(words) > 2 or any(word not in names for word in words):
            raise ValueError(f"walls {text!r}: expected {', '.join(names)}, or two of them as X,Y")
        return cls(Wall(words[0]), Wall(words[-1]))

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether x, and y, wrap."""
        return self.x is Wall.PERIODIC, self.y is Wall.PERIODIC

    def centre_rules(self) -> tuple[Rule, Rule]:
        """Of a scalar at cell centres along x and y: no flux through a wall."""
        return _scalar(self.x), _scalar(self.y)

    def u_rules(self) -> tuple[Rule, Rule]:
        """Of the velocity's x component, on x-faces."""
        return _normal(self.x, Rule.FACE), _tangential(self.y)

    def v_rules(self) -> tuple[Rule, Rule]:
        """Of the velocity's y component, on y-faces."""
        return _tangential(self.x), _normal(self.y, Rule.FACE)

    def moved_x_rules(self) -> tuple[Rule, Rule]:
        """Of a displacement's x component at centres: it moves along walls as the velocity does."""
        return _normal(self.x, Rule.ODD), _tangential(self.y)

    def moved_y_rules(self) -> tuple[Rule, Rule]:
        """Of a displacement's y component at centres."""
        return _tangential(self.x), _normal(self.y, Rule.ODD)


def _scalar(wall: Wall) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else Rule.EVEN


def _normal(wall: Wall, closed: Rule) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else closed


def _tangential(wall: Wall) -> Rule:
    return {Wall.FREE_SLIP: Rule.EVEN, Wall.NO_SLIP: Rule.ODD, Wall.PERIODIC: Rule.PERIODIC}[wall]


def ghost_table(n: int, rule: Rule) -> tuple[np.ndarray, np.ndarray]:
    """Source index 0 … n-1 and sign of each padded position -2 … n+1 of an axis of n cells."""
    i = np.arange(-HALO, n + HALO)
    if rule is Rule.PERIODIC:
        return i % n, np.ones(len(i))
    if rule is Rule.FACE:  # reflect about the points 0 and n, where the value is zero
        folded = i % (2 * n)
        source = np.where(folded <= n, folded, 2 * n - folded)
        sign = np.where(folded % n == 0, 0.0, np.where(folded < n, 1.0, -1.0))
        return np.where(sign == 0, min(1, n - 1), source), sign
    folded = i % (2 * n)  # reflect about the walls, half a cell outside 0 and n - 1
    inside = folded < n
    sign = np.where(inside, 1.0, -1.0 if rule is Rule.ODD else 1.0)
    return np.where(inside, folded, 2 * n - 1 - folded), sign


class Ghosts:
    """Fills the ghosts of fields of one layout under one rule per axis."""

    def __init__(self, layout: Layout, rules: tuple[Rule, Rule], device: wp.Device):
        self.layout = layout
        self.device = device
        self._tables = []
        for n, rule in zip((layout.nx, layout.ny), rules, strict=True):
            source, sign = ghost_table(n, rule)
            self._tables += [
                wp.array(source + HALO, dtype=wp.int32, device=device),
                wp.array(sign, dtype=Real, device=device),
            ]

    def fill(self, f: wp.array) -> None:
        """Give the ghosts of f, and its faces on a wall, their values, in place."""
        layout = self.layout
        ghosts.fill.launch(
            layout.ny + layout.nx + 2 * HALO,
            self.device,
            inputs=[*self._tables, layout.nx, layout.ny, layout.pitch],
            outputs=[f],
        )

    def fold(self, f_bar: wp.array) -> None:
        """The transpose of `fill`: gradients with respect to ghosts go to what they are copies of, in place.

        The ghosts, and the faces on a wall, come out as 0.
        """
        layout, (columns, rows) = self.layout, (self._tables[:2], self._tables[2:])
        inputs = [*rows, layout.ny, layout.pitch]
        ghosts.fold_columns.launch(layout.nx + 2 * HALO, self.device, inputs, [f_bar])
        inputs = [*columns, layout.nx, layout.pitch]
        ghosts.fold_rows.launch(layout.ny, self.device, inputs, [f_bar])
