"""Runs a scene from the command line: checks, search, frames, outputs, report."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace

from wfluid.animation.animation import Animation
from wfluid.animation.estimate import check_memory, estimate
from wfluid.animation.run import Run
from wfluid.cli.checks import RunOptions, check_run
from wfluid.cli.exits import Exit
from wfluid.cli.folds import Folds
from wfluid.cli.hints import fitted_hint
from wfluid.cli.progress import SearchProgress
from wfluid.cli.remedies import finer, gentler
from wfluid.cli.report import Report, write_report
from wfluid.cli.verdicts import ending, judge_folds, judge_loop, judge_match, judge_smoothness
from wfluid.cli.writing import (
    Output,
    finished,
    kept_frames,
    near,
    notes_of_outputs,
    open_writers,
    write_frames,
)
from wfluid.fields.device import kernels_are_built, open_device
from wfluid.keyframes.match import STOPPED, Match, match_keyframes
from wfluid.keyframes.plot import plot_match
from wfluid.keyframes.search import Progress
from wfluid.morphing.morph import FACTORS, Morph
from wfluid.pictures.stills import write_picture
from wfluid.scene.scene import Scene
from wfluid.scene.toml_file import write_scene
from wfluid.staging.aims import with_found
from wfluid.staging.build import Staged, StagedKeyframes, StagedMorph, stage_all
from wfluid.staging.preview import draw_controls
from wfluid.system.interrupt import HeldInterrupt
from wfluid.system.memory import readable_size


def run_scene(scene: Scene, options: RunOptions) -> Exit:
    """Run a scene; returns the exit code.

    Raises:
        ValueError: an error in the scene or in the files it names.
    """
    began = time.perf_counter()
    check_run(scene, options)
    notes: list[str] = []
    staged = stage_all(scene, options.device, notes.append)
    check_memory(staged.animation, kept_frames(scene), _morph_frames(staged))
    pair = staged.pair if isinstance(staged, StagedMorph) else None
    first = pair.a if pair else staged.animation.picture
    notes += notes_of_outputs(scene, first, staged.animation.layers)
    without_run = bool(options.preview or options.dry_run)
    outputs = [] if without_run else open_writers(scene, staged.animation)
    note = _note(options)
    for text in notes:  # only now: an error above is a single line
        note(text)

    searched = staged if isinstance(staged, StagedKeyframes) and not without_run else None
    if options.save_scene and not searched:
        write_scene(options.save_scene, _with_sizes(scene, staged))
    if options.preview:
        aims = staged.aims if isinstance(staged, StagedKeyframes) else None
        write_picture(options.preview, draw_controls(scene, staged.animation, aims))
    if options.dry_run:
        _print_plan(scene, staged)
        return Exit.DONE
    beside = [str(name) for name in (options.preview, options.save_scene) if name]
    if without_run or not (scene.outputs or searched):
        _end(ending(beside, None, None, 1.0, time.perf_counter() - began), options.quiet)
        return Exit.DONE

    compiling = _load_kernels(staged.animation, options.quiet)
    match = _search(searched, options) if searched else None
    if searched and match:
        _save_match(match, scene, searched, options)
        beside += [str(options.plot)] if options.plot else []
    report = None
    if scene.outputs or (match and match.jacobian[0] <= 0):  # the frames show where it folds
        report, run, writing = _write_frames(staged, match, outputs, options)
        seconds = {
            "compile": compiling,
            "simulate": run.seconds.simulate,
            "lookup": run.seconds.lookup,
            "write": writing,
            "total": time.perf_counter() - began,
        }
        for output in scene.outputs:
            if output.of == "report":
                write_report(scene.folder / output.file, report.as_dict(seconds, run.seam))
                beside.append(near(scene.folder / output.file))
    code = _verdict(scene, staged, match, report, options.verbose)
    side = searched.aims.side if searched else 1.0
    names = [*finished(outputs), *beside]
    _end(ending(names, report, match, side, time.perf_counter() - began), options.quiet)
    return code


def _note(options: RunOptions) -> Callable[[str], None]:
    """A function that prints a note on stderr; prints nothing if quiet."""

    def note(text: str) -> None:
        if not options.quiet:
            print(f"wfluid: note: {fitted_hint(options.verb, text)}", file=sys.stderr)

    return note


def _end(text: str, quiet: bool) -> None:
    """Print the last line of a command, on stdout."""
    if not quiet:
        print(text)


def _morph_frames(staged: Staged) -> int | None:
    """Frames of a morph, forwards and back; None for another scene."""
    return len(staged.settings.order) if isinstance(staged, StagedMorph) else None


def _with_sizes(scene: Scene, staged: Staged) -> Scene:
    """The scene with the sizes that its pixels refer to."""
    tables, picture = dict(scene.tables), staged.animation.picture
    tables["picture"] = {"size": [picture.width, picture.height], **tables["picture"]}
    if isinstance(staged, StagedMorph):
        tables["morph"] = {"size": list(staged.pair.size), **tables["morph"]}
    return scene.with_tables(tables)


def _print_plan(scene: Scene, staged: Staged) -> None:
    """Print the size, the cost and the outputs of a run."""
    animation, morph_frames = staged.animation, _morph_frames(staged)
    timeline, grid, picture = animation.timeline, animation.grid, animation.picture
    guess = estimate(animation, kept_frames(scene), morph_frames)
    frames = morph_frames or animation.frame_count
    fps = staged.settings.timeline.fps if isinstance(staged, StagedMorph) else timeline.fps
    steps = (timeline.frames - 1) * timeline.steps_per_frame
    width, height = animation.width or picture.width, animation.height or picture.height
    names = ", ".join(str(scene.folder / output.file) for output in scene.outputs)
    print(f"picture   {picture.width} x {picture.height} pixels")
    print(f"grid      {grid.nx} x {grid.ny} cells")
    print(f"steps     {steps} of {timeline.dt:.4g} s, {timeline.steps_per_frame} per frame")
    print(f"frames    {frames} of {width} x {height} pixels at {fps:g} per second")
    print(f"memory    about {readable_size(guess.memory)}")
    print(f"time      about {guess.seconds:.1f} s on one core, not counting compilation, search and writing")
    print(f"writes    {names or 'nothing'}")
    if isinstance(staged, StagedKeyframes):
        print(f"search    for the forces of {len(staged.aims.keyframes)} keyframes")


def _load_kernels(animation: Animation, quiet: bool) -> float:
    """Load the kernels, with a message if they are compiled; returns the seconds it took."""
    device = open_device(animation.device)
    new = not kernels_are_built(device)
    if new and not quiet:
        print(f"compiling the kernels for {device.name}, once …", file=sys.stderr, flush=True)
    seconds = animation.solver.compile_seconds
    if new and not quiet:
        print(f"compiled in {seconds:.1f} s", file=sys.stderr)
    return seconds


def _search(staged: StagedKeyframes, options: RunOptions) -> Match:
    """Find the forces of keyframes and show progress; Ctrl-C ends the search with the best forces so far."""
    aims = staged.aims
    quiet, shown = options.quiet, SearchProgress(aims.side, options.quiet, verbose=options.verbose)
    with HeldInterrupt() as interrupt, shown as show:

        def advance(at: Progress) -> bool:
            show(at)
            return interrupt.wanted

        match = match_keyframes(
            staged.animation,
            aims.keyframes,
            pins=aims.pins,
            start=aims.found,
            tolerance=aims.tolerance,
            seed=aims.seed,
            progress=advance,
            side=aims.side,
            factors=FACTORS if isinstance(staged, StagedMorph) else None,
        )
        if interrupt.wanted:
            if not quiet:
                print(
                    "\nstopped: writing the best forces so far; press Ctrl-C again to quit", file=sys.stderr
                )
            match = replace(match, status=STOPPED)
        return match


def _save_match(match: Match, scene: Scene, staged: StagedKeyframes, options: RunOptions) -> None:
    """Save the scene with the forces found, and plot the search, where the options ask for it."""
    if options.save_scene:
        found = with_found(_with_sizes(scene, staged), match.found, staged.aims.side)
        write_scene(options.save_scene, found)
    if options.plot:
        plot_match(match, options.plot)


def _write_frames(
    staged: Staged, match: Match | None, outputs: list[Output], options: RunOptions
) -> tuple[Report, Run, float]:
    """Compute and write the frames; returns their report, the run, and the seconds spent writing."""
    note = _note(options)
    animation = match.animation if match else staged.animation
    morph = Morph(match, staged.pair, staged.settings) if match and isinstance(staged, StagedMorph) else None
    side = staged.aims.side if isinstance(staged, StagedKeyframes) else 1.0
    report = Report(animation, match, side, morph, staged.arrow)
    run = (morph or animation).frames()
    writing = write_frames(run, outputs, report, options.quiet)
    for text in morph.notes if morph else ():
        note(text)
    if run.seam:
        judge_loop(animation, run.seam, report, note)
    return report, run, writing


def _verdict(scene: Scene, staged: Staged, match: Match | None, report: Report | None, verbose: bool) -> Exit:
    """Whether all points reach their targets, and no frame of the picture folds; warns of rough motion."""
    if report:
        judge_smoothness(report.smoothness, gentler(scene, staged))
    least = match.jacobian[0] if match else math.inf
    remedy = f"{gentler(scene, staged)}, or {finer(scene, staged)}"
    seen = report.folds if report else Folds()
    folds = judge_folds(seen, least, scene.frames.allow_folds, remedy)
    if not (match and isinstance(staged, StagedKeyframes)):
        return folds
    timed = not isinstance(staged, StagedMorph)
    return judge_match(match, staged.aims.side, timed, verbose) or folds
