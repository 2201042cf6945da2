"""Scenes made into animations: files read, pixels turned into lengths, names into what they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from wfluid.animation.animation import Animation
from wfluid.animation.loops import check_loop
from wfluid.domain.envelopes import Constant, product
from wfluid.domain.paths import Place
from wfluid.domain.timeline import Timeline, substeps_for
from wfluid.files.points import read_points
from wfluid.keyframes.keyframes import TOLERANCE, ParticleKeyframe, targets_of
from wfluid.model.densities import Density, PaintedSource, Source
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, LocalForce, flatten
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Painted
from wfluid.morphing.morph import FLOW
from wfluid.morphing.morph import TOLERANCE as MORPH_TOLERANCE
from wfluid.morphing.morph import VISCOSITY as MORPH_VISCOSITY
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.color import linear_color
from wfluid.pictures.formats import PictureError
from wfluid.pictures.pairing import PicturePair, paired
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SchemaError
from wfluid.staging.aims import Aims
from wfluid.staging.drawing import Drawing
from wfluid.staging.images import SAME_ASPECT, SceneImages, named
from wfluid.staging.timing import envelope_and_scale

KEYFRAME_STEPS = 48
"""Least steps a second of a scene with keyframes that does not say how many a frame has."""


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
        staged = _Stage(scene, note)
        return Staged(staged.animation(device), staged.aims, staged.pair, staged.settings)
    except SchemaError as error:
        raise scene.error(error) from error


class _Stage:
    """What the tables of one scene refer to."""

    def __init__(self, scene: Scene, note: Callable[[str], None]):
        self.scene, self.tables, self.note = scene, scene.tables, note
        self._fluid()  # what is wrong without files is said before they are read
        self.morph = self.tables.get("morph")
        self.timeline = FLOW if self.morph else scene.timeline
        self.loop = self.tables.get("time", {}).get("loop")
        picture = self.tables["picture"]
        self.picture = read_picture(scene.folder / picture["file"], picture.get("colorspace", "auto"))
        self.paintings = SceneImages(self.picture, scene.folder, note)
        self.drawing = self._drawing()
        self.pair = _at(("morph", "to"), self._pair) if self.morph else None
        self.settings = _at(("morph",), self._morph_settings) if self.morph else None
        self.aims = _at(("keyframes",), self._aims) if "keyframes" in self.tables else None

    def animation(self, device: str | None) -> Animation:
        """All of it together."""
        frames, cells = self.tables.get("frames", {}), self.tables.get("fluid", {}).get("cells", 256)
        width, height = _at(("frames",), lambda: _size(frames, self.picture))
        fluid, forces, layers, points = self._whole_fluid(), self._forces(), self._layers(), self._points()

        def make() -> Animation:
            return Animation(
                self.picture,
                fluid,
                forces,
                self.timeline,
                cells=cells,
                width=width,
                height=height,
                filter=frames.get("filter", "cubic"),
                edge=frames.get("edge", "clamp"),
                device=device,
                layers=layers,
                points=points,
                loop=self.loop,
            )

        if self.loop:
            _at(("time", "loop"), lambda: check_loop(self.loop, flatten(forces)))
        return _at(("frames",), make)

    def _pair(self) -> PicturePair:
        """The two pictures of a morph."""
        name = self.scene.folder / self.morph["to"]
        other = read_picture(name, self.tables["picture"].get("colorspace", "auto"))
        pair = paired(self.picture, other, self.morph.get("fit", "fill"))
        for text in pair.notes:
            self.note(text)
        _drawn_size(self.tables, "morph", other)
        return pair

    def _morph_settings(self) -> MorphSettings:
        """How a morph goes."""
        given = {
            key: self.morph[key]
            for key in ("warp_curve", "blend_curve", "blend", "delay", "reverse", "pingpong")
            if key in self.morph
        }
        for key in ("warp_curve", "blend_curve"):
            keys = given.get(key, "")
            if not isinstance(keys, str):
                given[key] = dict(keys)
                if len(given[key]) < len(keys):
                    raise ValueError(f"{key}: two keys have one time")
        if "timing" in self.morph:
            name = self.morph["timing"]
            given["mask"] = named(name, lambda: Painted(self.paintings.paint(name)))
        elif "delay" in given:
            raise ValueError("delay needs a timing mask")
        return MorphSettings(self.scene.timeline, **given)

    def _place_in_b(self, what: str, place: list[float]) -> Place:
        """Where in the frame a point of a morph's second picture is seen [longer side]."""
        (width, height), size = self.pair.size, self.morph.get("size", self.pair.size)
        x, y = place[0] / size[0] * width, place[1] / size[1] * height
        side = self.drawing.side
        return self.pair.place((x, y), (self.drawing.width / side, self.drawing.height / side))

    def _drawing(self) -> Drawing:
        """What the numbers of the scene's forces refer to."""
        tables = self.tables
        width, height = _drawn_size(tables, "picture", self.picture)
        settings = {
            "width": width,
            "height": height,
            "duration": self.timeline.duration,
            "scheme": tables.get("fluid", {}).get("scheme", "standard"),
            "loop": self.loop,
        }
        plain = Drawing(**settings)
        envelopes = {
            name: _at(("envelopes", name), lambda name=name, table=table: plain.envelope(name, table))
            for name, table in tables.get("envelopes", {}).items()
        }
        mask = tables.get("effect", {}).get("mask")
        return Drawing(
            **settings,
            envelopes=envelopes,
            weight=_at(("effect", "mask"), lambda: self.paintings.mask(mask)),
            frozen=_at(("freeze",), lambda: self.paintings.freeze(tables.get("freeze"))),
            paintings=self.paintings,
        )

    def _aims(self) -> Aims:
        """The keyframes; every one on a step of the timeline, which is refined where that does it."""
        table, drawing = self.tables["keyframes"], self.drawing
        latest = table.get("time", self.timeline.duration)
        moves = []
        for n, move in enumerate(table.get("move", [])):
            time, weight = move.get("time", latest), move.get("weight", 1.0)
            moves.append((("keyframes", "move", n), move["from"], move["to"], time, weight))
        if "points" in table:
            for row in read_points(self.scene.folder / table["points"]):
                time = latest if row.time is None else row.time
                if self.morph and row.time is not None:
                    raise SchemaError(
                        ("keyframes", "points"), "a morph goes without times: its points arrive at its end"
                    )
                moves.append((("keyframes", "points"), row.source, row.target, time, 1.0))
        timeline = self.timeline
        if timeline.substeps is None:
            substeps = substeps_for([move[3] for move in moves], timeline.fps, KEYFRAME_STEPS)
            timeline = self.timeline = replace(timeline, substeps=substeps)
        place = drawing.place
        place_to = self._place_in_b if self.morph else place

        def keyframe(a: list[float], b: list[float], time: float, weight: float) -> ParticleKeyframe:
            return ParticleKeyframe(
                place("from", a), place_to("to", b), self._on_step(time, timeline), weight
            )

        keyframes = tuple(_at(path, partial(keyframe, *numbers)) for path, *numbers in moves)
        side, tolerance = drawing.side, MORPH_TOLERANCE if self.morph else TOLERANCE
        aims = Aims(
            keyframes,
            tuple(place("a pin", pin) for pin in table.get("pins", [])),
            tuple(_found(found, side) for found in table.get("force", [])),
            table["tolerance"] / side if "tolerance" in table else tolerance,
            self.tables.get("seed", 0),
            side,
        )
        extent = drawing.width / side, drawing.height / side
        targets_of(aims.keyframes, aims.pins, extent, timeline.end, side)
        if self.loop:
            raise ValueError(f"a loop ({self.loop}) goes without keyframes: its end is its beginning")
        return aims

    def _on_step(self, time: float, timeline: Timeline) -> float:
        """The time of the nearest step; said where that is another."""
        step = max(1, round(time / timeline.dt))
        near = timeline.time_of(step)
        if abs(near - time) > 1e-6 * timeline.dt and time <= timeline.end:
            self.note(f"a keyframe at {time:g} s is met at {near:.6g} s, when a step ends")
            return near
        return near if time <= timeline.end else time

    def _fluid(self, **more: Any) -> Fluid:
        fluid = self.tables.get("fluid", {})
        keys = ("walls", "scheme", "solver", "pressure_cycles")
        return _at(("fluid",), lambda: Fluid(**{key: fluid[key] for key in keys if key in fluid}, **more))

    def _whole_fluid(self) -> Fluid:
        """The fluid with all that is painted and dissolved."""
        viscosity, densities = self.tables.get("viscosity", {}), self.tables.get("density", [])
        if self.morph and not viscosity:
            viscosity = {"value": MORPH_VISCOSITY}
        return self._fluid(
            viscosity=_at(("viscosity",), lambda: self.paintings.viscosity(viscosity)),
            viscosity_moves=viscosity.get("moves", False),
            freeze=self.drawing.frozen,
            densities=[
                _at(("density", n), lambda table=table: self._density(table))
                for n, table in enumerate(densities)
            ],
        )

    def _density(self, table: Mapping[str, Any]) -> Density:
        name = f"density {table['name']}"
        given = {key: table[key] for key in ("name", "look", "diffusion") if key in table}
        if "color" in table:
            given["color"] = linear_color(table["color"])
        if "amount" in table and "image" not in table:
            raise ValueError(f"{name}: amount is that of an image; a source has its own")
        if "image" in table:
            given["initial"] = self.paintings.amount(table["image"], table.get("amount", 1.0))
        sources = [self._source(f"a source of {name}", source) for source in table.get("source", [])]
        return Density(sources=sources, **given)

    def _source(self, what: str, table: Mapping[str, Any]) -> Source | PaintedSource:
        """A source that pours its amount in all, over its window."""
        drawing = self.drawing
        plain, _ = envelope_and_scale(what, table, drawing.duration)
        rate = table.get("amount", 1.0) / plain.integral(0.0, drawing.duration)
        envelope = drawing.modulated(what, plain, table)
        if "image" not in table:
            return Source(drawing.center(what, table), rate, drawing.radius(table), envelope)
        if table.keys() & {"center", "path", "radius"}:
            raise ValueError(f"{what}: an image goes without center, path and radius")
        return PaintedSource(self.paintings.amount(table["image"], 1.0), rate * envelope)

    def _forces(self) -> list[Force | Group]:
        """The forces, those of a group together."""
        found: list[Force | Group] = []
        groups = self.tables.get("group", [])
        members: dict[str, list[Force]] = {group["name"]: [] for group in groups}
        for n, table in enumerate(self.tables.get("force", [])):
            if table["kind"] == "noise":
                table = {"seed": (self.tables.get("seed", 0) + n) % 2**32, **table}
            force = _at(("force", n), lambda table=table: self.drawing.force(table))
            self._note_small(n, force)
            members.get(table.get("group"), found).append(force)
        for n, group in enumerate(groups):
            found.append(_at(("group", n), lambda group=group: self._group(group, members[group["name"]])))
        return found

    def _note_small(self, n: int, force: Force) -> None:
        """Say where a force is smaller than a cell, whose motion then depends on where in it it lies."""
        cell = 1 / self.tables.get("fluid", {}).get("cells", 256)
        if isinstance(force, LocalForce) and force.radius < cell:
            side = self.drawing.side
            self.note(
                f"force.{n}: its radius of {force.radius * side:g} px is less than a cell of the fluid, "
                f"{cell * side:.3g} px; use more cells"
            )

    def _group(self, table: Mapping[str, Any], members: list[Force]) -> Group:
        name, strength = table["name"], table.get("strength", 1.0)
        common = product(strength, *self.drawing.named(f"group {name}", table.get("envelope", [])))
        return Group(members, common, name=name)

    def _layers(self) -> dict[str, Picture]:
        return {
            layer["name"]: self.paintings.layer(layer["file"], layer.get("data"))
            for layer in self.tables.get("layer", [])
        }

    def _points(self) -> list[tuple[float, float]]:
        points = self.tables.get("tracks", {}).get("points", [])
        return [_at(("tracks", "points"), lambda at=at: self.drawing.place("a point", at)) for at in points]


