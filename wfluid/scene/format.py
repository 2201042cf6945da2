"""The keys of a scene file. Lengths are pixels of the frame that `picture.size` names, times seconds.

A field is everything that there is to say of a key: the reader, its refusals, the reference that
`wfluid render --keys` prints, the flags of the command line and their defaults all come from here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from wfluid.domain.limits import (
    AMOUNT_LIMIT,
    CELLS,
    CELLS_LIMIT,
    COLORSPACES,
    CYCLES,
    CYCLES_LIMIT,
    DRAG,
    DRAG_LIMIT,
    FIRST_FRAME,
    FPS_LIMIT,
    INK_CODE,
    KEYFRAME_STEPS,
    KEYFRAME_VISCOSITY,
    LEAST_CELLS,
    LEAST_FPS,
    LOOKS,
    LOOPS,
    MORPH_VISCOSITY,
    PAINTED_VISCOSITY,
    QUALITY_LIMIT,
    SCENE_FPS,
    SCHEMES,
    SIZE_LIMIT,
    SOLVERS,
    STEPS_PER_SECOND,
    SUBSTEPS_LIMIT,
    TYPES,
    VISCOSITY,
    VISCOSITY_LIMIT,
    WALLS,
)
from wfluid.pictures.sampling import EDGE, EDGES, FILTER, FILTERS
from wfluid.scene.forces import (
    ENVELOPES,
    FORCES,
    POINTS,
    SEED_LIMIT,
    SIZE,
    Blow,
    EnvelopeTable,
    Factor,
    ForceTable,
    Point,
    Ramps,
    Spot,
    Window,
)
from wfluid.scene.keyframes import KeyframesTable, MorphTable
from wfluid.scene.schema import SceneTable, array, file_key, key, mapping, optional, table, table_of
from wfluid.scene.types import color, flag, names, number, text, version, whole, word

if TYPE_CHECKING:
    from wfluid.pictures.formats import Encoding

VERSION = 1
"""Of the format that this file describes."""

DURATION = 2.0
"""Length of a scene that names none, and whose keyframes name no time [s]."""

SELF = "self"
"""What stands for the animated picture where a painting is named."""

_OF_POINTS = "a morph goes without: its flow follows from its points"
_OF_STEPS = "a morph goes without: its flow has steps of its own"
_OF_LOOPS = "a morph goes without: set pingpong of [morph]"

_AREA = "longer side^2/s"
_WHITE = "viscosity, or that of the image's white"


class PictureTable(SceneTable):
    """What is animated."""

    file: str = file_key("the picture", painting=False, required=True, form="PICTURE")
    size: Point | None = key(
        "width and height that the scene's pixels refer to", SIZE, unit="px", otherwise="the picture's"
    )
    colorspace: str = key(
        "colour space of its numbers", word(*COLORSPACES), default=COLORSPACES[0], flag="--colorspace"
    )


class FluidTable(SceneTable):
    """How the fluid is computed."""

    cells: int = key(
        "cells along the longer side", whole(LEAST_CELLS, CELLS_LIMIT), default=CELLS, flag="--cells"
    )
    walls: str = key(
        f"{', '.join(WALLS)}, or two of them as x,y",
        text(),
        default=WALLS[0],
        flag="--walls",
    )
    scheme: str = key(
        "numerical scheme (paper: Euler, bilinear, Jacobi, phase 0)",
        word(*SCHEMES),
        default=SCHEMES[0],
        flag="--scheme",
    )
    solver: str | None = key(
        "solver of pressure and diffusion", word(*SOLVERS), otherwise="by scheme", flag="--solver"
    )
    pressure_cycles: int = key(
        "multigrid cycles a projection", whole(1, CYCLES_LIMIT), default=CYCLES, flag="--pressure-cycles"
    )


class ViscosityKeyTable(SceneTable):
    """A viscosity at a time, instead of value and image; between them straight lines."""

    time: float = key("when", number(0), unit="s", required=True)
    value: float = key(_WHITE, number(0, VISCOSITY_LIMIT), unit=_AREA, required=True)
    image: str | None = file_key(
        "stiff where this picture is bright",
    )


class ViscosityTable(SceneTable):
    """How stiff it is."""

    value: float | None = key(
        _WHITE,
        number(0, VISCOSITY_LIMIT),
        unit=_AREA,
        otherwise=f"{VISCOSITY:g}; of a morph {MORPH_VISCOSITY:g}, of the command keyframes "
        f"{KEYFRAME_VISCOSITY:g}, with an image {PAINTED_VISCOSITY:g}",
        flag="--viscosity",
    )
    image: str | None = file_key(
        "a picture, bright where the fluid is stiff; self is the animated one",
        flag="--viscosity-image",
        metavar="FILE|self",
    )
    floor: float = key(
        "viscosity of the image's black",
        number(0, VISCOSITY_LIMIT),
        unit=_AREA,
        default=0.0,
        flag="--viscosity-floor",
    )
    invert: bool = key("stiff where the image is dark", flag(), default=False, flag="--invert-viscosity")
    moves: bool = key("whether it moves with the picture", flag(), default=False, flag="--viscosity-moves")
    keys: tuple[ViscosityKeyTable, ...] = array(ViscosityKeyTable, name="key")


class FreezeTable(SceneTable):
    """What stays in its place."""

    mask: str = file_key("white stays, by degrees", required=True)
    strength: float = key(
        "drag of white", number(0, DRAG_LIMIT), unit="1/s", default=DRAG, form="--freeze MASK:strength"
    )


class EffectTable(SceneTable):
    """Where forces act."""

    mask: str = file_key("forces act where it is white", required=True, flag="--effect-mask", metavar="MASK")


class TimeTable(SceneTable):
    """When frames are shown."""

    duration: float | None = key(
        "length of the animation",
        number(above=0),
        unit="s",
        otherwise=f"that of the last keyframe, or {DURATION:g}",
        flag="--duration",
    )
    fps: float = key("frames a second", number(LEAST_FPS, FPS_LIMIT), default=SCENE_FPS, flag="--fps")
    substeps: int | None = key(
        "steps a frame",
        whole(1, SUBSTEPS_LIMIT),
        otherwise=f"steps of at most 1/{STEPS_PER_SECOND} s, with keyframes 1/{KEYFRAME_STEPS} s",
        flag="--substeps",
        not_in_morph=_OF_STEPS,
    )
    loop: str | None = key(
        "how the end meets the beginning",
        word(*LOOPS),
        otherwise="not at all",
        flag="--loop",
        not_in_morph=_OF_LOOPS,
    )


class FramesTable(SceneTable):
    """What they look like."""

    width: int | None = key(
        "width of the frames", whole(1, SIZE_LIMIT), unit="px", otherwise="the picture's", flag="--width"
    )
    scale: float | None = key(
        "size of the frames as a factor, instead of width", number(above=0), flag="--scale"
    )
    filter: str = key(
        "interpolation between the picture's pixels", word(*FILTERS), default=FILTER, flag="--filter"
    )
    edge: str = key("what lies beyond the picture's edges", word(*EDGES), default=EDGE, flag="--edge")
    background: str | None = key(
        "colour behind a transparent picture in outputs without alpha: GIF, movies, JPEG, HDR, BMP",
        color(),
        otherwise="black",
        flag="--background",
    )


class GroupTable(SceneTable):
    """Forces edited as one."""

    name: str = key("what it is called", text(), required=True)
    strength: float = key("factor on all", number(), default=1.0)
    envelope: tuple[str, ...] = key("envelopes that all are multiplied by", names(), default=())


class SourceTable(Factor, Ramps, Blow, Window, Spot):
    """What pours a density in: a spot, or a picture."""

    image: str | None = file_key(
        "pours where this picture is bright, instead of a spot",
    )
    amount: float = key(
        "density poured in all, at the brightest place", number(-AMOUNT_LIMIT, AMOUNT_LIMIT), default=1.0
    )


class DensityTable(SceneTable):
    """Something dissolved in it, seen over the picture."""

    name: str = key("what it is called", text(), required=True)
    color: str | None = key("its colour", color(), otherwise=INK_CODE)
    look: str = key("colours, or covers", word(*LOOKS), default=LOOKS[0])
    diffusion: float = key("how fast it spreads", number(0, VISCOSITY_LIMIT), unit=_AREA, default=0.0)
    image: str | None = file_key(
        "there at the beginning where this picture is bright",
    )
    amount: float = key("density of the image's white", number(0, AMOUNT_LIMIT), default=1.0)
    sources: tuple[SourceTable, ...] = array(SourceTable, name="source")


class LayerTable(SceneTable):
    """A picture or matte that goes through the same map."""

    name: str = key("what it is called", text(), required=True)
    file: str = file_key("the picture, stretched over the animated one", painting=False, required=True)
    data: bool | None = key(
        "whether its numbers are data, not colours", flag(), otherwise="true for one channel"
    )


class TracksTable(SceneTable):
    """Points that are followed."""

    points: tuple[Point, ...] = key("where they begin", POINTS, unit="px", default=(), form="--track")


class OutputTable(SceneTable):
    """What is written."""

    file: str = file_key(
        "x.gif, x.mp4, x.####.png, …; x.csv for tracks, x.json for the report",
        painting=False,
        required=True,
    )
    of: str = key("picture, tracks, report, or the name of a layer or density", text(), default="picture")
    start: int = key(
        "number of a sequence's first frame", whole(0, 10**9), default=FIRST_FRAME, flag="--start"
    )
    type: str | None = key(
        "number type of a sequence", word(*TYPES), otherwise="the picture's", flag="--type"
    )
    compression: str | None = key("compression of EXR and TIFF sequences", text(), flag="--compression")
    quality: int | None = key("quality of JPEG and WebP sequences", whole(1, QUALITY_LIMIT), flag="--quality")

    @property
    def encoding(self) -> Encoding:
        """How stills are written.

        Raises:
            PictureError: a value that no format has.
        """
        from wfluid.pictures.formats import Encoding

        return Encoding(self.type, self.compression, self.quality)


class SceneTables(SceneTable):
    """A scene."""

    wfluid: int = key("version of the format", version(VERSION), required=True)
    seed: int = key(
        "seed of noises that name none, and of keyframes", whole(0, SEED_LIMIT), default=0, flag="--seed"
    )
    picture: PictureTable = optional(PictureTable)
    fluid: FluidTable = table(FluidTable)
    viscosity: ViscosityTable = table(ViscosityTable)
    freeze: FreezeTable | None = optional(FreezeTable)
    effect: EffectTable | None = optional(EffectTable, not_in_morph=_OF_POINTS)
    time: TimeTable = table(TimeTable)
    frames: FramesTable = table(FramesTable)
    envelopes: dict[str, EnvelopeTable] = mapping(ENVELOPES)
    forces: tuple[ForceTable, ...] = array(FORCES, unique="name", name="force", not_in_morph=_OF_POINTS)
    groups: tuple[GroupTable, ...] = array(GroupTable, unique="name", name="group", not_in_morph=_OF_POINTS)
    densities: tuple[DensityTable, ...] = array(
        DensityTable, unique="name", name="density", not_in_morph=_OF_POINTS
    )
    layers: tuple[LayerTable, ...] = array(LayerTable, unique="name", name="layer", not_in_morph=_OF_POINTS)
    tracks: TracksTable = table(TracksTable, not_in_morph=_OF_POINTS)
    keyframes: KeyframesTable | None = optional(KeyframesTable)
    morph: MorphTable | None = optional(MorphTable)
    outputs: tuple[OutputTable, ...] = array(OutputTable, name="output")


SCENE = table_of(SceneTables)
"""Everything a scene may say."""
