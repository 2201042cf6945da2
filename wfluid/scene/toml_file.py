"""Scenes read from TOML files and written to them; errors name the line."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path

import tomlkit
from tomlkit.exceptions import ParseError, TOMLKitError

from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.system.atomic import atomic_write_text


def read_scene(path: str | os.PathLike) -> Scene:
    """The scene in a TOML file.

    Raises:
        SceneError: a missing file, wrong TOML (with line and column), or a wrong key (with line).
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{path}: no such scene") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'no UTF-8'})"
        ) from None
    try:
        tables = tomlkit.parse(text).unwrap()
    except ParseError as error:
        reason = re.sub(r" at line \d+ col \d+$", "", str(error))
        place = f"{error.line}:{error.col}" if error.col else _line_and_column(text)
        raise SceneError(f"{path}:{place}: no TOML: {reason}") from None
    except TOMLKitError as error:
        raise SceneError(f"{path}:{_line_and_column(text)}: no TOML: {error}") from None
    return Scene(tables, path.parent, str(path), _lines_of(text))


def write_scene(path: str | os.PathLike, scene: Scene) -> None:
    """Write a scene as TOML, with file names relative to it; on an error no file is left behind.

    Raises:
        FileError: a name that cannot be written to.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    path = Path(path)
    document = tomlkit.document()
    for key, value in scene.tables_in(path.parent).items():
        document[key] = value
    atomic_write_text(path, tomlkit.dumps(document))


def _line_and_column(text: str) -> str:
    """Line and column of an error that tomlkit reports without its place, such as a key given twice."""
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        if place := re.search(r"at line (\d+), column (\d+)", str(error)):
            return f"{place[1]}:{place[2]}"
    return "1:1"


_HEADING = re.compile(r"""^\s*\[(\[)?([\w."'\s-]+)\]\]?\s*(#.*)?$""")
_SETTING = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+)\s*=")


def _lines_of(text: str) -> dict[tuple, int]:
    """The lines of headings, and of keys at the start of a line, by path."""
    found: dict[tuple, int] = {}
    counts: dict[tuple, int] = {}
    table: tuple = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if heading := _HEADING.match(line):
            table = ()
            steps = [step.strip(" \"'") for step in heading[2].split(".")]
            for n, step in enumerate(steps):
                table = (*table, step)
                if heading[1] and n == len(steps) - 1:
                    found.setdefault(table, number)
                    counts[table] = counts.get(table, -1) + 1
                if table in counts:
                    table = (*table, counts[table])
            found.setdefault(table, number)
        elif setting := _SETTING.match(line):
            found.setdefault((*table, *(step.strip(" \"'") for step in setting[1].split("."))), number)
    return found
