"""Scenes: one TOML file describes one shot.

`format` defines the tables, `staging` makes the animation. File names are relative to the scene's folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wfluid.domain.timeline import Timeline
from wfluid.scene.checking import attributes_of, checked, parts, replaced
from wfluid.scene.format import DURATION, SCENE, SELF, SceneTables
from wfluid.scene.names import check_morph, check_names
from wfluid.scene.overrides import copied, parse_value, set_value
from wfluid.scene.schema import Key, SceneError, SchemaError, blame, dotted

COMMAND_LINE = "command line"
"""Source of a scene that no file holds."""


class Scene(SceneTables):
    """A shot: its tables as attributes, such as `scene.fluid.cells`, and its origin.

    Raises:
        SceneError: a key that is unknown, missing or has a wrong value; an unknown name.
    """

    tables: Mapping[str, Any]
    """The given keys as nested dictionaries and lists, as TOML has them."""
    folder: Path
    """The folder that file names are relative to."""
    source: str
    """The name of the scene in messages."""
    lines: Mapping[tuple, int]
    """Line in the file, by the path of a key."""
    flags: Mapping[tuple, str]
    """Flag of the command line, by the path of a key."""

    def __init__(
        self,
        tables: Mapping[str, Any],
        folder: Path = Path(),
        source: str = "scene",
        lines: Mapping[tuple, int] | None = None,
        flags: Mapping[tuple, str] | None = None,
    ):
        """Check the tables, nested dictionaries and lists as TOML has them."""
        vars(self).update(folder=folder, source=source, lines=lines or {}, flags=flags or {}, tables=tables)
        try:
            vars(self)["tables"] = checked(SCENE, tables)
            super().__init__(**attributes_of(SCENE, self.tables))
            check_names(self)
            if self.morph:
                check_morph(self.tables)
        except SchemaError as error:
            raise self.error(error) from None

    def error(self, error: SchemaError) -> SceneError:
        """The error of a key with the flag that set it, or with the name and line of the scene.

        The error of a table names the flags that set its keys.
        """
        path = error.path
        if path not in self.flags and (below := self._flags_below(path)):
            if self.source == COMMAND_LINE:
                return SceneError(f"{below}: {error.reason}")
            line = f"{self.source}:{self.lines[path]} with " if path in self.lines else ""
            return SceneError(f"{line}{below}: {error}")
        for end in range(len(path), 0, -1):
            if path[:end] in self.flags:
                flag, inner = self.flags[path[:end]], path[end:]
                if flag.startswith("--set "):
                    return SceneError(f"{flag}: {error}")
                if inner or " " in flag or not error.about_value:
                    flag = f"{flag}: {dotted(inner)}:" if inner else f"{flag}:"
                return SceneError(f"{flag} {error.reason}")
            if path[:end] in self.lines:
                return SceneError(f"{self.source}:{self.lines[path[:end]]}: {error}")
        return SceneError(f"{self.source}: {error}")

    def _flags_below(self, path: tuple) -> str:
        """The flags that set keys of the table at a path, without their values; --set with its value."""
        found = [
            flag if flag.startswith("--set ") else flag.partition(" ")[0]
            for key, flag in self.flags.items()
            if path and key[: len(path)] == path and len(key) > len(path) and _has(self.tables, key)
        ]
        return " and ".join(dict.fromkeys(found))

    def with_tables(self, tables: Mapping[str, Any]) -> Scene:
        """A scene with other tables and the same origin.

        Raises:
            SceneError: as `Scene`.
        """
        return Scene(tables, self.folder, self.source, self.lines, self.flags)

    def with_values(self, settings: Sequence[str]) -> Scene:
        """The scene with some values changed, each by "path=value"; the value is TOML, or else a text.

        An item of a list is given by its number, from 0, or by its name.

        Raises:
            SceneError: a setting without "=", an unknown path, or a wrong value.
        """
        if not settings:
            return self
        tables, flags = copied(self.tables), dict(self.flags)
        for setting in settings:
            path, equals, value = setting.partition("=")
            if not equals or not path.strip():
                raise SceneError(f"--set {setting!r}: expected key=value, such as time.duration=3")
            key = set_value(tables, path.strip().split("."), parse_value(value), setting)
            flags[key] = f"--set {setting}"
        return Scene(tables, self.folder, self.source, self.lines, flags)

    def writing(self, pictures: Sequence[str], report: str | None) -> Scene:
        """The scene with `pictures` in place of its outputs of the picture, and with a report.

        The names are relative to the current folder.
        """
        if not (pictures or report):
            return self
        tables = copied(self.tables)
        outputs = tables.setdefault("output", [])
        absolute = [os.path.abspath(name) for name in pictures]
        if absolute:
            outputs[:] = [output for output in outputs if output.get("of", "picture") != "picture"]
        outputs += [{"file": name} for name in absolute]
        outputs += [{"file": os.path.abspath(report), "of": "report"}] if report else []
        return self.with_tables(tables)

    def tables_in(self, folder: Path) -> dict[str, Any]:
        """The tables with file names relative to another folder."""

        def renamed(name: str) -> str:
            return name if os.path.isabs(name) else os.path.relpath(self.folder / name, folder)

        return replaced(
            SCENE, self.tables, lambda what, value: renamed(value) if _names_file(what, value) else value
        )

    def files(self) -> list[Path]:
        """Every file that the scene reads."""
        read = {name: value for name, value in self.tables.items() if name != "output"}
        return [self.folder / value for _, what, value in parts(SCENE, read) if _names_file(what, value)]

    @property
    def frame_count(self) -> int:
        """Largest number of frames written.

        Raises:
            SceneError: as `timeline`.
        """
        frames = self.timeline.frames
        return 2 * frames - 2 if self.morph and self.morph.pingpong else frames

    @property
    def timeline(self) -> Timeline:
        """The timeline of the frames.

        Raises:
            SceneError: a duration or a frame rate outside its range.
        """
        time, keyframes = self.time, self.keyframes
        times = [keyframes.time, *(move.time for move in keyframes.moves)] if keyframes else []
        given = [at for at in times if at is not None]
        # the last frame is at the last keyframe, or after it
        end = math.ceil(max(given) * time.fps - 1e-6) / time.fps if given else DURATION
        duration = end if time.duration is None else time.duration
        with self.blame("time"):
            return Timeline(duration, time.fps, time.substeps)

    @contextmanager
    def blame(self, *path: str | int) -> Iterator[None]:
        """Name the scene, its line and a key in the errors raised inside the block.

        Raises:
            SceneError: the error with its place.
        """
        try:
            with blame(*path):
                yield
        except SchemaError as error:
            raise self.error(error) from error


def _has(tables: Any, path: tuple) -> bool:
    """Whether nested tables and lists have a key."""
    for step in path:
        if isinstance(tables, list) and isinstance(step, int) and step < len(tables):
            tables = tables[step]
        elif isinstance(tables, Mapping) and step in tables:
            tables = tables[step]
        else:
            return False
    return True


def _names_file(what: Any, value: Any) -> bool:
    return isinstance(what, Key) and bool(what.file) and not (what.file == "painting" and value == SELF)
