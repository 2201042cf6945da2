"""Boundary conditions at the walls, and the rules for ghost values that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from wfluid.domain.limits import WALLS


class Wall(Enum):
    """Boundary condition at both edges of an axis."""

    FREE_SLIP = WALLS[0]
    """No flow through the wall; the fluid slides along it without friction."""
    NO_SLIP = WALLS[1]
    """No velocity at the wall, so that the border of the picture stays in place."""
    PERIODIC = WALLS[2]
    """The two edges are joined, for tileable pictures."""


class Rule(Enum):
    """Continuation of a field beyond the edges of an axis, which gives its ghost values."""

    EVEN = "even"
    """Even reflection of points half a cell inside: zero slope at the wall."""
    ODD = "odd"
    """Odd reflection of points half a cell inside: zero value at the wall."""
    FACE = "face"
    """Odd reflection of points on the wall, where the value is zero."""
    PERIODIC = "periodic"
    """The values of the opposite side."""


@dataclass(frozen=True)
class Walls:
    """The boundary condition of each axis: `x` for the left and right edge, `y` for top and bottom."""

    x: Wall = Wall.FREE_SLIP
    y: Wall = Wall.FREE_SLIP

    @classmethod
    def parse(cls, text: str | Walls) -> Walls:
        """The walls from one condition for both axes, "free-slip", or one for each, "periodic,no-slip".

        Raises:
            ValueError: an unknown condition, or more than two.
            TypeError: neither walls nor a text.
        """
        if isinstance(text, Walls):
            return text
        if not isinstance(text, str):
            raise TypeError(f"walls {text!r}: expected Walls, or a text such as {WALLS[0]!r}")
        words = [word.strip() for word in text.split(",")]
        names = [wall.value for wall in Wall]
        if len(words) > 2 or any(word not in names for word in words):
            raise ValueError(f"walls {text!r}: expected {', '.join(names)}, or two of them as X,Y")
        return cls(Wall(words[0]), Wall(words[-1]))

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether the x axis, and the y axis, is periodic."""
        return self.x is Wall.PERIODIC, self.y is Wall.PERIODIC

    def centre_rules(self) -> tuple[Rule, Rule]:
        """Rules along x and y for a scalar at centres: no flux through a wall."""
        return _scalar(self.x), _scalar(self.y)

    def u_rules(self) -> tuple[Rule, Rule]:
        """Rules along x and y for the x component of the velocity, on x-faces."""
        return _normal(self.x, Rule.FACE), _tangential(self.y)

    def v_rules(self) -> tuple[Rule, Rule]:
        """Rules along x and y for the y component of the velocity, on y-faces."""
        return _tangential(self.x), _normal(self.y, Rule.FACE)

    def displacement_x_rules(self) -> tuple[Rule, Rule]:
        """Rules along x and y for the x component of a displacement, at centres: as for the velocity."""
        return _normal(self.x, Rule.ODD), _tangential(self.y)

    def displacement_y_rules(self) -> tuple[Rule, Rule]:
        """Rules along x and y for the y component of a displacement, at centres: as for the velocity."""
        return _tangential(self.x), _normal(self.y, Rule.ODD)


def _scalar(wall: Wall) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else Rule.EVEN


def _normal(wall: Wall, closed: Rule) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else closed


def _tangential(wall: Wall) -> Rule:
    return {Wall.FREE_SLIP: Rule.EVEN, Wall.NO_SLIP: Rule.ODD, Wall.PERIODIC: Rule.PERIODIC}[wall]
