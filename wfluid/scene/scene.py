"""Scenes: one TOML file that says a whole shot.

`scene_format` has the keys, `staging` makes the animation. Files are named relative to the scene's folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wfluid.domain.timeline import Timeline
from wfluid.files.names import FIRST_FRAME
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.scene.format import SCENE
from wfluid.scene.overrides import copied, parse_value, set_value
from wfluid.scene.paths import files_renamed
from wfluid.scene.schema import SceneError, SchemaError, checked, dotted, nearest

SHOWN = ("picture", "tracks", "report")
"""What an output may be of, beside layers and densities."""


@dataclass(frozen=True)
class Output:
    """A file, or a sequence of files, that a scene writes."""

    file: Path
    """Its name."""
    of: str = "picture"
    """What it shows: "picture", "tracks", "report", or a layer's or a density's name."""
    start: int = FIRST_FRAME
    """Number of a sequence's first frame."""
    encoding: Encoding = field(default_factory=Encoding)
    """How stills are written."""


@dataclass(frozen=True)
class Scene:
    """Tables of a shot, checked against `scene_format.SCENE`.

    Raises:
        SceneError: a key that is unknown, missing or has a wrong value; names that do not fit together.
    """

    tables: Mapping[str, Any]
    """Nested dictionaries and lists, as TOML gives them."""
    folder: Path = Path()
    """Where the names of files begin."""
    source: str = "scene"
    """What to call it in messages."""
    lines: Mapping[tuple, int] = field(default_factory=dict, repr=False, compare=False)
    """Line of the file by a key's path, where known."""
    flags: Mapping[tuple, str] = field(default_factory=dict, repr=False, compare=False)
    """What of a command line a key's path comes from, where the scene is one."""

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "tables", checked(SCENE, self.tables))
            self._check_names()
        except SchemaError as error:
            raise self.error(error) from None

    def error(self, error: SchemaError) -> SceneError:
        """What is wrong with a key, with the scene's name and line, or with the flag it comes from."""
        path = error.path
        for end in range(len(path), 0, -1):
            if path[:end] in self.flags:
                flag, inner = self.flags[path[:end]], path[end:]
                if inner or " " in flag or not error.about_value:
                    flag = f"{flag}: {dotted(inner)}:" if inner else f"{flag}:"
                return SceneError(f"{flag} {error.reason}")
            if path[:end] in self.lines:
                return SceneError(f"{self.source}:{self.lines[path[:end]]}: {error}")
        return SceneError(f"{self.source}: {error}")

    def _check_names(self) -> None:
        """Refuse names that nothing has."""
        tables = self.tables
        if "picture" not in tables:
            raise SchemaError((), "[picture] is missing: what is animated")
        groups = [group["name"] for group in tables.get("group", [])]
        layers = [layer["name"] for layer in tables.get("layer", [])]
        densities = [density["name"] for density in tables.get("density", [])]
        envelopes = list(tables.get("envelopes", {}))
        for n, force in enumerate(tables.get("force", [])):
            _one_of(("force", n, "group"), force.get("group"), groups)
            if force["kind"] == "buoyancy":
                _one_of(("force", n, "density"), force["density"], densities)
        for path, names in _envelope_uses(tables):
            for name in names:
                _one_of(path, name, envelopes)
        for n, name in enumerate([*layers, *densities]):
            kind, index = ("layer", n) if n < len(layers) else ("density", n - len(layers))
            if name in SHOWN or name in [*layers, *densities][:n]:
                raise SchemaError(
                    (kind, index, "name"), f"{name!r} is taken: outputs could not tell them apart"
                )
        for n, output in enumerate(tables.get("output", [])):
            _one_of(("output", n, "of"), output.get("of"), [*SHOWN, *layers, *densities])
            if output.get("of") == "tracks" and not tables.get("tracks", {}).get("points"):
                raise SchemaError(("output", n, "of"), "no point is followed: give [tracks] points")

        if "morph" in tables:
            self._check_morph(tables)

    @staticmethod
    def _check_morph(tables: Mapping[str, Any]) -> None:
        """Refuse what a morph has no use for."""
        keyframes = tables.get("keyframes", {})
        if not (keyframes.get("move") or "points" in keyframes):
            raise SchemaError(("keyframes",), "a morph needs points of both pictures: give move or points")
        for key in ("force", "group", "density", "layer", "tracks", "effect"):
            if tables.get(key):
                raise SchemaError((key,), "a morph goes without: its flow follows from its points")
        time, reason = tables.get("time", {}), "a morph goes without: its flow has steps of its own"
        if "substeps" in time:
            raise SchemaError(("time", "substeps"), reason)
        if "loop" in time:
            raise SchemaError(("time", "loop"), "a morph goes without: set pingpong of [morph]")
        moves = [
            ("keyframes", "move", n, "time")
            for n, move in enumerate(keyframes.get("move", []))
            if "time" in move
        ]
        for path in [*([("keyframes", "time")] if "time" in keyframes else []), *moves]:
            raise SchemaError(path, "a morph goes without: its points arrive at its end")

    def with_values(self, settings: Sequence[str]) -> Scene:
        """The scene with some values set, each as "path=value"; the value is TOML, or else a text.

        An item of a list is named by its number from 0, or by its name.

        Raises:
            SceneError: a setting without "=", a path that leads nowhere, or a value that is wrong.
        """
        tables = copied(self.tables)
        for setting in settings:
            path, equals, value = setting.partition("=")
            if not equals or not path.strip():
                raise SceneError(f"--set {setting!r}: expected key=value, such as time.duration=3")
            set_value(tables, path.strip().split("."), parse_value(value), setting)
        return Scene(tables, self.folder, self.source, self.lines, self.flags)

    def writing(self, pictures: Sequence[str], report: str | None) -> Scene:
        """The scene with these outputs in the current folder, not its own of the picture; and a report."""
        tables = copied(self.tables)
        outputs = tables.setdefault("output", [])
        here = [os.path.abspath(name) for name in pictures]
        if here:
            outputs[:] = [output for output in outputs if output.get("of", "picture") != "picture"]
        outputs += [{"file": name} for name in here]
        outputs += [{"file": os.path.abspath(report), "of": "report"}] if report else []
        return Scene(tables, self.folder, self.source, self.lines, self.flags)

    def moved(self, folder: Path) -> Scene:
        """The same scene for a file in another folder: its names of files begin there."""

        def renamed(name: str) -> str:
            if os.path.isabs(name):
                return name
            return os.path.relpath(self.folder / name, folder)

        return Scene(files_renamed(SCENE, self.tables, renamed), folder, self.source, self.lines, self.flags)

    def files(self) -> list[Path]:
        """Every file that the scene reads."""
        found: list[str] = []
        files_renamed(SCENE, {**self.tables, "output": []}, lambda name: found.append(name) or name)
        return [self.folder / name for name in found]

    @property
    def outputs(self) -> list[Output]:
        """What is written.

        Raises:
            SceneError: an encoding that no format has.
        """
        found = []
        for n, table in enumerate(self.tables.get("output", [])):
            try:
                encoding = Encoding(table.get("type"), table.get("compression"), table.get("quality"))
            except PictureError as error:
                raise self.error(SchemaError(("output", n), str(error))) from None
            of, start = table.get("of", "picture"), table.get("start", FIRST_FRAME)
            found.append(Output(self.folder / table["file"], of, start, encoding))
        return found

    @property
    def frame_count(self) -> int:
        """Frames that are written, at most.

        Raises:
            SceneError: as `timeline`.
        """
        frames = self.timeline.frames
        return 2 * frames - 2 if self.tables.get("morph", {}).get("pingpong") else frames

    @property
    def _last_keyframe(self) -> float | None:
        """The latest time that keyframes name [s]; None if they name none."""
        keyframes = self.tables.get("keyframes", {})
        named = [table["time"] for table in (keyframes, *keyframes.get("move", [])) if "time" in table]
        return max(named, default=None)

    @property
    def timeline(self) -> Timeline:
        """When frames are shown.

        Raises:
            SceneError: a length or a rate that makes no sense.
        """
        time = self.tables.get("time", {})
        fps, latest = time.get("fps", 15.0), self._last_keyframe
        until = math.ceil(latest * fps - 1e-6) / fps if latest else 2.0  # no frame falls short of it
        try:
            return Timeline(time.get("duration", until), fps, time.get("substeps"))
        except ValueError as error:
            raise self.error(SchemaError(("time",), str(error))) from None


def _one_of(path: tuple, name: str | None, known: Sequence[str]) -> None:
    if name is not None and name not in known:
        there = f"there is {', '.join(known)}" if known else "there is none"
        raise SchemaError(path, f"{name!r}: no such {path[-1]}; {there}{nearest(name, known)}")


def _envelope_uses(tables: Mapping[str, Any]) -> Iterator[tuple[tuple, list[str]]]:
    for kind in ("force", "group"):
        for n, table in enumerate(tables.get(kind, [])):
            yield (kind, n, "envelope"), table.get("envelope", [])
    for n, density in enumerate(tables.get("density", [])):
        for m, source in enumerate(density.get("source", [])):
            yield ("density", n, "source", m, "envelope"), source.get("envelope", [])
