"""Forces drawn on the picture, in pixels and seconds: tables of `scene.forces`.

A drawn length is the displacement that the force alone causes: of the centre by a push, of the centre's
angle by a vortex, root mean square by noise. The pressure cancels half of a Gaussian push: in two dimensions
the divergence-free part of exp(-r^2 / 2 s^2) e has half its strength at r = 0, whatever s. A push is
therefore twice as strong as a free particle needs. Viscosity and walls shorten the displacement.
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
"""Factor on a Gaussian push, of which the pressure cancels half."""


@dataclass(frozen=True)
class Drawing:
    """The frame and the times that drawn forces refer to.

    Drawing(1024, 768, duration=2.0).force({"kind": "push", "center": [621, 451], "by": [22, 15]})
    """

    width: float
    """Width of the frame [px]."""
    height: float
    """Height of the frame [px]."""
    duration: float
    """Length of the animation, of a pingpong that of the way out [s]."""
    scheme: str = "standard"
    """Numerical scheme of the fluid; in "paper" oscillators start as a sine."""
    loop: str | None = None
    """Loop of the animation; in "oscillate" forces continue across its end."""
    envelopes: Mapping[str, Envelope] = field(default_factory=dict)
    """Named envelopes of the scene."""
    weight: Painted | None = None
    """Mask of forces without their own."""
    frozen: Freeze | None = None
    """Frozen parts of the picture, where no growth acts."""
    images: SceneImages | None = None
    """Reads the pictures of forces and masks."""

    @property
    def side(self) -> float:
        """The frame's longer side [px]."""
        return max(self.width, self.height)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of the frame [longer side]."""
        return self.width / self.side, self.height / self.side

    def force(self, force: ForceTable | Mapping[str, Any], seed: int = 0) -> Force:
        """The force of a scene's table, or of a dictionary as `parse_force` returns.

        `seed` is for noise without its own.

        Raises:
            ValueError: a wrong key, a place outside the picture, a window outside the animation, keys that
                exclude each other, a picture without `images`.
        """
        if isinstance(force, Mapping):
            force = made(FORCES, checked(FORCES, force))
        match force:
            case PushTable():
                return self._push(force)
            case VortexTable():
                return self._vortex(force)
            case GrowTable():
                return self._grow(force)
            case StrokeTable():
                return self._stroke(force)
            case WindTable():
                return self._wind(force)
            case NoiseTable():
                return self._noise(force, seed)
            case ImageTable():
                return self._image(force)
            case BuoyancyTable():
                return self._buoyancy(force)
        raise TypeError(f"{force!r}: expected a table of {', '.join(FORCES.tables)}")

    def center(self, what: str, spot: Spot) -> Center:
        """The centre of a spot, or its path [longer side].

        Raises:
            ValueError: both center and path, or neither; a place outside the picture.
        """
        if spot.center is not None and spot.path is None:
            return self.place(what, spot.center)
        if spot.path is not None and spot.center is None:
            return self._path(what, spot.path)
        raise ValueError(f"{what}: expected either center or path")

    def place(self, what: str, at: Sequence[float]) -> tuple[float, float]:
        """A place in domain units [longer side] from pixels.

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
        """The envelope of a force, and the acceleration that displaces a free particle by 1.

        As `timing.envelope_and_scale`; the envelope includes the named envelopes and the strength.
        """
        envelope, per_length = envelope_and_scale(what, timing, self.duration, self.scheme, self.loop)
        return self.modulated(what, envelope, timing), per_length

    def modulated(self, what: str, envelope: Envelope, factor: Factor) -> Envelope:
        """The envelope times the named envelopes and the strength of a table.

        Raises:
            ValueError: an unknown envelope.
        """
        return product(factor.strength, envelope, *self.named(what, factor.envelope))

    def named(self, what: str, names: Sequence[str]) -> list[Envelope]:
        """The envelopes of these names.

        Raises:
            ValueError: an unknown name; the message lists the known ones.
        """
        for name in names:
            if name not in self.envelopes:
                there = ", ".join(self.envelopes) or "none"
                raise ValueError(f"{what}: there is no envelope {name!r}; there is {there}")
        return [self.envelopes[name] for name in names]

    def _length(self, pixels: float | None, default: float) -> float:
        """A length [longer side] from pixels; `default` where it is None."""
        return default if pixels is None else pixels / self.side

    def _vector(self, by: Sequence[float], factor: float) -> tuple[float, float]:
        return by[0] * factor / self.side, by[1] * factor / self.side

    def _mask(self, force: Masked) -> Painted | None:
        return self.weight if force.mask is None else self._images.mask(force.mask)

    @property
    def _images(self) -> SceneImages:
        if self.images is None:
            raise ValueError("a force with a picture or a mask needs Drawing(…, images=SceneImages(…))")
        return self.images

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
        """A rate of divergence, not an acceleration; the area grows by the square of the factor."""
        area, center = 2 * math.log(grow.factor), self.center("grow", grow)
        envelope, _ = envelope_and_scale("grow", grow, self.duration, self.scheme, self.loop)
        if grow.period is None:
            rate = area / envelope.integral(0.0, self.duration)
        else:  # a cosine as the rate makes a sine of the growth
            start, end = time_window("grow", grow, self.duration, self.loop)
            wave = Oscillator(period=grow.period, phase=grow.phase, start=start, end=end, centred=False)
            rate, envelope = area * 2 * math.pi / grow.period, wave * _fade(grow, start, end)
        envelope = self.modulated("grow", envelope, grow)
        return Growth(center, rate, self.radius(grow), envelope, self._unfrozen(self._mask(grow)))

    def _unfrozen(self, weight: Painted | None) -> Painted | None:
        """A weight that is 0 where the picture is frozen."""
        if self.frozen is None:
            return weight
        free = 1.0 - self.frozen.paint.values
        if weight is None:
            return Painted(free)
        height, width = weight.values.shape
        return Painted(weight.values * resample(free.astype(np.float32), width, height).clip(0, 1))

    def _stroke(self, stroke: StrokeTable) -> Stroke:
        if stroke.path is not None and stroke.points is None:
            if stroke.gives("start", "end"):
                raise ValueError("stroke: a path has its own times; leave out start and end")
            path = self._path("stroke", stroke.path)
            if path.times[0] >= self.duration:
                raise ValueError(f"stroke: its path begins at {path.times[0]:g} s, after the animation")
        elif stroke.points is not None and stroke.path is None:
            points = [self.place("stroke", at) for at in stroke.points]
            path = Path.along(points, *time_window("stroke", stroke, self.duration, self.loop))
        else:
            raise ValueError("stroke: expected either points or path")
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
        images = self._images
        read = images.read if image.along == "vectors" else images.paint
        with blame(file=image.file):
            force = ImageForce(read(image.file), image.along, strength, envelope, weight, radius)
        if image.along == "gradient" and weight is None:
            images.note(
                f"{image.file}: the pressure cancels the force of a gradient, so nothing moves; "
                "use along=contour, or give it a mask"
            )
        return force

    def _buoyancy(self, buoyancy: BuoyancyTable) -> Buoyancy:
        envelope, per_length = self.envelope_and_scale("buoyancy", buoyancy)
        return Buoyancy(buoyancy.density, self._vector(buoyancy.by, per_length), envelope)

    def envelope(self, table: EnvelopeTable) -> Envelope:
        """The envelope of a scene's table.

        Raises:
            ValueError: values that contradict each other.
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
