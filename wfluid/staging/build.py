"""Scenes made into animations: files read, pixels turned into lengths, names into what they stand for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from wfluid.animation.animation import Animation
from wfluid.animation.loops import check_loop
from wfluid.domain.envelopes import Constant, product
from wfluid.domain.limits import INK, KEYFRAME_STEPS, MORPH_TOLERANCE, MORPH_VISCOSITY, TOLERANCE, VISCOSITY
from wfluid.domain.paths import Place
from wfluid.domain.timeline import substeps_for
from wfluid.files.points import read_points
from wfluid.keyframes.keyframes import ParticleKeyframe, targets_of
from wfluid.model.densities import Density, PaintedSource, Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, LocalForce, flatten
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.morphing.morph import FLOW
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.color import linear_color
from wfluid.pictures.pairing import PicturePair, paired
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture
from wfluid.scene.forces import SEED_LIMIT
from wfluid.scene.format import (
    DensityTable,
    FramesTable,
    GroupTable,
    PictureTable,
    SourceTable,
)
from wfluid.scene.keyframes import FoundTable, MorphTable
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SchemaError, blame
from wfluid.staging.aims import Aims
from wfluid.staging.drawing import Drawing
from wfluid.staging.images import SAME_ASPECT, SceneImages
from wfluid.staging.timing import envelope_and_scale


def stage(
    scene: Scene, device: str | None = None, note: Callable[[str], None] = lambda text: None
) -> Animation:
    """The animation that a scene describes; `note` is called with what a user should know.

    Raises:
        SceneError: a value that makes no sense, with its key and line.
        PictureError: a file that cannot be read.
    """
    return stage_all(scene, device, note).animation


@dataclass(frozen=True)
class Staged:
    """What a scene describes."""

    animation: Animation
    """Its animation, of a morph the flow."""
    aims: Aims | None = None
    """What it wants of its points, if it has keyframes."""
    pair: PicturePair | None = None
    """The pictures of a morph."""
    settings: MorphSettings | None = None
    """How a morph goes."""


def stage_all(
    scene: Scene, device: str | None = None, note: Callable[[str], None] = lambda text: None
) -> Staged:
    """All that a scene describes.

    Raises:
        SceneError: as `stage`.
        PictureError: as `stage`.
    """
    try:
        builder = _Builder(scene, note)
        return Staged(builder.animation(device), builder.aims, builder.pair, builder.settings)
    except SchemaError as error:
        raise scene.error(error) from error


class _Builder:
    """What the tables of one scene refer to."""

    def __init__(self, scene: Scene, note: Callable[[str], None]):
        self.scene, self.note = scene, note
        self._fluid()  # what is wrong without files is refused before they are read
        self.timeline = FLOW if scene.morph else scene.timeline
        self.picture = self._read(scene.picture.file)
        self.images = SceneImages(self.picture, scene.folder, note)
        self.drawing = self._drawing()
        self.pair = self.settings = self.aims = None
        if scene.morph:
            with blame("morph", "to"):
                self.pair = self._pair(scene.morph)
            with blame("morph"):
                self.settings = self._morph_settings(scene.morph)
        if scene.keyframes:
            with blame("keyframes"):
                self.aims = self._aims()

    def animation(self, device: str | None) -> Animation:
        """All of it together."""
        scene = self.scene
        with blame("frames"):
            width, height = _size(scene.frames, self.picture)
        fluid, forces, layers, points = self._whole_fluid(), self._forces(), self._layers(), self._points()
        if scene.time.loop:
            with blame("time", "loop"):
                check_loop(scene.time.loop, flatten(forces))
        with blame("frames"):
            return Animation(
                self.picture,
                fluid,
                forces,
                self.timeline,
                cells=scene.fluid.cells,
                width=width,
                height=height,
                filter=scene.frames.filter,
                edge=scene.frames.edge,
                device=device,
                layers=layers,
                points=points,
                loop=scene.time.loop,
            )

    def _read(self, name: str) -> Picture:
        """A picture of the scene, with notes on how it was read."""
        picture = read_picture(self.scene.folder / name, self.scene.picture.colorspace)
        for text in picture.notes:
            self.note(f"{name}: {text}")
        return picture

    def _pair(self, morph: MorphTable) -> PicturePair:
        """The two pictures of a morph."""
        other = self._read(morph.to)
        pair = paired(self.picture, other, morph.fit)
        for text in pair.notes:
            self.note(text)
        _drawn_size(morph, "morph", other)
        return pair

    def _morph_settings(self, morph: MorphTable) -> MorphSettings:
        """How a morph goes."""
        curves = {}
        for name in ("warp_curve", "blend_curve"):
            curve = getattr(morph, name)
            curves[name] = curve if isinstance(curve, str) else dict(curve)
            if len(curves[name]) < len(curve):
                raise ValueError(f"{name}: two keys have one time")
        if morph.timing is None and morph.gives("delay"):
            raise ValueError("delay needs a timing mask")
        return MorphSettings(
            self.scene.timeline,
            **curves,
            blend=morph.blend,
            mask=None if morph.timing is None else self.images.painted(morph.timing),
            delay=morph.delay,
            reverse=morph.reverse,
            pingpong=morph.pingpong,
        )

    def _place_in_b(self, place: Place) -> Place:
        """Where in the frame a point of a morph's second picture is seen [longer side]."""
        (width, height), size = self.pair.size, self.scene.morph.size or self.pair.size
        x, y = place[0] / size[0] * width, place[1] / size[1] * height
        side = self.drawing.side
        return self.pair.place((x, y), (self.drawing.width / side, self.drawing.height / side))

    def _drawing(self) -> Drawing:
        """What the numbers of the scene's forces refer to."""
        scene = self.scene
        width, height = _drawn_size(scene.picture, "picture", self.picture)
        plain = Drawing(width, height, self.timeline.duration, scene.fluid.scheme, scene.time.loop)
        envelopes, weight, frozen = {}, None, None
        for name, table in scene.envelopes.items():
            with blame("envelopes", name):
                envelopes[name] = plain.envelope(table)
        if scene.effect:
            with blame("effect", "mask"):
                weight = self.images.mask(scene.effect.mask)
        if scene.freeze:
            with blame("freeze"):
                frozen = self.images.freeze(scene.freeze)
        return replace(plain, envelopes=envelopes, weight=weight, frozen=frozen, images=self.images)

    def _aims(self) -> Aims:
        """The keyframes; every one on a step of the timeline, which is refined where that does it."""
        keyframes, morph, drawing = self.scene.keyframes, self.scene.morph, self.drawing
        moves = list(self._moves())
        if self.timeline.substeps is None:
            times = [time for _, _, _, time, _ in moves]
            substeps = substeps_for(times, self.timeline.fps, KEYFRAME_STEPS)
            self.timeline = replace(self.timeline, substeps=substeps)
        found = []
        for path, start, end, time, weight in moves:
            with blame(*path):
                destination = self._place_in_b(end) if morph else drawing.place("to", end)
                place, time = drawing.place("from", start), self._on_step(time)
                found.append(ParticleKeyframe(place, destination, time, weight))
        side, tolerance = drawing.side, MORPH_TOLERANCE if morph else TOLERANCE
        aims = Aims(
            tuple(found),
            tuple(drawing.place("a pin", pin) for pin in keyframes.pins),
            tuple(_found(force, side) for force in keyframes.found),
            tolerance if keyframes.tolerance is None else keyframes.tolerance / side,
            self.scene.seed,
            side,
        )
        extent = drawing.width / side, drawing.height / side
        targets_of(aims.keyframes, aims.pins, extent, self.timeline.end, side)
        if self.scene.time.loop:
            loop = self.scene.time.loop
            raise ValueError(f"a loop ({loop}) goes without keyframes: its end is its beginning")
        return aims

    def _moves(self) -> Iterator[tuple[tuple, Place, Place, float, float]]:
        """Every move's path in the scene, start and goal [px], time [s] and weight."""
        keyframes = self.scene.keyframes
        latest = self.timeline.duration if keyframes.time is None else keyframes.time
        for n, move in enumerate(keyframes.moves):
            time = latest if move.time is None else move.time
            yield ("keyframes", "move", n), move.start, move.to, time, move.weight
        if keyframes.points is None:
            return
        path = ("keyframes", "points")
        for row in read_points(self.scene.folder / keyframes.points):
            if self.scene.morph and row.time is not None:
                raise SchemaError(path, "a morph goes without times: its points arrive at its end")
            yield path, row.source, row.target, latest if row.time is None else row.time, 1.0

    def _on_step(self, time: float) -> float:
        """The time of the nearest step; noted where that is another."""
        timeline = self.timeline
        step = max(1, round(time / timeline.dt))
        near = timeline.time_of(step)
        if abs(near - time) > 1e-6 * timeline.dt and time <= timeline.end:
            self.note(f"a keyframe at {time:g} s is met at {near:.6g} s, when a step ends")
            return near
        return near if time <= timeline.end else time

    def _fluid(self, **more: Any) -> Fluid:
        fluid = self.scene.fluid
        with blame("fluid"):
            return Fluid(
                walls=fluid.walls,
                scheme=fluid.scheme,
                solver=fluid.solver,
                pressure_cycles=fluid.pressure_cycles,
                **more,
            )

    def _whole_fluid(self) -> Fluid:
        """The fluid with all that is painted and dissolved."""
        viscosity, densities = self.scene.viscosity, []
        usual = MORPH_VISCOSITY if self.scene.morph and not viscosity.given else VISCOSITY
        with blame("viscosity"):
            value = self.images.viscosity(viscosity, usual)
        for n, table in enumerate(self.scene.densities):
            with blame("density", n):
                densities.append(self._density(table))
        return self._fluid(
            viscosity=value,
            viscosity_moves=viscosity.moves,
            freeze=self.drawing.frozen,
            densities=densities,
        )

    def _density(self, density: DensityTable) -> Density:
        name = f"density {density.name}"
        if density.gives("amount") and density.image is None:
            raise ValueError(f"{name}: amount is that of an image; a source has its own")
        image = density.image
        return Density(
            density.name,
            density.diffusion,
            None if image is None else self.images.painted(image, density.amount),
            [self._source(f"a source of {name}", source) for source in density.sources],
            INK if density.color is None else linear_color(density.color),
            density.look,
        )

    def _source(self, what: str, source: SourceTable) -> Source | PaintedSource:
        """A source that pours its amount in all, over its window."""
        drawing = self.drawing
        plain, _ = envelope_and_scale(what, source, drawing.duration)
        rate = source.amount / plain.integral(0.0, drawing.duration)
        envelope = drawing.modulated(what, plain, source)
        if source.image is None:
            return Source(drawing.center(what, source), rate, drawing.radius(source), envelope)
        if source.gives("center", "path", "radius"):
            raise ValueError(f"{what}: an image goes without center, path and radius")
        return PaintedSource(self.images.painted(source.image), rate * envelope)

    def _forces(self) -> list[Force | Group]:
        """The forces, those of a group together."""
        found: list[Force | Group] = []
        members: dict[str | None, list] = {None: found}
        members |= {group.name: [] for group in self.scene.groups}
        for n, table in enumerate(self.scene.forces):
            with blame("force", n):
                force = self.drawing.force(table, (self.scene.seed + n) % (SEED_LIMIT + 1))
            self._note_small(n, force)
            members[table.group].append(force)
        for n, group in enumerate(self.scene.groups):
            with blame("group", n):
                found.append(self._group(group, members[group.name]))
        return found

    def _note_small(self, n: int, force: Force) -> None:
        """Note where a force is smaller than a cell, whose motion then depends on where in it it lies."""
        cell = 1 / self.scene.fluid.cells
        if isinstance(force, LocalForce) and force.radius < cell:
            side = self.drawing.side
            self.note(
                f"force.{n}: its radius of {force.radius * side:g} px is less than a cell of the fluid, "
                f"{cell * side:.3g} px; use more cells"
            )

    def _group(self, group: GroupTable, members: list[Force]) -> Group:
        common = product(group.strength, *self.drawing.named(f"group {group.name}", group.envelope))
        return Group(members, common, name=group.name)

    def _layers(self) -> dict[str, Picture]:
        return {layer.name: self.images.layer(layer.file, layer.data) for layer in self.scene.layers}

    def _points(self) -> list[Place]:
        with blame("tracks", "points"):
            return [self.drawing.place("a point", at) for at in self.scene.tracks.points]


