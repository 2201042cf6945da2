"""Runs a scene from the command line: says what it will do, writes all its outputs, reports."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from wfluid.animation.animation import Animation
from wfluid.animation.estimate import check_memory, estimate
from wfluid.animation.loops import Seam
from wfluid.cli.progress import SearchProgress
from wfluid.cli.report import Report, write_report
from wfluid.cli.writing import kept_frames, open_writers, write_frames
from wfluid.fields.device import kernels_are_built, open_device
from wfluid.files.names import check_folder, files_written
from wfluid.keyframes.match import REACHED, STOPPED, Match, match_keyframes
from wfluid.keyframes.plot import check_plot, plot_match
from wfluid.keyframes.search import Progress
from wfluid.morphing.morph import FACTORS as FACTORS_OF_MORPH
from wfluid.morphing.morph import Morph
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.pairing import PicturePair
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture
from wfluid.scene.scene import Output, Scene
from wfluid.scene.toml_file import write_scene
from wfluid.staging.aims import Aims
from wfluid.staging.build import stage_all, with_found
from wfluid.staging.preview import draw_controls
from wfluid.system.interrupt import HeldInterrupt
from wfluid.system.memory import readable_size

EXIT_FAILED, EXIT_INTERRUPTED = 1, 130

STREAMED = 0.5
"""Part of the longest displacement that an oscillating loop may stream before that is said."""


@dataclass(frozen=True)
class RunOptions:
    """How a scene is run."""

    device: str | None = None
    """"cpu" (default), "cuda", …"""
    quiet: bool = False
    """No progress and no notes on stderr."""
    dry_run: bool = False
    """Say what would be computed and written, and stop."""
    preview: str | None = None
    """Draw the controls on the picture to this file, and stop."""
    save_scene: str | None = None
    """Write the scene to this file, and go on if there is an output."""
    plot: str | None = None
    """Draw what keyframes came to, to this file."""


def run_scene(scene: Scene, how: RunOptions) -> int:
    """Run a scene; the exit code.

    Raises:
        ValueError: what is wrong with the scene or with the files it names.
    """
    began = time.perf_counter()
    tables = scene.tables
    if not any(tables.get(key) for key in ("force", "density", "keyframes")):
        raise ValueError("nothing moves the picture: give at least one --push X,Y:DX,DY, or a [[force]]")
    if how.plot:
        if "keyframes" not in tables:
            raise ValueError("--plot draws keyframes: the scene has none")
        check_plot(how.plot)
    if not (scene.outputs or how.preview or how.save_scene or how.plot or how.dry_run):
        raise ValueError("where to? give -o OUT, such as -o out.gif, or --preview FILE.png")
    _check_names(scene, how)

    notes: list[str] = []
    staged = stage_all(scene, how.device, notes.append)
    animation, aims, settings = staged.animation, staged.aims, staged.settings
    check_memory(animation, kept_frames(scene.outputs), len(settings.order) if settings else None)
    writers = [] if how.preview or how.dry_run else open_writers(scene, animation)

    def note(text: str) -> None:
        if not how.quiet:
            print(f"wfluid: note: {text}", file=sys.stderr)

    for text in notes:  # said only now: what is refused is one line
        note(text)
    sized = _with_sizes(scene, animation.picture, staged.pair)
    searches = aims is not None and not (how.preview or how.dry_run)
    if how.save_scene and not searches:
        write_scene(how.save_scene, sized)
    if how.dry_run:
        _say_plan(animation, scene.outputs, settings)
        if aims:
            print(f"search    {len(aims.keyframes)} keyframes' forces first, for which time is not counted")
        return 0
    if how.preview:
        write_picture(how.preview, draw_controls(scene, animation, aims))
    if how.preview or not (scene.outputs or searches):
        return 0
    compiling = _load(animation, how.quiet)
    match = _matched(animation, aims, how, FACTORS_OF_MORPH if settings else None) if searches else None
    morph = Morph(match, staged.pair, settings) if match and settings else None
    if match:
        animation = match.animation
        if how.save_scene:
            write_scene(how.save_scene, with_found(sized, match.found, aims.side))
        if how.plot:
            plot_match(match, how.plot)
    least = math.inf
    if scene.outputs:
        report = Report(animation, match, aims.side if aims else 1.0, morph)
        run = (morph or animation).frames()
        writing = write_frames(run, writers, report, how.quiet)
        for text in morph.notes if morph else ():
            note(text)
        if run.seam:
            _judge_loop(animation, run.seam, report, note)
        times = {
            "compile": compiling,
            "simulate": run.seconds.simulate,
            "lookup": run.seconds.lookup,
            "write": writing,
            "total": time.perf_counter() - began,
        }
        for output in scene.outputs:
            if output.of == "report":
                write_report(output.file, report.as_dict(times, run.seam))
        least = min(least, report.of_b[0])
    if not match:
        return 0
    folds = _judge_folds(min(least, match.jacobian[0]))
    return _judge_match(match, aims.side, settings) or folds


def _with_sizes(scene: Scene, picture: Picture, pair: PicturePair | None) -> Scene:
    """The scene, saying what its pixels refer to."""
    tables = dict(scene.tables)
    tables["picture"] = {"size": [picture.width, picture.height], **tables["picture"]}
    if pair:
        tables["morph"] = {"size": list(pair.size), **tables["morph"]}
    return Scene(tables, scene.folder, scene.source, scene.lines, scene.flags)


def _check_names(scene: Scene, how: RunOptions) -> None:
    """Refuse to write over what is read, or one file twice."""
    frames = scene.frame_count
    taken = {path.resolve(): "a picture that is read" for path in scene.files()}
    taken[(scene.folder / scene.tables["picture"]["file"]).resolve()] = "the picture itself"
    taken[Path(scene.source).resolve()] = "the scene itself"
    written = [(output.file, f"written as the {output.of}", output.start) for output in scene.outputs]
    for flag, name in (
        ("--preview", how.preview),
        ("--save-scene", how.save_scene),
        ("--plot", how.plot),
    ):
        if name is not None:
            written.append((Path(name), f"written by {flag}", 0))
    for path, what, start in written:
        check_folder(path)
        for name in files_written(path, start, frames):
            if name in taken:
                raise ValueError(f"{name}: that is {taken[name]}; write to another name")
            taken[name] = what
    for path, ending, flag in (
        *((output.file, ".json", "a report") for output in scene.outputs if output.of == "report"),
        *([(Path(how.save_scene), ".toml", "a scene")] if how.save_scene else []),
    ):
        if path.suffix.lower() != ending:
            raise ValueError(f"{path}: {flag} is written as {ending}")


def _matched(animation: Animation, aims: Aims, how: RunOptions, factors: Sequence[float] | None) -> Match:
    """Find the forces of keyframes, saying how far the search is; Ctrl-C ends it with the best so far."""
    with HeldInterrupt() as interrupt, SearchProgress(aims.side, how.quiet) as show:

        def heed(at: Progress) -> bool:
            show(at)
            return interrupt.wanted

        match = match_keyframes(
            animation,
            aims.keyframes,
            pins=aims.pins,
            start=aims.found,
            tolerance=aims.tolerance,
            seed=aims.seed,
            progress=heed,
            side=aims.side,
            factors=factors,
        )
        if interrupt.wanted:
            if not how.quiet:
                print("\nstopped: writing the best so far; Ctrl-C again ends that too", file=sys.stderr)
            match = replace(match, status=STOPPED)
        return match


def _judge_match(match: Match, side: float, settings: MorphSettings | None) -> int:
    """Say which points are not where they should be; the exit code. All of a morph's are due at its end."""
    if match.status == REACHED:
        return 0
    worst, allowed = (f"{length * side:.3g} px" for length in (match.residual, match.tolerance))
    text = f"the farthest point is {worst} from its keyframe, {allowed} are allowed"
    print(f"wfluid: {match.status}: {text}", file=sys.stderr)
    for arrival in match.arrivals:
        if arrival.residual > match.tolerance:
            print(f"wfluid: {arrival.describe(side, timed=settings is None)}", file=sys.stderr)
    return EXIT_INTERRUPTED if match.status == STOPPED else EXIT_FAILED


