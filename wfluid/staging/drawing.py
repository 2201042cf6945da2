"""Forces as a person draws them on the picture, in pixels and seconds: tables of `scene_format.FORCES`.

What is drawn is how far something would be carried by that force alone: the centre by the arrow of a
push, a turn of a vortex's centre, the typical way of noise. Pressure takes half of a Gaussian push (in
two dimensions the divergence-free part of exp(-r^2/2s^2) e has at r = 0 half its strength, whatever s),
so it is twice what a free particle would need; viscosity and walls then shorten the way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wfluid.domain.envelopes import Arbitrary, Constant, Envelope, Fade, Oscillator, product
from wfluid.domain.paths import Center, Path
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import GaussianForce, Growth, VortexForce
from wfluid.model.image_force import DEFAULT_RADIUS as DEFAULT_BLUR
from wfluid.model.image_force import ImageForce
from wfluid.model.noise_force import NoiseForce
from wfluid.model.painted import Freeze, Painted
from wfluid.model.stroke import Stroke
from wfluid.model.uniform_forces import Buoyancy, Wind
from wfluid.pictures.picture import resample
from wfluid.staging.images import SceneImages, named
from wfluid.staging.timing import envelope_and_scale, time_window

DEFAULT_RADIUS = 0.06
"""Radius of a force that names none [longer side]."""

DEFAULT_SCALE = 0.2
"""Mean wavelength of noise that names none [longer side]."""

DEFAULT_LENGTH = 0.02
"""How far a painted force carries its strongest place where it does not say it [longer side]."""

_PRESSURE = 2.0


@dataclass(frozen=True)
class Drawing:
    """What the numbers of drawn forces refer to.

    Drawing(1024, 768, duration=2.0).force({"kind": "push", "center": [621, 451], "by": [22, 15]})
    """

    width: int
    """Of the frame that pixels refer to."""
    height: int
    """Of the frame that pixels refer to."""
    duration: float
    """Of the animation [s]."""
    scheme: str = "standard"
    """The fluid's; the paper's oscillators begin as a sine."""
    loop: str | None = None
    """The animation's; in an oscillating loop forces go on through its end."""
    envelopes: Mapping[str, Envelope] = field(default_factory=dict)
    """Envelopes that forces speak of, by name."""
    weight: Painted | None = None
    """Where forces act that name no mask."""
    frozen: Freeze | None = None
    """What stays where it is: no growth acts there."""
    paintings: SceneImages | None = None
    """Reads the pictures that forces name."""

    @property
    def side(self) -> float:
        """The frame's longer side [px]."""
        return max(self.width, self.height)

    def force(self, table: Mapping[str, Any]) -> Force:
        """The force that a table draws.

        Raises:
            ValueError: a place outside the picture, a window outside the animation, keys that contradict.
        """
        make = {
            "push": self._push,
            "vortex": self._vortex,
            "grow": self._grow,
            "stroke": self._stroke,
            "wind": self._wind,
            "noise": self._noise,
            "image": self._image,
            "buoyancy": self._buoyancy,
        }[table["kind"]]
        return make(table)

    def center(self, what: str, table: Mapping[str, Any]) -> Center:
        """Where a spot is [longer side].

        Raises:
            ValueError: neither a center nor a path, both, or a place outside the picture.
        """
        if ("center" in table) == ("path" in table):
            raise ValueError(f"{what}: expected either center or path")
        if "center" in table:
            return self.place(what, table["center"])
        return self._path(what, table["path"])

    def place(self, what: str, at: list[float]) -> tuple[float, float]:
        """A place [longer side] from pixels.

        Raises:
            ValueError: outside the picture.
        """
        if not (0 <= at[0] <= self.width and 0 <= at[1] <= self.height):
            raise ValueError(
                f"{what} at {at[0]:g},{at[1]:g}: outside the picture of {self.width} x {self.height} pixels"
            )
        return at[0] / self.side, at[1] / self.side

    def radius(self, table: Mapping[str, Any]) -> float:
        """The radius of a spot [longer side]."""
        return table["radius"] / self.side if "radius" in table else DEFAULT_RADIUS

    def envelope_and_scale(self, what: str, table: Mapping[str, Any]) -> tuple[Envelope, float]:
        """The envelope, with those it names and its strength, and what carries a free particle by one."""
        envelope, per_length = envelope_and_scale(what, table, self.duration, self.scheme, self.loop)
        return self.modulated(what, envelope, table), per_length

    def modulated(self, what: str, envelope: Envelope, table: Mapping[str, Any]) -> Envelope:
        """The envelope times those that a table names, and its strength.

        Raises:
            ValueError: an envelope that does not exist.
        """
        return product(table.get("strength", 1.0), envelope, *self.named(what, table.get("envelope", ())))

    def named(self, what: str, names: list[str]) -> list[Envelope]:
        """The envelopes of these names.

        Raises:
            ValueError: one that does not exist, with those that do.
        """
        for name in names:
            if name not in self.envelopes:
                there = ", ".join(self.envelopes) or "none"
                raise ValueError(f"{what}: there is no envelope {name!r}; there is {there}")
        return [self.envelopes[name] for name in names]

    def _vector(self, by: list[float], factor: float) -> tuple[float, float]:
        return by[0] * factor / self.side, by[1] * factor / self.side

    def _mask(self, table: Mapping[str, Any]) -> Painted | None:
        return self.paintings.mask(table["mask"]) if "mask" in table else self.weight

    def _path(self, what: str, rows: list[list[float]]) -> Path:
        return Path([row[0] for row in rows], [self.place(what, row[1:]) for row in rows])

    def _push(self, table: Mapping[str, Any]) -> GaussianForce:
        envelope, per_length = self.envelope_and_scale("push", table)
        vector = self._vector(table["by"], _PRESSURE * per_length)
        return GaussianForce(
            self.center("push", table), vector, self.radius(table), envelope, self._mask(table)
        )

    def _vortex(self, table: Mapping[str, Any]) -> VortexForce:
        envelope, per_length = self.envelope_and_scale("vortex", table)
        spin = math.radians(table["turn"]) * per_length
        return VortexForce(
            self.center("vortex", table), spin, self.radius(table), envelope, self._mask(table)
        )

    def _grow(self, table: Mapping[str, Any]) -> Growth:
        """Twice the logarithm of the factor is the area's; a rate, not an acceleration, takes it there."""
        area, center = 2 * math.log(table["factor"]), self.center("grow", table)
        if "period" in table:
            table = {"phase": 0.25, **table}  # the cosine of the rate is the sine of the growth
        envelope, _ = envelope_and_scale("grow", table, self.duration, self.scheme, self.loop)
        if "period" in table:
            period, phase = table["period"], table["phase"]
            start, end = time_window("grow", table, self.duration)
            wave = Oscillator(period=period, phase=phase, start=start, end=end, centred=False)
            rate, envelope = area * 2 * math.pi / period, wave * _fade(table, start, end)
        else:
            rate = area / envelope.integral(0.0, self.duration)
        envelope = self.modulated("grow", envelope, table)
        return Growth(center, rate, self.radius(table), envelope, self._unfrozen(self._mask(table)))

    def _unfrozen(self, weight: Painted | None) -> Painted | None:
        """A weight without what is frozen."""
        if self.frozen is None:
            return weight
        free = 1.0 - self.frozen.paint.values
        if weight is None:
            return Painted(free)
        height, width = weight.values.shape
        return Painted(weight.values * resample(free.astype(np.float32), width, height).clip(0, 1))

    def _stroke(self, table: Mapping[str, Any]) -> Stroke:
        if ("points" in table) == ("path" in table):
            raise ValueError("stroke: expected either points or path")
        if "path" in table:
            if table.keys() & {"start", "end"}:
                raise ValueError("stroke: a path has its own times; it goes without start and end")
            path = self._path("stroke", table["path"])
            if path.times[0] >= self.duration:
                raise ValueError(f"stroke: its path begins at {path.times[0]:g} s, after the animation")
        else:
            points = [self.place("stroke", at) for at in table["points"]]
            path = Path.along(points, *time_window("stroke", table, self.duration))
        envelope = self.modulated("stroke", Constant(), {**table, "strength": 1.0})
        return Stroke(path, self.radius(table), table.get("strength", 1.0), envelope, self._mask(table))

    def _wind(self, table: Mapping[str, Any]) -> Wind:
        envelope, per_length = self.envelope_and_scale("wind", table)
        return Wind(self._vector(table["by"], per_length), envelope, self._mask(table))

    def _noise(self, table: Mapping[str, Any]) -> NoiseForce:
        envelope, per_length = self.envelope_and_scale("noise", table)
        return NoiseForce(
            strength=table["amount"] / self.side * per_length,
            scale=table["scale"] / self.side if "scale" in table else DEFAULT_SCALE,
            seed=table.get("seed", 0),
            period=table.get("change"),
            envelope=envelope,
            weight=self._mask(table),
        )

    def _image(self, table: Mapping[str, Any]) -> ImageForce:
        name, kind, paintings = table["file"], table.get("along", "gradient"), self.paintings
        weight = self._mask(table)
        envelope, per_length = self.envelope_and_scale(f"force image {name}", table)
        length = table["amount"] / self.side if "amount" in table else DEFAULT_LENGTH
        radius = table["radius"] / self.side if "radius" in table else DEFAULT_BLUR
        read = paintings.read if kind == "vectors" else paintings.paint
        force = named(
            name,
            lambda: ImageForce(read(name), kind, length * per_length, envelope, weight, radius),
        )
        if kind == "gradient" and weight is None:
            paintings.note(
                f"{name}: the pressure balances a gradient wholly, so alone it moves nothing; "
                "use along=contour, or give it a mask"
            )
        return force

    def _buoyancy(self, table: Mapping[str, Any]) -> Buoyancy:
        envelope, per_length = self.envelope_and_scale("buoyancy", table)
        return Buoyancy(table["density"], self._vector(table["by"], per_length), envelope)

    def envelope(self, what: str, table: Mapping[str, Any]) -> Envelope:
        """The envelope that a table of `scene_format.ENVELOPES` says.

        Raises:
            ValueError: values that contradict.
        """
        kind = table["kind"]
        if kind == "samples":
            return Arbitrary(times=table["times"], values=table["values"])
        start, end = table.get("start", 0.0), table.get("end", math.inf)
        if kind == "constant":
            return Constant(start, end)
        if kind == "fade":
            return _fade(table, start, table.get("end", self.duration))
        phase = table.get("phase", 0.5 if self.loop == "oscillate" else 0.25)
        return Oscillator(period=table["period"], phase=phase, start=start, end=end, centred=False)


def _fade(table: Mapping[str, Any], start: float, end: float) -> Fade:
    return Fade(table.get("rise", 0.0), table.get("fall", 0.0), start, end)