def _drawn_size(table: PictureTable | MorphTable, name: str, picture: Picture) -> tuple[float, float]:
    """Width and height of the frame that a table's pixels refer to: its `size`, or the picture's."""
    width, height = table.size or (picture.width, picture.height)
    if min(width, height) <= 0:
        raise SchemaError((name, "size"), f"{width:g} x {height:g}: expected positive numbers")
    if abs(width / height * picture.height / picture.width - 1) > SAME_ASPECT:
        raise SchemaError(
            (name, "size"),
            f"the scene is drawn for {width:g} x {height:g} pixels, the picture's "
            f"{picture.width} x {picture.height} have another aspect",
        )
    return width, height


def _found(force: FoundTable, side: float) -> GaussianForce:
    """A force found before."""
    (x, y), (a, b) = force.center, force.vector
    window = Constant(force.start, force.end)
    return GaussianForce((x / side, y / side), (a / side, b / side), force.radius / side, window)


def found_table(force: GaussianForce, side: float) -> dict[str, Any]:
    """The table of a force that was found, whose window is constant; the inverse of how it is read."""
    window: Constant = force.envelope
    return {
        "center": [value * side for value in force.center],
        "vector": [value * side for value in force.vector],
        "radius": force.radius * side,
        "start": window.start,
        "end": window.end,
    }


def with_found(scene: Scene, found: Sequence[GaussianForce], side: float) -> Scene:
    """The scene with the forces that were found for its keyframes."""
    keyframes = {**scene.tables["keyframes"], "force": [found_table(force, side) for force in found]}
    return scene.with_tables({**scene.tables, "keyframes": keyframes})


def _size(frames: FramesTable, picture: Picture) -> tuple[int | None, int | None]:
    """Width and height of the frames."""
    width, scale = frames.width, frames.scale
    if width is None and scale is None:
        return None, None
    if width is not None and scale is not None:
        raise ValueError("width and scale both say the size: give one")
    width = width if scale is None else max(1, round(scale * picture.width))
    return width, max(1, round(width * picture.height / picture.width))
