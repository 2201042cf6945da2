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
"""Largest random seed."""

PHASE = 0.25
"""Default phase of an oscillation, a part of a period: the motion is centred on the place."""

LOOP_PHASE = 0.5
"""Default phase in an oscillating loop, which starts in the middle of the motion."""


def _share(part: float) -> str:
    return f"{100 * part:g} % of the longer side"


class Window(SceneTable):
    """The window of time."""

    trailing = True
    start: float = key("start of the window", number(0), unit="s", default=0.0)
    end: float | None = key("end of the window", number(above=0), unit="s", otherwise="the end")


class Impulse(SceneTable):
    """The time of an impulse."""

    trailing = True
    at: float | None = key("one impulse at this time, instead of a window", number(0), unit="s")


class Wave(SceneTable):
    """An oscillation."""

    trailing = True
    period: float | None = key("period of an oscillation", number(LEAST_TIME), unit="s")
    phase: float | None = key(
        "phase, a part of a period: 0.25 centres the motion on the place, 0 is the paper's sine",
        number(),
        otherwise=f"{PHASE:g}; in an oscillating loop {LOOP_PHASE:g}",
    )


class Ramps(SceneTable):
    """Smooth ends of the window."""

    trailing = True
    rise: float = key("time of the smooth increase at the start", number(0), unit="s", default=0.0)
    fall: float = key("time of the smooth decrease at the end", number(0), unit="s", default=0.0)


class Factor(SceneTable):
    """Factors."""

    trailing = True
    strength: float = key("factor on the strength", number(), default=1.0)
    envelope: tuple[str, ...] = key("named envelopes that multiply the strength", names(), default=())


class Timing(Factor, Ramps, Wave, Impulse, Window):
    """The timing of a force."""

    trailing = True


class Label(SceneTable):
    """The name of a force."""

    trailing = True
    name: str | None = key("name, for --set", text())
    group: str | None = key("name of its group", text())


class Masked(SceneTable):
    """The mask of a force."""

    trailing = True
    mask: str | None = file_key("mask, white where the force acts; replaces the effect mask")


class Spot(SceneTable):
    """A place with a radius."""

    center: Point | None = key("centre", POINT, unit="px")
    path: tuple[Row, ...] | None = key("path of a moving centre, instead of center", PATH, unit="s, px")
    radius: float | None = key("sigma of the Gaussian", number(above=0), unit="px", otherwise=_share(RADIUS))


class PushTable(Masked, Timing, Label, Spot):
    """A push along an arrow."""

    kind = "push"
    by: Point = key("displacement of the centre", POINT, unit="px", required=True)


class VortexTable(Masked, Timing, Label, Spot):
    """A twirl, clockwise for positive angles."""

    kind = "vortex"
    turn: float = key("rotation of the centre", number(), unit="degrees", required=True)


class GrowTable(Masked, Factor, Ramps, Wave, Window, Label, Spot):
    """Growth, or shrinking, compensated in a ring around it; not in frozen parts."""

    kind = "grow"
    factor: float = key("factor on lengths at the centre", number(0.05, 20), required=True)
    phase: float = key(
        "phase, a part of a period: 0.25 centres the motion on the place, 0 is the paper's sine",
        number(),
        default=PHASE,
    )


class StrokeTable(Masked, Label, Factor, Window):
    """A drag along a line from start to end."""

    kind = "stroke"
    points: tuple[Point, ...] | None = key(
        "points of the line", rows(2, 2, "two points or more, [[x, y], …]"), unit="px"
    )
    path: tuple[Row, ...] | None = key("points of the line with times, instead of points", PATH, unit="s, px")
    radius: float | None = key("sigma of the Gaussian", number(above=0), unit="px", otherwise=_share(RADIUS))


class WindTable(Masked, Timing, Label):
    """A uniform push; moves the picture only with periodic walls or a mask."""

    kind = "wind"
    by: Point = key("displacement", POINT, unit="px", required=True)


class NoiseTable(Masked, Timing, Label):
    """Turbulence: random eddies."""

    kind = "noise"
    amount: float = key("displacement, root mean square", number(), unit="px", required=True)
    scale: float | None = key(
        "mean wavelength, up to twice the longer side",
        number(above=0),
        unit="px",
        otherwise=_share(NOISE_SCALE),
    )
    seed: int | None = key(
        "random seed", whole(0, SEED_LIMIT), otherwise="the scene's plus the number of the force"
    )
    change: float | None = key(
        "period after which the noise repeats", number(LEAST_TIME), unit="s", otherwise="constant"
    )


class ImageTable(Masked, Timing, Label):
    """A force from a picture; self is the animated one."""

    kind = "image"
    file: str = file_key("the picture", required=True)
    along: str = key("direction of the force", word(*IMAGE_FORCES), default=IMAGE_FORCES[0])
    amount: float | None = key(
        "displacement where the force is strongest", number(), unit="px", otherwise=_share(IMAGE_LENGTH)
    )
    radius: float | None = key(
        "sigma of the blur before the gradient", number(0), unit="px", otherwise=_share(IMAGE_BLUR)
    )


class BuoyancyTable(Timing, Label):
    """A push by a density, in proportion to it."""

    kind = "buoyancy"
    density: str = key("name of the density", text(), required=True)
    by: Point = key("displacement where the density is 1", POINT, unit="px", required=True)


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
FORCES = union("Forces", *FORCE_CLASSES)
"""The forces, by the key `kind`."""

TIMING_KEYS = tuple(table_of(Timing).keys)
"""Keys of a force's timing."""


class ConstantTable(Window):
    """1 in a window, else 0."""

    kind = "constant"


class FadeTable(Ramps, Window):
    """1 in a window with smooth ends, else 0."""

    kind = "fade"


class OscillatorTable(Wave, Window):
    """A sine."""

    kind = "oscillator"
    period: float = key("period", number(LEAST_TIME), unit="s", required=True)


class SamplesTable(SceneTable):
    """Linear interpolation between values."""

    kind = "samples"
    times: tuple[float, ...] = key(
        "times of the values", rows(1, 2, "two numbers or more"), unit="s", required=True
    )
    values: tuple[float, ...] = key("values", rows(1, 2, "two numbers or more"), required=True)


EnvelopeTable = ConstantTable | FadeTable | OscillatorTable | SamplesTable
ENVELOPES = union("Named envelopes", ConstantTable, FadeTable, OscillatorTable, SamplesTable)
"""The envelopes, by the key `kind`."""
