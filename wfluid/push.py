"""Pushes: forces as a person draws them, an arrow on the picture.

`X,Y:DX,DY[:key=value,…]` in pixels of the picture. The arrow is how far its centre would be carried by
that force alone: a constant force by the end of its window, a blow (`at`) by the end of the animation,
an oscillator to either side. Pressure takes half of a Gaussian force (in two dimensions the
divergence-free part of exp(-r^2/2s^2) e has at r = 0 half its strength, whatever s), so the force is
twice what a free particle would need; viscosity and walls then shorten the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from wfluid.envelopes import Constant, Envelope, Instantaneous, Oscillator
from wfluid.forces import GaussianForce
from wfluid.painted import Painted

KEYS = ("radius", "period", "phase", "start", "end", "at", "strength")

DEFAULT_RADIUS = 0.06
"""Radius of a push that names none [longer side]."""

LEAST_TIME = 0.001
"""Shortest period or window of a push [s]; a blow (`at`) has none."""

_PRESSURE = 2.0


@dataclass(frozen=True)
class Push:
    """An arrow on the picture and its options."""

    x: float
    """Start of the arrow [px]."""
    y: float
    """Start of the arrow [px]."""
    dx: float
    """Its length to the right [px]."""
    dy: float
    """Its length downwards [px]."""
    options: dict[str, float]
    """What follows the second colon, by `KEYS`."""

    @classmethod
    def parse(cls, text: str) -> Push:
        """Read "X,Y:DX,DY[:key=value,…]".

        Raises:
            ValueError: naming the part that is wrong.
        """
        parts = text.split(":")
        if len(parts) not in (2, 3):
            raise ValueError(f"push {text!r}: expected X,Y:DX,DY or X,Y:DX,DY:key=value,…")
        what = f"push {text!r}"
        x, y = _pair(what, "the point X,Y", parts[0])
        dx, dy = _pair(what, "the arrow DX,DY", parts[1])
        options = parse_options(what, parts[2], KEYS) if len(parts) == 3 else {}
        if options.get("radius", 1.0) <= 0:
            raise ValueError(f"{what}: radius {options['radius']:g} is not positive")
        return cls(x, y, dx, dy, options)

    def force(
        self,
        width: int,
        height: int,
        duration: float,
        scheme: str = "standard",
        weight: Painted | None = None,
    ) -> GaussianForce:
        """The force for a picture of width x height pixels and an animation of `duration` seconds.

        Raises:
            ValueError: the point lies outside the picture, or the window outside the animation.
        """
        if not (0 <= self.x <= width and 0 <= self.y <= height):
            raise ValueError(
                f"push at {self.x:g},{self.y:g}: outside the picture of {width} x {height} pixels"
            )
        envelope, per_length = course("push", self.options, duration, scheme)
        side = max(width, height)
        factor = _PRESSURE * per_length * self.options.get("strength", 1.0) / side
        radius = self.options.get("radius", DEFAULT_RADIUS * side) / side
        return GaussianForce(
            (self.x / side, self.y / side), (self.dx * factor, self.dy * factor), radius, envelope, weight
        )


def course(
    what: str, given: dict[str, float], duration: float, scheme: str = "standard"
) -> tuple[Envelope, float]:
    """The envelope that options say, and the acceleration (or velocity) that carries a free particle by one.

    Raises:
        ValueError: a window outside the animation.
    """
    at = given.get("at")
    if at is not None:
        if at >= duration:
            raise ValueError(f"{what} at={at:g}: the animation lasts {duration:g} s")
        return Instantaneous(at), 1.0 / (duration - at)
    start, end = given.get("start", 0.0), given.get("end", duration)
    if end - start < LEAST_TIME and start < duration:
        raise ValueError(
            f"{what} from {start:g} to {end:g} s: expected {LEAST_TIME} s or more; at= is a blow"
        )
    if start >= duration:
        raise ValueError(f"{what} start={start:g}: the animation lasts {duration:g} s")
    if "period" not in given:
        return Constant(start, end), 2.0 / (end - start) ** 2
    paper = scheme == "paper"
    phase = given.get("phase", 0.0 if paper else 0.25)
    centred = not paper and math.isclose(phase % 0.5, 0.25)
    period = given["period"]
    envelope = Oscillator(period=period, phase=phase, start=start, end=end, centred=centred)
    return envelope, (2 * math.pi / period) ** 2


def parse_options(what: str, text: str, keys: tuple[str, ...], words: tuple[str, ...] = ()) -> dict:
    """Read "key=value,…"; the values of `words` stay text, the others are numbers.

    Raises:
        ValueError: an unknown key, one given twice, a value that is no number, or times that contradict.
    """
    options: dict = {}
    for item in text.split(","):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or key not in keys:
            raise ValueError(f"{what}: {item!r} is not key=value with a key of {', '.join(keys)}")
        if key in options:
            raise ValueError(f"{what}: {key} is given twice")
        options[key] = value if key in words else _number(what, key, value)
    _check_course(what, options)
    return options


def _check_course(what: str, given: dict[str, float]) -> None:
    if "at" in given and given.keys() & {"period", "phase", "start", "end"}:
        raise ValueError(f"{what}: at= is one blow; it goes without period, phase, start and end")
    if "phase" in given and "period" not in given:
        raise ValueError(f"{what}: phase= needs period=")
    if given.get("period", 1.0) < LEAST_TIME:
        raise ValueError(f"{what}: period {given['period']:g}: expected {LEAST_TIME} s or more")
    for key in ("start", "at"):
        if given.get(key, 0) < 0:
            raise ValueError(f"{what}: {key} {given[key]:g} is before the animation")
    if "end" in given and given["end"] <= given.get("start", 0.0):
        raise ValueError(f"{what}: end {given['end']:g} is not after start {given.get('start', 0):g}")


def _pair(what: str, name: str, part: str) -> tuple[float, float]:
    numbers = part.split(",")
    if len(numbers) != 2:
        raise ValueError(f"{what}: {name} needs two numbers, got {part!r}")
    return _number(what, name, numbers[0]), _number(what, name, numbers[1])


def _number(what: str, name: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        raise ValueError(f"{what}: {name}: {part!r} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{what}: {name}: {part} is not finite")
    return value