def _judge_folds(least: float) -> int:
    """Say whether a map folds, whose least det J is given; the exit code."""
    if least > 0:
        return 0
    advice = "leave out points that pass close by one another, or use more cells"
    print(f"wfluid: the picture folds over itself (det J {least:.2g}); {advice}", file=sys.stderr)
    return EXIT_FAILED


def _say_plan(animation: Animation, outputs: Sequence[Output], settings: MorphSettings | None) -> None:
    """Print what a run would take and write."""
    timeline, grid = animation.timeline, animation.grid
    morph_frames = len(settings.order) if settings else None
    guess = estimate(animation, kept_frames(outputs), morph_frames)
    frames, fps = morph_frames or animation.frame_count, settings.timeline.fps if settings else timeline.fps
    steps = (timeline.frames - 1) * timeline.steps_per_frame
    size = animation.width or animation.picture.width, animation.height or animation.picture.height
    print(f"picture   {animation.picture.width} x {animation.picture.height} pixels")
    print(f"grid      {grid.nx} x {grid.ny} cells")
    print(f"steps     {steps} of {timeline.dt:.4g} s, {timeline.steps_per_frame} a frame")
    print(f"frames    {frames} of {size[0]} x {size[1]} pixels at {fps:g} a second")
    print(f"memory    about {readable_size(guess.memory)}")
    print(f"time      about {guess.seconds:.1f} s on one core, without compiling and writing")
    print(f"writes    {', '.join(str(output.file) for output in outputs) or 'nothing'}")


def _load(animation: Animation, quiet: bool) -> float:
    """Load the kernels, with a message where that takes a compiler; returns the seconds it took."""
    device = open_device(animation.device)
    new = not kernels_are_built(device)
    if new and not quiet:
        print(f"compiling the kernels for {device.name}, once …", file=sys.stderr, flush=True)
    seconds = animation.solver.compile_seconds
    if new and not quiet:
        print(f"compiled in {seconds:.1f} s", file=sys.stderr)
    return seconds


def _judge_loop(animation: Animation, seam: Seam, report: Report, note: Callable[[str], None]) -> None:
    """Note a loop that had to be bent far to close."""
    drift, longest = seam.drift_max, report.extremes["displacement_max_px"]
    side = max(animation.picture.width, animation.picture.height)
    if animation.loop == "oscillate" and drift * side > STREAMED * longest:
        note(
            f"the flow streams {drift * side:.0f} px over the loop, which was taken off its frames; "
            "a loop of one period, more viscosity or a smaller force streams less"
        )
