"""The command line: wfluid animate, wfluid warmup.

Exit codes: 0 done, 1 the run failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NoReturn

EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED = 1, 2, 130

QUEUED_FRAMES = 4
"""Frames that may wait for the disk while the next ones are computed."""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and leave with exit code 2."""
        self.exit(EXIT_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code."""
    options = _parser().parse_args(arguments)
    warnings.simplefilter("always")
    warnings.showwarning = _show_warning
    from wfluid.picture import PictureError

    try:
        return options.run(options)
    except (PictureError, ValueError) as error:
        print(f"wfluid {options.verb}: {error}", file=sys.stderr)
        return EXIT_INPUT
    except KeyboardInterrupt:
        print(f"wfluid {options.verb}: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except (RuntimeError, OSError, MemoryError) as error:
        print(f"wfluid {options.verb}: failed: {error or type(error).__name__}", file=sys.stderr)
        return EXIT_FAILED


def _parser() -> Parser:
    parser = Parser(
        prog="wfluid", description="Animate, warp and morph pictures by treating them as a fluid."
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=Parser)
    animate = verbs.add_parser(
        "animate",
        help="move a picture with forces",
        description="Move a picture with forces and write the frames.",
        epilog="example: wfluid animate examples/images/raccoon.jpg -o nose.gif "
        "--push 621,451:20,12:period=1,radius=60",
    )
    animate.set_defaults(run=run_animate)
    animate.add_argument("picture", metavar="PICTURE", help="the picture to animate")
    animate.add_argument(
        "-o", "--output", metavar="OUT", required=True, help="x.gif, or a sequence such as x.####.png"
    )
    animate.add_argument(
        "--push",
        metavar="X,Y:DX,DY[:key=value,…]",
        action="append",
        default=[],
        help="push the point X,Y along the arrow DX,DY [px]; keys radius, period, phase, start, end, at, "
        "strength; repeatable",
    )
    number = animate.add_argument
    number("--viscosity", type=float, default=0.001, help="viscosity [longer side^2/s] (0.001)")
    number("--cells", type=int, default=256, help="cells along the longer side (256)")
    number("--walls", default="free-slip", help="free-slip, no-slip, periodic, or two of them as X,Y")
    number("--scheme", default="standard", help="standard, or paper: Euler, bilinear, Jacobi, phase 0")
    number("--solver", default=None, help="multigrid (default) or jacobi")
    number("--fps", type=float, default=15.0, help="frames a second (15)")
    number("--duration", type=float, default=2.0, help="length [s] (2)")
    number("--substeps", type=int, default=None, help="steps a frame (so many that dt <= 1/96 s)")
    number("--width", type=int, default=None, help="width of the frames [px] (the picture's)")
    number("--filter", default="cubic", help="nearest, bilinear or cubic (cubic)")
    number("--edge", default="clamp", help="clamp, mirror, wrap or transparent (clamp)")
    number("--report", metavar="FILE.json", help="write settings, times and quality figures")
    _common(animate)
    warmup = verbs.add_parser(
        "warmup",
        help="compile the kernels now",
        description="Compile the kernels for a device, so that the first animation starts at once.",
        epilog="example: wfluid warmup --device cpu",
    )
    warmup.set_defaults(run=run_warmup)
    _common(warmup)
    return parser


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--device", default=None, help="cpu (default), cuda, cuda:1, …")
    parser.add_argument("--quiet", action="store_true", help="no progress on stderr")


def run_warmup(options: argparse.Namespace) -> int:
    """Compile the kernels."""
    from wfluid.device import load_kernels, open_device

    device = open_device(options.device)
    seconds = load_kernels(device)
    if not options.quiet:
        print(f"kernels for {device.name}: {seconds:.1f} s", file=sys.stderr)
    return 0


def run_animate(options: argparse.Namespace) -> int:
    """Read the picture, run the animation, write frames and report."""
    from wfluid.animation import Animation, Timeline
    from wfluid.fluid import Fluid
    from wfluid.output import open_output
    from wfluid.picture import read_picture
    from wfluid.push import Push
    from wfluid.report import Report, write_report

    began = time.perf_counter()
    fluid = Fluid(
        viscosity=options.viscosity, walls=options.walls, scheme=options.scheme, solver=options.solver
    )
    timeline = Timeline(options.duration, options.fps, options.substeps)
    pushes = [Push.parse(text) for text in options.push]
    if not pushes:
        raise ValueError("nothing moves the picture: give at least one --push X,Y:DX,DY")
    picture = read_picture(options.picture)
    forces = [push.force(picture.width, picture.height, timeline.duration, fluid.scheme) for push in pushes]
    output = open_output(options.output, timeline.fps)
    animation = Animation(
        picture,
        fluid,
        forces,
        timeline,
        cells=options.cells,
        width=options.width,
        height=options.width and max(1, round(options.width * picture.height / picture.width)),
        filter=options.filter,
        edge=options.edge,
        device=options.device,
    )
    _load(animation, options.quiet)
    report = Report(animation)
    writing = _write_frames(animation, output, report, options.quiet)
    if options.report:
        times = {"write": writing, "total": time.perf_counter() - began}
        write_report(options.report, report.as_dict(times))
    return 0


def _load(animation, quiet: bool) -> None:
    """Load the kernels, saying so where that takes a compiler."""
    from wfluid.device import kernels_are_built, open_device

    device = open_device(animation.device)
    new = not kernels_are_built(device)
    if new and not quiet:
        print(f"compiling the kernels for {device.name}, once …", file=sys.stderr, flush=True)
    seconds = animation.solver.compile_seconds
    if new and not quiet:
        print(f"compiled in {seconds:.1f} s", file=sys.stderr)


def _write_frames(animation, output, report, quiet: bool) -> float:
    """Compute frames and write them from a second thread; returns the seconds spent writing."""
    writing = 0.0

    def write(picture) -> None:
        nonlocal writing
        start = time.perf_counter()
        output.write(picture)
        writing += time.perf_counter() - start

    waiting: list[Future] = []
    try:
        with ThreadPoolExecutor(1) as pool, _progress(animation.timeline.frames, quiet) as advance:
            for frame in animation.frames():
                report.add(frame)
                if len(waiting) >= QUEUED_FRAMES:
                    waiting.pop(0).result()
                waiting.append(pool.submit(write, frame.picture))
                advance()
            for future in waiting:
                future.result()
        start = time.perf_counter()
        output.close()
        return writing + time.perf_counter() - start
    except BaseException:
        output.abandon()
        if output.written:
            print(f"finished before that: {len(output.written)} files", file=sys.stderr)
        raise


class _progress:
    """A bar on stderr with frame rate and remaining time; silent when quiet or not on a terminal."""

    def __init__(self, frames: int, quiet: bool):
        self.frames, self.quiet = frames, quiet or not sys.stderr.isatty()

    def __enter__(self) -> Callable[[], None]:
        if self.quiet:
            return lambda: None
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self.bar = Progress(
            TextColumn("frames"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]:.1f} frames/s"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        task = self.bar.add_task("frames", total=self.frames, rate=0.0)
        self.bar.start()
        start = time.perf_counter()
        done = 0

        def advance() -> None:
            nonlocal done
            done += 1
            self.bar.update(task, advance=1, rate=done / (time.perf_counter() - start))

        return advance

    def __exit__(self, *_) -> None:
        if not self.quiet:
            self.bar.stop()


def _show_warning(message, *_, **__) -> None:
    print(f"wfluid: warning: {message}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
