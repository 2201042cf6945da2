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

from wfluid.forces import Constant, Envelope, GaussianForce, Instantaneous, Oscillator

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
        x, y = _pair(text, "the point X,Y", parts[0])
        dx, dy = _pair(text, "the arrow DX,DY", parts[1])
        options = {}
        for item in parts[2].split(",") if len(parts) == 3 else ():
            key, equals, value = item.partition("=")
            if not equals or key.strip() not in KEYS:
                raise ValueError(f"push {text!r}: {item!r} is not key=value with a key of {', '.join(KEYS)}")
            if key.strip() in options:
                raise ValueError(f"push {text!r}: {key.strip()} is given twice")
            options[key.strip()] = _number(text, key.strip(), value)
        push = cls(x, y, dx, dy, options)
        push._check(text)
        return push

    def _check(self, text: str) -> None:
        given = self.options
        if "at" in given and given.keys() & {"period", "phase", "start", "end"}:
            raise ValueError(f"push {text!r}: at= is one blow; it goes with radius and strength only")
        if "phase" in given and "period" not in given:
            raise ValueError(f"push {text!r}: phase= needs period=")
        if given.get("radius", 1.0) <= 0:
            raise ValueError(f"push {text!r}: radius {given['radius']:g} is not positive")
        if given.get("period", 1.0) < LEAST_TIME:
            raise ValueError(f"push {text!r}: period {given['period']:g}: expected {LEAST_TIME} s or more")
        for key in ("start", "at"):
            if given.get(key, 0) < 0:
                raise ValueError(f"push {text!r}: {key} {given[key]:g} is before the animation")
        if "end" in given and given["end"] <= given.get("start", 0.0):
            raise ValueError(
                f"push {text!r}: end {given['end']:g} is not after start {given.get('start', 0):g}"
            )

    def force(self, width: int, height: int, duration: float, scheme: str = "standard") -> GaussianForce:
        """The force for a picture of width x height pixels and an animation of `duration` seconds.

        Raises:
            ValueError: the point lies outside the picture, or the window outside the animation.
        """
        if not (0 <= self.x <= width and 0 <= self.y <= height):
            raise ValueError(
                f"push at {self.x:g},{self.y:g}: outside the picture of {width} x {height} pixels"
            )
        envelope, per_length = self._course(duration, scheme)
        side = max(width, height)
        factor = _PRESSURE * per_length * self.options.get("strength", 1.0) / side
        radius = self.options.get("radius", DEFAULT_RADIUS * side) / side
        return GaussianForce(
            (self.x / side, self.y / side), (self.dx * factor, self.dy * factor), radius, envelope
        )

    def _course(self, duration: float, scheme: str) -> tuple[Envelope, float]:
        """The envelope, and the acceleration (or velocity) that carries a free particle by one."""
        given = self.options
        at = given.get("at")
        if at is not None:
            if at >= duration:
                raise ValueError(f"push at={at:g}: the animation lasts {duration:g} s")
            return Instantaneous(at), 1.0 / (duration - at)
        start, end = given.get("start", 0.0), given.get("end", duration)
        if end - start < LEAST_TIME and start < duration:
            raise ValueError(
                f"push from {start:g} to {end:g} s: expected {LEAST_TIME} s or more; at= is a blow"
            )
        if start >= duration:
            raise ValueError(f"push start={start:g}: the animation lasts {duration:g} s")
        if "period" not in given:
            return Constant(start, end), 2.0 / (end - start) ** 2
        paper = scheme == "paper"
        phase = given.get("phase", 0.0 if paper else 0.25)
        centred = not paper and math.isclose(phase % 0.5, 0.25)
        period = given["period"]
        envelope = Oscillator(period=period, phase=phase, start=start, end=end, centred=centred)
        return envelope, (2 * math.pi / period) ** 2


def _pair(text: str, what: str, part: str) -> tuple[float, float]:
    numbers = part.split(",")
    if len(numbers) != 2:
        raise ValueError(f"push {text!r}: {what} needs two numbers, got {part!r}")
    return _number(text, what, numbers[0]), _number(text, what, numbers[1])


def _number(text: str, what: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        raise ValueError(f"push {text!r}: {what}: {part!r} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"push {text!r}: {what}: {part} is not finite")
    return value
