"""Scenes made into animations: files are read, pixels become domain units, names become objects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from wfluid.animation.animation import Animation
from wfluid.animation.loops import acting_time, check_loop
from wfluid.domain.envelopes import product
from wfluid.domain.grid import Grid
from wfluid.domain.limits import INK, KEYFRAME_STEPS, MORPH_VISCOSITY, VISCOSITY
from wfluid.domain.paths import Place
from wfluid.domain.timeline import substeps_for
from wfluid.domain.walls import Walls
from wfluid.model.densities import Density, PaintedSource, Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, LocalForce, flatten
from wfluid.morphing.morph import FLOW
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.color import linear_color
from wfluid.pictures.pairing import PicturePair
from wfluid.pictures.picture import Picture
from wfluid.scene.forces import SEED_LIMIT
from wfluid.scene.format import DensityTable, FramesTable, GroupTable, SourceTable
from wfluid.scene.keyframes import KeyframesTable, MorphTable
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SchemaError, blame
from wfluid.staging.aims import Aims, aims_of, moves_of
from wfluid.staging.arrows import longest_arrow
from wfluid.staging.drawing import Drawing
from wfluid.staging.images import SceneImages, frame_size, read_noted
from wfluid.staging.morphs import pair_of, place_in_second, settings_of
from wfluid.staging.stillness import STILLNESS_CELLS, why_still
from wfluid.staging.timing import envelope_and_scale


def stage(
    scene: Scene, device: str | None = None, note: Callable[[str], None] = lambda text: None
) -> Animation:
    """The animation of a scene, of a morph the flow; `note` is called with warnings for the user.

    Raises:
        SceneError: a value that contradicts others or lies outside its range, with its key and line.
        PictureError: a file that cannot be read.
    """
    return stage_all(scene, device, note).animation


@dataclass(frozen=True)
class Staged:
    """A scene as objects."""

    animation: Animation
    """The animation; of a morph the flow."""
    arrow: float | None
    """The longest arrow that is drawn [longer side]; None if not everything that moves has one."""


@dataclass(frozen=True)
class StagedKeyframes(Staged):
    """A scene with keyframes as objects."""

    aims: Aims
    """Its keyframes."""


@dataclass(frozen=True)
class StagedMorph(StagedKeyframes):
    """A morph as objects."""

    pair: PicturePair
    """Its two pictures."""
    settings: MorphSettings
    """Timing, curves and blending."""


def stage_all(
    scene: Scene, device: str | None = None, note: Callable[[str], None] = lambda text: None
) -> Staged:
    """The animation of a scene, with its keyframes and its morph.

    Raises:
        SceneError: as `stage`.
        PictureError: as `stage`.
    """
    try:
        builder = _Builder(scene, note)
        if scene.keyframes is None:
            return Staged(builder.animation(device), builder.arrow())
        if scene.morph is None:
            aims = builder.aims(scene.keyframes, partial(builder.drawing.place, "to"))
            return StagedKeyframes(builder.animation(device), builder.arrow(aims), aims)
        pair, settings = builder.morph(scene.morph)
        second = partial(place_in_second, morph=scene.morph, pair=pair, drawing=builder.drawing)
        aims = builder.aims(scene.keyframes, second)
        return StagedMorph(builder.animation(device), builder.arrow(aims), aims, pair, settings)
    except SchemaError as error:
        raise scene.error(error) from error


class _Builder:
    """Builds the objects of one scene, in the order in which they need each other."""

    def __init__(self, scene: Scene, note: Callable[[str], None]):
        self.scene, self.note = scene, note
        self._fluid()  # errors that need no files come before the files are read
        self.timeline = FLOW if scene.morph else scene.timeline
        self.picture = read_noted(scene.folder, scene.picture.file, note, scene.picture.colorspace)
        self.images = SceneImages(self.picture, scene.folder, note)
        self.drawing = self._drawing()

    def morph(self, morph: MorphTable) -> tuple[PicturePair, MorphSettings]:
        """The two pictures of a morph, and its settings."""
        with blame("morph", "to"):
            pair = pair_of(self.scene, morph, self.images)
        with blame("morph"):
            return pair, settings_of(self.scene, morph, self.images)

    def aims(self, keyframes: KeyframesTable, destination: Callable[[Place], Place]) -> Aims:
        """The keyframes; refines the timeline, where its substeps are free, so that each is on a step."""
        with blame("keyframes"):
            moves = list(moves_of(self.scene, keyframes, self.timeline.duration))
            if self.timeline.substeps is None:
                times = [move.time for move in moves]
                substeps = substeps_for(times, self.timeline.fps, KEYFRAME_STEPS)
                self.timeline = replace(self.timeline, substeps=substeps)
            return aims_of(self.scene, keyframes, moves, self.drawing, self.timeline, destination, self.note)

    def arrow(self, aims: Aims | None = None) -> float | None:
        """The longest arrow [longer side]."""
        return longest_arrow(self.scene, self.drawing.side, aims)

    def animation(self, device: str | None) -> Animation:
        """The animation."""
        scene = self.scene
        with blame("frames"):
            width, height = _size(scene.frames, self.picture)
        fluid, forces, layers, points = self._complete_fluid(), self._forces(), self._layers(), self._points()
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
                units_checked=True,
                balanced=not (scene.keyframes or self._creeping) and scene.fluid.scheme != "paper",
            )

    def _drawing(self) -> Drawing:
        """The frame, times, envelopes and masks that the scene's forces refer to."""
        scene = self.scene
        width, height = frame_size(scene.picture.size, "picture", self.picture)
        acting = acting_time(scene.time.loop, self.timeline)
        plain = Drawing(width, height, acting, scene.fluid.scheme, scene.time.loop)
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

    def _fluid(self, **more: Any) -> Fluid:
        fluid = self.scene.fluid
        with blame("fluid"):
            return Fluid(
                walls=fluid.walls,
                scheme=fluid.scheme,
                inertia=not self._creeping,
                solver=fluid.solver,
                pressure_cycles=fluid.pressure_cycles,
                diffusion_tolerance=fluid.diffusion_tolerance,
                **more,
            )

    @property
    def _creeping(self) -> bool:
        """Whether the fluid creeps: by default for keyframes that no forces disturb."""
        scene = self.scene
        if scene.fluid.creeping is None:
            return bool(scene.keyframes or scene.morph) and not scene.forces and scene.fluid.scheme != "paper"
        return scene.fluid.creeping

    def _complete_fluid(self) -> Fluid:
        """The fluid with viscosity, freezing and densities."""
        viscosity, densities = self.scene.viscosity, []
        default = MORPH_VISCOSITY if self.scene.morph and not viscosity.given else VISCOSITY
        with blame("viscosity"):
            value = self.images.viscosity(viscosity, default)
        for n, table in enumerate(self.scene.densities):
            with blame("density", n):
                densities.append(self._density(table))
        return self._fluid(
            viscosity=value,
            viscosity_moves=viscosity.moves,
            freeze=self.drawing.frozen,
            densities=densities,
            **self._loss(),
        )

    def _loss(self) -> dict[str, float]:
        """`diffusion_loss` in longer sides, if the scene gives it in pixels."""
        loss = self.scene.fluid.diffusion_loss
        return {} if loss is None else {"diffusion_loss": loss / self.drawing.side}

    def _density(self, density: DensityTable) -> Density:
        name = f"density {density.name}"
        if density.gives("amount") and density.image is None:
            raise ValueError(f"{name}: amount belongs to an image: give image, or the amount of a source")
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
        """A source that pours its total amount over its window."""
        drawing = self.drawing
        plain, _ = envelope_and_scale(what, source, drawing.duration)
        rate = source.amount / plain.integral(0.0, drawing.duration)
        envelope = drawing.modulated(what, plain, source)
        if source.image is None:
            return Source(drawing.center(what, source), rate, drawing.radius(source), envelope)
        if source.gives("center", "path", "radius"):
            raise ValueError(f"{what}: an image excludes center, path and radius")
        return PaintedSource(self.images.painted(source.image), rate * envelope)

    def _forces(self) -> list[Force | Group]:
        """The forces; those of a group follow together."""
        found: list[Force | Group] = []
        members: dict[str | None, list] = {None: found}
        members |= {group.name: [] for group in self.scene.groups}
        for n, table in enumerate(self.scene.forces):
            with blame("force", n):
                force = self.drawing.force(table, (self.scene.seed + n) % (SEED_LIMIT + 1))
            self._note_small(n, force)
            self._note_still(n, force)
            members[table.group].append(force)
        for n, group in enumerate(self.scene.groups):
            with blame("group", n):
                found.append(self._group(group, members[group.name]))
        return found

    def _note_small(self, n: int, force: Force) -> None:
        """Note a force smaller than a cell: its motion depends on its place within the cell."""
        cell = 1 / self.scene.fluid.cells
        if isinstance(force, LocalForce) and force.radius < cell:
            side = self.drawing.side
            self.note(
                f"force.{n}: its radius of {force.radius * side:g} px is less than a cell of the fluid, "
                f"{cell * side:.3g} px; use more cells"
            )

    def _note_still(self, n: int, force: Force) -> None:
        """Note a force that walls, masks or frozen parts hold back, with the reason."""
        drawing = self.drawing
        grid = Grid.for_picture(self.picture.width, self.picture.height, STILLNESS_CELLS)
        why = why_still(force, Walls.parse(self.scene.fluid.walls), drawing.frozen, grid)
        if why:
            self.note(f"{self.scene.flags.get(('force', n), f'force.{n}')}: {why}")

    def _group(self, group: GroupTable, members: list[Force]) -> Group:
        common = product(group.strength, *self.drawing.named(f"group {group.name}", group.envelope))
        return Group(members, common, name=group.name)

    def _layers(self) -> dict[str, Picture]:
        return {layer.name: self.images.layer(layer.file, layer.data) for layer in self.scene.layers}

    def _points(self) -> list[Place]:
        with blame("tracks", "points"):
            return [self.drawing.place("a point", at) for at in self.scene.tracks.points]


def _size(frames: FramesTable, picture: Picture) -> tuple[int | None, int | None]:
    """Width and height of the frames; None for the picture's."""
    width, scale = frames.width, frames.scale
    if width is not None and scale is not None:
        raise ValueError("width and scale both set the size: give one")
    if scale is not None:
        width = max(1, round(scale * picture.width))
    if width is None:
        return None, None
    return width, max(1, round(width * picture.height / picture.width))