def _drawn_size(tables: Mapping[str, Any], key: str, picture: Picture) -> tuple[float, float]:
    """Width and height of the frame that a table's pixels refer to: its `size`, or the picture's."""
    width, height = tables[key].get("size", (picture.width, picture.height))
    if min(width, height) <= 0:
        raise SchemaError((key, "size"), f"{width:g} x {height:g}: expected positive numbers")
    if abs(width / height * picture.height / picture.width - 1) > SAME_ASPECT:
        raise SchemaError(
            (key, "size"),
            f"the scene is drawn for {width:g} x {height:g} pixels, the picture's "
            f"{picture.width} x {picture.height} have another aspect",
        )
    return width, height


def _found(table: Mapping[str, Any], side: float) -> GaussianForce:
    """A force found before."""
    (x, y), (a, b) = table["center"], table["vector"]
    window = Constant(table["start"], table["end"])
    return GaussianForce((x / side, y / side), (a / side, b / side), table["radius"] / side, window)


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
    return Scene(
        {**scene.tables, "keyframes": keyframes}, scene.folder, scene.source, scene.lines, scene.flags
    )


def _size(frames: Mapping[str, Any], picture: Picture) -> tuple[int | None, int | None]:
    """Width and height of the frames."""
    width, scale = frames.get("width"), frames.get("scale")
    if width is None and scale is None:
        return None, None
    if width is not None and scale is not None:
        raise ValueError("width and scale both say the size: give one")
    if scale is not None and not (math.isfinite(scale) and scale > 0):
        raise ValueError(f"scale {scale}: expected a positive number")
    width = width if scale is None else max(1, round(scale * picture.width))
    return width, max(1, round(width * picture.height / picture.width))


def _at(path: tuple, make: Callable[[], Any]) -> Any:
    """What `make` makes; where it refuses, the key is named."""
    try:
        return make()
    except (SchemaError, PictureError):
        raise
    except (ValueError, TypeError) as error:
        raise SchemaError(path, str(error)) from error
