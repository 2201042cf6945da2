"""Wall conditions, and the ghost values that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from wfluid.domain.limits import WALLS


class Wall(Enum):
    """What the two edges of an axis do to the fluid."""

    FREE_SLIP = WALLS[0]
    """Nothing flows through; the fluid slides along."""
    NO_SLIP = WALLS[1]
    """Nothing flows through and the border stays where it is."""
    PERIODIC = WALLS[2]
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

    def displacement_x_rules(self) -> tuple[Rule, Rule]:
        """Of a displacement's x component at centres: it moves along walls as the velocity does."""
        return _normal(self.x, Rule.ODD), _tangential(self.y)

    def displacement_y_rules(self) -> tuple[Rule, Rule]:
        """Of a displacement's y component at centres."""
        return _tangential(self.x), _normal(self.y, Rule.ODD)


def _scalar(wall: Wall) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else Rule.EVEN


def _normal(wall: Wall, closed: Rule) -> Rule:
    return Rule.PERIODIC if wall is Wall.PERIODIC else closed


def _tangential(wall: Wall) -> Rule:
    return {Wall.FREE_SLIP: Rule.EVEN, Wall.NO_SLIP: Rule.ODD, Wall.PERIODIC: Rule.PERIODIC}[wall]
