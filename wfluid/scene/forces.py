"""The tables of a scene's forces and envelopes. Lengths are pixels of the scene's frame, times seconds."""

from __future__ import annotations

from wfluid.domain.limits import IMAGE_BLUR, IMAGE_FORCES, IMAGE_LENGTH, LEAST_TIME, NOISE_SCALE, RADIUS
from wfluid.scene.schema import SceneTable, file_key, key, table_of, union
from wfluid.scene.types import names, number, numbers, rows, text, whole, word

Point = tuple[float, float]
"""Two numbers, x and y."""

Row = tuple[float, float, float]
"""A time [s], x and y [px]."""

POINT = numbers(2, "two numbers, [x, y]")
POINTS = rows(2, 1, "a list of points, [[x, y], …]")
SIZE = numbers(2, "two numbers, [width, height]")
PATH = rows(3, 2, "two rows or more of [seconds, x, y]")

SEED_LIMIT = 2**32 - 1
"""Largest seed of random numbers."""

PHASE = 0.25
"""Part of a period that an oscillation is ahead where nothing says it: it swings about the place."""

LOOP_PHASE = 0.5
"""The same in an oscillating loop, where the flow has swung before."""


def _share(part: float) -> str:
    return f"{100 * part:g} % of the longer side"


class Window(SceneTable):
    """When something begins and ends."""

    trailing = True
    start: float = key("when it begins", number(0), unit="s", default=0.0)
    end: float | None = key("when it ends", number(above=0), unit="s", otherwise="the end")


class Blow(SceneTable):
    """One blow."""

    trailing = True
    at: float | None = key("one blow at that time, instead of a window", number(0), unit="s")


class Wave(SceneTable):
    """An oscillation."""

    trailing = True
    period: float | None = key("oscillate with that period", number(LEAST_TIME), unit="s")
    phase: float | None = key(
        "part of a period it is ahead: 0.25 swings about the place, 0 is the paper's sine",
        number(),
        otherwise=f"{PHASE:g}; in an oscillating loop {LOOP_PHASE:g}",
    )


class Ramps(SceneTable):
    """Smooth ends."""

    trailing = True
    rise: float = key("time over which it grows to its strength", number(0), unit="s", default=0.0)
    fall: float = key("time over which it ceases before its end", number(0), unit="s", default=0.0)


class Factor(SceneTable):
    """What multiplies it."""

    trailing = True
    strength: float = key("factor", number(), default=1.0)
    envelope: tuple[str, ...] = key("further envelopes that it is multiplied by", names(), default=())


class Timing(Factor, Ramps, Wave, Blow, Window):
    """When a force acts."""

    trailing = True


class Label(SceneTable):
    """What a force is called."""

    trailing = True
    name: str | None = key("what it is called, for --set", text())
    group: str | None = key("the group it belongs to", text())


class Masked(SceneTable):
    """Where a force acts."""

    trailing = True
    mask: str | None = file_key(
        "acts where this picture is white, instead of the scene's effect mask",
    )


class Spot(SceneTable):
    """A place with a radius."""

    center: Point | None = key("where it acts", POINT, unit="px")
    path: tuple[Row, ...] | None = key("where it acts over time, instead of center", PATH, unit="s, px")
    radius: float | None = key("sigma of its Gaussian", number(above=0), unit="px", otherwise=_share(RADIUS))


class PushTable(Masked, Timing, Label, Spot):
    """A push along an arrow."""

    kind = "push"
    by: Point = key("the arrow: how far it carries its centre", POINT, unit="px", required=True)


class VortexTable(Masked, Timing, Label, Spot):
    """A twirl, clockwise for positive angles."""

    kind = "vortex"
    turn: float = key("how far it turns its centre", number(), unit="degrees", required=True)


class GrowTable(Masked, Factor, Ramps, Wave, Window, Label, Spot):
    """Growing, or shrinking, with a ring around that gives way; not where it is frozen."""

    kind = "grow"
    factor: float = key("how many times as long the centre becomes", number(0.05, 20), required=True)
    phase: float = key(
        "part of a period it is ahead: 0.25 swings about the place, 0 is the paper's sine",
        number(),
        default=PHASE,
    )


class StrokeTable(Masked, Label, Factor, Window):
    """A drag along a line from start to end."""

    kind = "stroke"
    points: tuple[Point, ...] | None = key(
        "the line", rows(2, 2, "two points or more, [[x, y], …]"), unit="px"
    )
    path: tuple[Row, ...] | None = key("the line with its times, instead of points", PATH, unit="s, px")
    radius: float | None = key("sigma of its Gaussian", number(above=0), unit="px", otherwise=_share(RADIUS))


class WindTable(Masked, Timing, Label):
    """One push everywhere; moves something along periodic walls, or under a mask."""

    kind = "wind"
    by: Point = key("how far it carries", POINT, unit="px", required=True)


class NoiseTable(Masked, Timing, Label):
    """Turbulence: random eddies."""

    kind = "noise"
    amount: float = key("how far it carries, root mean square", number(), unit="px", required=True)
    scale: float | None = key(
        "mean wavelength, up to twice the longer side",
        number(above=0),
        unit="px",
        otherwise=_share(NOISE_SCALE),
    )
    seed: int | None = key(
        "which noise", whole(0, SEED_LIMIT), otherwise="the scene's, and the force's number"
    )
    change: float | None = key("time in which it changes and comes back", number(LEAST_TIME), unit="s")


class ImageTable(Masked, Timing, Label):
    """A force from a picture, or from the animated one, self."""

    kind = "image"
    file: str = file_key("the picture", required=True)
    along: str = key("what it follows", word(*IMAGE_FORCES), default=IMAGE_FORCES[0])
    amount: float | None = key(
        "how far its strongest place is carried", number(), unit="px", otherwise=_share(IMAGE_LENGTH)
    )
    radius: float | None = key(
        "blur before slopes are taken", number(0), unit="px", otherwise=_share(IMAGE_BLUR)
    )


class BuoyancyTable(Timing, Label):
    """A density's own push."""

    kind = "buoyancy"
    density: str = key("name of the density", text(), required=True)
    by: Point = key("how far it carries where the density is 1", POINT, unit="px", required=True)


FORCE_CLASSES = (
    PushTable,
    VortexTable,
    GrowTable,
    StrokeTable,
    WindTable,
    NoiseTable,
    ImageTable,
    BuoyancyTable,
)
ForceTable = (
    PushTable | VortexTable | GrowTable | StrokeTable | WindTable | NoiseTable | ImageTable | BuoyancyTable
)
FORCES = union("What moves it", *FORCE_CLASSES)
"""Forces, by the key `kind`."""

TIMING_KEYS = tuple(table_of(Timing).keys)
"""Keys that say when a force acts."""


class ConstantTable(Window):
    """1 in a window."""

    kind = "constant"


class FadeTable(Ramps, Window):
    """1 in a window, with smooth ends."""

    kind = "fade"


class OscillatorTable(Wave, Window):
    """A sine."""

    kind = "oscillator"
    period: float = key("its period", number(LEAST_TIME), unit="s", required=True)


class SamplesTable(SceneTable):
    """Straight lines between values."""

    kind = "samples"
    times: tuple[float, ...] = key("when", rows(1, 2, "two numbers or more"), unit="s", required=True)
    values: tuple[float, ...] = key("factors", rows(1, 2, "two numbers or more"), required=True)


EnvelopeTable = ConstantTable | FadeTable | OscillatorTable | SamplesTable
ENVELOPES = union("A course in time with a name", ConstantTable, FadeTable, OscillatorTable, SamplesTable)
"""Envelopes, by the key `kind`."""
