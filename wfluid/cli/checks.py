"""Checks of a run before anything is computed or written."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from wfluid.cli.hints import BY_FLAGS
from wfluid.files.names import check_folder, files_written
from wfluid.keyframes.plot import check_plot
from wfluid.pictures.formats import PictureError
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SchemaError


@dataclass(frozen=True)
class RunOptions:
    """Options of a run that are not part of the scene."""

    device: str | None = None
    """Device: "cpu" (default), "cuda", …"""
    quiet: bool = False
    """Whether to print no progress, no notes and no last line."""
    verbose: bool = False
    """Whether messages have residuals, iterations and objectives too."""
    dry_run: bool = False
    """Whether to print the plan and stop."""
    preview: str | None = None
    """File for a drawing of the controls on the picture, instead of a run."""
    save_scene: str | None = None
    """File to save the scene to; the run continues if the scene has outputs."""
    plot: str | None = None
    """File for a figure of the search for keyframes."""
    points: str | None = None
    """File that the moves were read from."""
    verb: str = "animate"
    """The command."""


def check_run(scene: Scene, options: RunOptions) -> None:
    """Refuse a run without motion or output, and files that cannot be written.

    Raises:
        ValueError: no motion, no output, or two outputs with one name.
        FileError: a file that cannot be written.
        SceneError: settings of an output that its format does not have.
    """
    if not (scene.forces or scene.densities or scene.keyframes):
        drawn = options.verb in BY_FLAGS
        remedy = "give at least one --push X,Y:DX,DY" if drawn else "add a [[force]] to the scene"
        raise ValueError(f"nothing moves the picture: {remedy}")
    if options.plot:
        if not scene.keyframes:
            raise ValueError(
                "--plot draws the search for keyframes, and the scene has none: add [[keyframes.move]], "
                "or leave it out"
            )
        logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells of its own folders
        check_plot(options.plot)
    asked = options.preview or options.save_scene or options.plot or options.dry_run
    if not (scene.outputs or asked):
        raise ValueError("no output: give -o OUT, such as -o out.gif, or --preview FILE.png")
    for n, output in enumerate(scene.outputs):
        try:
            _ = output.encoding
        except PictureError as error:
            raise scene.error(SchemaError(("output", n), str(error))) from error
    _check_names(scene, options)
    _check_endings(scene, options)


def _check_names(scene: Scene, options: RunOptions) -> None:
    """Refuse to write over a file that is read, or one file twice."""
    frames = scene.frame_count
    taken = {path.resolve(): "an input of the scene" for path in scene.files()}
    taken[(scene.folder / scene.picture.file).resolve()] = "the picture itself"
    taken[Path(scene.source).resolve()] = "the scene itself"
    if options.points:
        taken[Path(options.points).resolve()] = "the file of points"
    written = [
        (scene.folder / output.file, f"the output of {output.of!r}", output.start) for output in scene.outputs
    ]
    written += [
        (Path(name), f"the output of {flag}", 0)
        for flag, name in (
            ("--preview", options.preview),
            ("--save-scene", options.save_scene),
            ("--plot", options.plot),
        )
        if name is not None
    ]
    for path, what, start in written:
        check_folder(path, start, frames)
        for name in files_written(path, start, frames):
            if name in taken:
                raise ValueError(f"{name} is {taken[name]}: write to another name")
            taken[name] = what


def _check_endings(scene: Scene, options: RunOptions) -> None:
    """Refuse a report without the ending .json, a scene without .toml."""
    reports = [scene.folder / output.file for output in scene.outputs if output.of == "report"]
    scenes = [Path(options.save_scene)] if options.save_scene else []
    for paths, ending, what in ((reports, ".json", "a report"), (scenes, ".toml", "a scene")):
        for path in paths:
            if path.suffix.lower() != ending:
                raise ValueError(f"{path}: {what} is written as {ending}")
