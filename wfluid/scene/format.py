"""The keys of a scene file. Lengths are pixels of the frame that `picture.size` names, times seconds.

A field defines everything about a key: the reader, its error messages, the reference that `wfluid render
--keys` prints, the flags of the command line and their defaults all come from here.
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
    DIFFUSION_LOSS,
    DIFFUSION_TOLERANCE,
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
    EnvelopeTable,
    Factor,
    ForceTable,
    Impulse,
    Point,
    Ramps,
    Spot,
    Window,
)
from wfluid.scene.keyframes import KeyframesTable, MorphTable
from wfluid.scene.schema import SceneTable, array, file_key, key, mapping, optional, table, table_of
from wfluid.scene.types import color, flag, names, number, text, version, whole, word, word_by_axis

if TYPE_CHECKING:
    from wfluid.pictures.formats import Encoding

VERSION = 1
"""Version of the format that this file describes."""

DURATION = 2.0
"""Default length of a scene without timed keyframes [s]."""

SELF = "self"
"""The animated picture, in place of the name of a file."""

_OF_POINTS = "not allowed in a morph: its points define the flow"
_OF_STEPS = "not allowed in a morph: its flow has fixed steps"
_OF_LOOPS = "not allowed in a morph: set pingpong of [morph]"

_AREA = "longer side^2/s"
_WHITE = "kinematic viscosity; with an image, that of white"


class PictureTable(SceneTable):
    """The animated picture."""

    file: str = file_key("file of the picture", painting=False, required=True, form="PICTURE")
    size: Point | None = key(
        "size of the frame that the scene's pixels refer to", SIZE, unit="px", otherwise="the picture's"
    )
    colorspace: str = key(
        "colour space of the pixel values", word(*COLORSPACES), default=COLORSPACES[0], flag="--colorspace"
    )


class FluidTable(SceneTable):
    """The fluid and its solver."""

    cells: int = key(
        "cells along the longer side", whole(LEAST_CELLS, CELLS_LIMIT), default=CELLS, flag="--cells"
    )
    walls: str = key(
        f"boundary condition: {', '.join(WALLS)}, or two of them as x,y",
        word_by_axis(*WALLS),
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
        "solver of pressure and diffusion",
        word(*SOLVERS),
        otherwise="multigrid, with the scheme paper jacobi",
        flag="--solver",
    )
    creeping: bool | None = key(
        "without inertia: the velocity answers forces at once, and stops with them",
        flag(),
        otherwise="true for keyframes and morphs without forces of their own, else false",
        flag="--creeping",
    )
    pressure_cycles: int = key(
        "multigrid cycles per projection", whole(1, CYCLES_LIMIT), default=CYCLES, flag="--pressure-cycles"
    )
    diffusion_tolerance: float = key(
        "relative error of the change that viscosity makes in a step",
        number(1e-14, 0.5),
        default=DIFFUSION_TOLERANCE,
        flag="--diffusion-tolerance",
    )
    diffusion_loss: float | None = key(
        "how far places may be off after a second by the solves of the viscosity",
        number(above=0),
        unit="px",
        otherwise=f"{512 * DIFFUSION_LOSS:g} for a picture of 512 px",
        flag="--diffusion-loss",
    )


class ViscosityKeyTable(SceneTable):
    """A viscosity at a time, instead of value and image; linear interpolation between times."""

    time: float = key("time", number(0), unit="s", required=True)
    value: float = key(_WHITE, number(0, VISCOSITY_LIMIT), unit=_AREA, required=True)
    image: str | None = file_key("picture, bright where the fluid is stiff")


class ViscosityTable(SceneTable):
    """The viscosity of the fluid."""

    value: float | None = key(
        _WHITE,
        number(0, VISCOSITY_LIMIT),
        unit=_AREA,
        otherwise=f"{VISCOSITY:g}; of a morph {MORPH_VISCOSITY:g}, of the command keyframes "
        f"{KEYFRAME_VISCOSITY:g}, with an image {PAINTED_VISCOSITY:g}",
        flag="--viscosity",
    )
    image: str | None = file_key(
        "picture, bright where the fluid is stiff; self is the animated one",
        flag="--viscosity-image",
        metavar="FILE|self",
    )
    floor: float = key(
        "viscosity of black in the image",
        number(0, VISCOSITY_LIMIT),
        unit=_AREA,
        default=0.0,
        flag="--viscosity-floor",
    )
    invert: bool = key(
        "make the fluid stiff where the image is dark", flag(), default=False, flag="--invert-viscosity"
    )
    moves: bool = key("move the viscosity with the picture", flag(), default=False, flag="--viscosity-moves")
    keys: tuple[ViscosityKeyTable, ...] = array(ViscosityKeyTable, name="key")


class FreezeTable(SceneTable):
    """Frozen parts of the picture."""

    mask: str = file_key("mask: white stays in place, grey partly", required=True)
    strength: float = key(
        "drag of white in the mask",
        number(0, DRAG_LIMIT),
        unit="1/s",
        default=DRAG,
        form="--freeze MASK:strength",
    )


class EffectTable(SceneTable):
    """The mask of forces without their own."""

    mask: str = file_key("mask, white where forces act", required=True, flag="--effect-mask", metavar="MASK")


class TimeTable(SceneTable):
    """Duration, frame rate and loop."""

    duration: float | None = key(
        "length of the animation",
        number(above=0),
        unit="s",
        otherwise=f"the time of the last keyframe, or else {DURATION:g}",
        flag="--duration",
    )
    fps: float = key("frame rate", number(LEAST_FPS, FPS_LIMIT), unit="1/s", default=SCENE_FPS, flag="--fps")
    substeps: int | None = key(
        "time steps per frame",
        whole(1, SUBSTEPS_LIMIT),
        otherwise=f"steps of at most 1/{STEPS_PER_SECOND} s, with keyframes 1/{KEYFRAME_STEPS} s",
        flag="--substeps",
        not_in_morph=_OF_STEPS,
    )
    loop: str | None = key(
        "way to close a loop",
        word(*LOOPS),
        otherwise="no loop",
        flag="--loop",
        not_in_morph=_OF_LOOPS,
    )


class FramesTable(SceneTable):
    """Size and look-up of the frames."""

    width: int | None = key(
        "width of the frames", whole(1, SIZE_LIMIT), unit="px", otherwise="the picture's", flag="--width"
    )
    scale: float | None = key(
        "factor on the size of the picture, instead of width",
        number(above=0, most=SIZE_LIMIT),
        flag="--scale",
    )
    filter: str = key("interpolation between pixels", word(*FILTERS), default=FILTER, flag="--filter")
    edge: str = key("values beyond the edges of the picture", word(*EDGES), default=EDGE, flag="--edge")
    background: str | None = key(
        "colour behind a transparent picture in outputs without alpha: GIF, movies, JPEG, HDR, BMP",
        color(),
        otherwise="black",
        flag="--background",
    )
    allow_folds: bool = key(
        "accept frames in which the picture folds; without it the exit code is then 1",
        flag(),
        default=False,
        flag="--allow-folds",
    )


class GroupTable(SceneTable):
    """A group of forces."""

    name: str = key("name of the group", text(), required=True)
    strength: float = key("factor on the strength of all", number(), default=1.0)
    envelope: tuple[str, ...] = key("named envelopes that multiply the strength of all", names(), default=())


class SourceTable(Factor, Ramps, Impulse, Window, Spot):
    """A source of a density: a spot, or a picture."""

    image: str | None = file_key("picture, bright where the source is strong, instead of a spot")
    amount: float = key(
        "total density that the source adds where it is strongest",
        number(-AMOUNT_LIMIT, AMOUNT_LIMIT),
        default=1.0,
    )


class DensityTable(SceneTable):
    """A density dissolved in the fluid and shown over the picture."""

    name: str = key("name of the density", text(), required=True)
    color: str | None = key("colour", color(), otherwise=INK_CODE)
    look: str = key("look: ink colours the picture, smoke covers it", word(*LOOKS), default=LOOKS[0])
    diffusion: float = key("diffusion coefficient", number(0, VISCOSITY_LIMIT), unit=_AREA, default=0.0)
    image: str | None = file_key("picture of the density at the start, bright where it is large")
    amount: float = key("density of white in the image", number(0, AMOUNT_LIMIT), default=1.0)
    sources: tuple[SourceTable, ...] = array(SourceTable, name="source")


class LayerTable(SceneTable):
    """Another picture or matte, warped by the same map."""

    name: str = key("name of the layer", text(), required=True)
    file: str = file_key(
        "file of the picture, stretched over the animated one", painting=False, required=True
    )
    data: bool | None = key(
        "true if the pixel values are data, not colours", flag(), otherwise="true for one channel"
    )


class TracksTable(SceneTable):
    """Followed points."""

    points: tuple[Point, ...] = key("places at the start", POINTS, unit="px", default=(), form="--track")


class OutputTable(SceneTable):
    """A file that is written."""

    file: str = file_key(
        "name: x.gif, x.mp4, x.####.png, …; x.csv for tracks, x.json for the report",
        painting=False,
        required=True,
    )
    of: str = key(
        "contents: picture, tracks, report, or the name of a layer or density", text(), default="picture"
    )
    start: int = key(
        "number of the first frame of a sequence", whole(0, 10**9), default=FIRST_FRAME, flag="--start"
    )
    type: str | None = key(
        "number type of the stills of a sequence", word(*TYPES), otherwise="the picture's", flag="--type"
    )
    compression: str | None = key("compression of EXR and TIFF sequences", text(), flag="--compression")
    quality: int | None = key("quality of JPEG and WebP sequences", whole(1, QUALITY_LIMIT), flag="--quality")

    @property
    def encoding(self) -> Encoding:
        """The encoding of stills.

        Raises:
            PictureError: a value that no format supports.
        """
        from wfluid.pictures.formats import Encoding

        return Encoding(self.type, self.compression, self.quality)


class SceneTables(SceneTable):
    """A scene."""

    wfluid: int = key("version of the format", version(VERSION), required=True)
    seed: int = key(
        "random seed of keyframes, and of noises without their own",
        whole(0, SEED_LIMIT),
        default=0,
        flag="--seed",
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
"""The table of a scene, with all its keys."""
