"""Forces as a person draws them on the picture, in pixels and seconds: tables of `scene.forces`.

What is drawn is how far something would be carried by that force alone: the centre by the arrow of a
push, a turn of a vortex's centre, the typical way of noise. Pressure takes half of a Gaussian push (in
two dimensions the divergence-free part of exp(-r^2/2s^2) e has at r = 0 half its strength, whatever s),
so it is twice what a free particle would need; viscosity and walls then shorten the way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wfluid.domain.envelopes import Arbitrary, Constant, Envelope, Fade, product
from wfluid.domain.limits import IMAGE_BLUR, IMAGE_LENGTH, NOISE_SCALE, RADIUS
from wfluid.domain.oscillator import Oscillator
from wfluid.domain.paths import Center, Path
from wfluid.model.force import Force
from wfluid.model.gaussian_forces import GaussianForce, Growth, VortexForce
from wfluid.model.image_force import ImageForce
from wfluid.model.noise_force import NoiseForce
from wfluid.model.painted import Freeze, Painted
from wfluid.model.stroke import Stroke
from wfluid.model.uniform_forces import Buoyancy, Wind
from wfluid.pictures.picture import resample
from wfluid.scene.checking import checked, made
from wfluid.scene.forces import (
    FORCES,
    BuoyancyTable,
    ConstantTable,
    EnvelopeTable,
    Factor,
    ForceTable,
    GrowTable,
    ImageTable,
    Masked,
    NoiseTable,
    OscillatorTable,
    PushTable,
    Ramps,
    Row,
    SamplesTable,
    Spot,
    StrokeTable,
    Timing,
    VortexTable,
    WindTable,
)
from wfluid.scene.schema import blame
from wfluid.staging.images import SceneImages
from wfluid.staging.timing import envelope_and_scale, phase_of, time_window

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
    images: SceneImages | None = None
    """Reads the pictures that forces name."""

    @property
    def side(self) -> float:
        """The frame's longer side [px]."""
        return max(self.width, self.height)

    def force(self, force: ForceTable | Mapping[str, Any], seed: int = 0) -> Force:
        """The force that a table draws: a scene's, or a dictionary such as `parse_force` gives.

        `seed` is that of noise which names none.

        Raises:
            ValueError: a key that is wrong, a place outside the picture, a window outside the animation,
                keys that contradict.
        """
        if isinstance(force, Mapping):
            force = made(FORCES, checked(FORCES, force))
        make = {
            PushTable: self._push,
            VortexTable: self._vortex,
            GrowTable: self._grow,
            StrokeTable: self._stroke,
            WindTable: self._wind,
            NoiseTable: lambda noise: self._noise(noise, seed),
            ImageTable: self._image,
            BuoyancyTable: self._buoyancy,
        }[type(force)]
        return make(force)

    def center(self, what: str, spot: Spot) -> Center:
        """Where a spot is [longer side].

        Raises:
            ValueError: neither a center nor a path, both, or a place outside the picture.
        """
        if (spot.center is None) == (spot.path is None):
            raise ValueError(f"{what}: expected either center or path")
        if spot.path is None:
            return self.place(what, spot.center)
        return self._path(what, spot.path)

    def place(self, what: str, at: Sequence[float]) -> tuple[float, float]:
        """A place [longer side] from pixels.

        Raises:
            ValueError: outside the picture.
        """
        if not (0 <= at[0] <= self.width and 0 <= at[1] <= self.height):
            raise ValueError(
                f"{what} at {at[0]:g},{at[1]:g}: outside the picture of {self.width} x {self.height} pixels"
            )
        return at[0] / self.side, at[1] / self.side

    def radius(self, spot: Spot | StrokeTable) -> float:
        """The radius of a spot [longer side]."""
        return self._length(spot.radius, RADIUS)

    def envelope_and_scale(self, what: str, timing: Timing) -> tuple[Envelope, float]:
        """The envelope, with those it names and its strength, and what carries a free particle by one."""
        envelope, per_length = envelope_and_scale(what, timing, self.duration, self.scheme, self.loop)
        return self.modulated(what, envelope, timing), per_length

    def modulated(self, what: str, envelope: Envelope, factor: Factor) -> Envelope:
        """The envelope times those that a table names, and its strength.

        Raises:
            ValueError: an envelope that does not exist.
        """
        return product(factor.strength, envelope, *self.named(what, factor.envelope))

    def named(self, what: str, names: Sequence[str]) -> list[Envelope]:
        """The envelopes of these names.

        Raises:
            ValueError: one that does not exist, with those that do.
        """
        for name in names:
            if name not in self.envelopes:
                there = ", ".join(self.envelopes) or "none"
                raise ValueError(f"{what}: there is no envelope {name!r}; there is {there}")
        return [self.envelopes[name] for name in names]

    def _length(self, pixels: float | None, otherwise: float) -> float:
        """A length [longer side] from pixels, or else one that is given so."""
        return otherwise if pixels is None else pixels / self.side

    def _vector(self, by: Sequence[float], factor: float) -> tuple[float, float]:
        return by[0] * factor / self.side, by[1] * factor / self.side

    def _mask(self, force: Masked) -> Painted | None:
        return self.weight if force.mask is None else self.images.mask(force.mask)

    def _path(self, what: str, rows: Sequence[Row]) -> Path:
        return Path([row[0] for row in rows], [self.place(what, row[1:]) for row in rows])

    def _push(self, push: PushTable) -> GaussianForce:
        envelope, per_length = self.envelope_and_scale("push", push)
        vector = self._vector(push.by, _PRESSURE * per_length)
        return GaussianForce(self.center("push", push), vector, self.radius(push), envelope, self._mask(push))

    def _vortex(self, vortex: VortexTable) -> VortexForce:
        envelope, per_length = self.envelope_and_scale("vortex", vortex)
        spin = math.radians(vortex.turn) * per_length
        return VortexForce(
            self.center("vortex", vortex), spin, self.radius(vortex), envelope, self._mask(vortex)
        )

    def _grow(self, grow: GrowTable) -> Growth:
        """Twice the logarithm of the factor is the area's; a rate, not an acceleration, takes it there."""
        area, center = 2 * math.log(grow.factor), self.center("grow", grow)
        envelope, _ = envelope_and_scale("grow", grow, self.duration, self.scheme, self.loop)
        if grow.period is None:
            rate = area / envelope.integral(0.0, self.duration)
        else:  # the cosine of the rate is the sine of the growth
            start, end = time_window("grow", grow, self.duration)
            wave = Oscillator(period=grow.period, phase=grow.phase, start=start, end=end, centred=False)
            rate, envelope = area * 2 * math.pi / grow.period, wave * _fade(grow, start, end)
        envelope = self.modulated("grow", envelope, grow)
        return Growth(center, rate, self.radius(grow), envelope, self._unfrozen(self._mask(grow)))

    def _unfrozen(self, weight: Painted | None) -> Painted | None:
        """A weight without what is frozen."""
        if self.frozen is None:
            return weight
        free = 1.0 - self.frozen.paint.values
        if weight is None:
            return Painted(free)
        height, width = weight.values.shape
        return Painted(weight.values * resample(free.astype(np.float32), width, height).clip(0, 1))

    def _stroke(self, stroke: StrokeTable) -> Stroke:
        if (stroke.points is None) == (stroke.path is None):
            raise ValueError("stroke: expected either points or path")
        if stroke.points is None:
            if stroke.gives("start", "end"):
                raise ValueError("stroke: a path has its own times; it goes without start and end")
            path = self._path("stroke", stroke.path)
            if path.times[0] >= self.duration:
                raise ValueError(f"stroke: its path begins at {path.times[0]:g} s, after the animation")
        else:
            points = [self.place("stroke", at) for at in stroke.points]
            path = Path.along(points, *time_window("stroke", stroke, self.duration))
        envelope = product(1.0, Constant(), *self.named("stroke", stroke.envelope))
        return Stroke(path, self.radius(stroke), stroke.strength, envelope, self._mask(stroke))

    def _wind(self, wind: WindTable) -> Wind:
        envelope, per_length = self.envelope_and_scale("wind", wind)
        return Wind(self._vector(wind.by, per_length), envelope, self._mask(wind))

    def _noise(self, noise: NoiseTable, seed: int) -> NoiseForce:
        envelope, per_length = self.envelope_and_scale("noise", noise)
        return NoiseForce(
            strength=noise.amount / self.side * per_length,
            scale=self._length(noise.scale, NOISE_SCALE),
            seed=seed if noise.seed is None else noise.seed,
            period=noise.change,
            envelope=envelope,
            weight=self._mask(noise),
        )

    def _image(self, image: ImageTable) -> ImageForce:
        weight = self._mask(image)
        envelope, per_length = self.envelope_and_scale(f"force image {image.file}", image)
        strength = self._length(image.amount, IMAGE_LENGTH) * per_length
        radius = self._length(image.radius, IMAGE_BLUR)
        read = self.images.read if image.along == "vectors" else self.images.paint
        with blame(file=image.file):
            force = ImageForce(read(image.file), image.along, strength, envelope, weight, radius)
        if image.along == "gradient" and weight is None:
            self.images.note(
                f"{image.file}: the pressure balances a gradient wholly, so alone it moves nothing; "
                "use along=contour, or give it a mask"
            )
        return force

    def _buoyancy(self, buoyancy: BuoyancyTable) -> Buoyancy:
        envelope, per_length = self.envelope_and_scale("buoyancy", buoyancy)
        return Buoyancy(buoyancy.density, self._vector(buoyancy.by, per_length), envelope)

    def envelope(self, table: EnvelopeTable) -> Envelope:
        """The envelope that a scene's table says.

        Raises:
            ValueError: values that contradict.
        """
        if isinstance(table, SamplesTable):
            return Arbitrary(times=table.times, values=table.values)
        start, end = table.start, math.inf if table.end is None else table.end
        if isinstance(table, ConstantTable):
            return Constant(start, end)
        if isinstance(table, OscillatorTable):
            phase = phase_of(table, self.loop)
            return Oscillator(period=table.period, phase=phase, start=start, end=end, centred=False)
        return _fade(table, start, self.duration if table.end is None else table.end)


def _fade(ramps: Ramps, start: float, end: float) -> Fade:
    return Fade(ramps.rise, ramps.fall, start, end)
