"""The command line: wfluid animate, wfluid warmup, wfluid --version.

Exit codes: 0 done, 1 the run failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import argparse
import difflib
import math
import re
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import NoReturn

EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED = 1, 2, 130

EXAMPLE = "wfluid animate raccoon.jpg -o nose.gif --push 621,451:22,15:period=1,radius=55"

QUEUED_FRAMES = 4
"""Frames that may wait for the disk while the next ones are computed."""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, with the nearest flag or verb that exists."""

    def __init__(self, *arguments, **settings):
        super().__init__(*arguments, allow_abbrev=False, **settings)

    def parse_known_args(self, args=None, namespace=None):
        """Parse; an unknown flag is refused here, where the verb's own flags are known."""
        options, unknown = super().parse_known_args(args, namespace)
        for word in unknown:
            flag = word.partition("=")[0]
            if not flag.startswith("-"):
                self.error(f"{word!r} is one argument too many")
            near = difflib.get_close_matches(flag, self._option_string_actions, n=1, cutoff=0.5)
            self.error(f"there is no flag {flag}" + (f"; did you mean {near[0]}?" if near else ""))
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """Print the message and leave with exit code 2."""
        wrong = re.match(r"argument VERB: invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if wrong:
            near = difflib.get_close_matches(wrong[1], re.findall(r"\w+", wrong[2]), n=1)
            ask = f"did you mean {near[0]}?" if near else f"expected {wrong[2]}"
            message = f"there is no verb {wrong[1]!r}; {ask}"
        self.exit(EXIT_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


class Version(argparse.Action):
    """Prints what is installed, and the devices."""

    def __call__(self, parser, *_) -> NoReturn:
        """Load the libraries only now, when they are asked for."""
        import warp

        from wfluid.device import open_device
        from wfluid.report import versions

        open_device()
        print("\n".join(f"{name} {version}" for name, version in versions().items()))
        print("devices: " + ", ".join(f"{device.alias} ({device.name})" for device in warp.get_devices()))
        parser.exit()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code."""
    options = _parser().parse_args(arguments)
    warnings.simplefilter("ignore")
    warnings.filterwarnings("always", module="wfluid")
    warnings.showwarning = _show_warning
    from wfluid.picture import PictureError

    try:
        return options.run(options)
    except (PictureError, ValueError) as error:
        print(f"wfluid {options.verb}: {error}", file=sys.stderr)
        return EXIT_INPUT
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except (RuntimeError, ArithmeticError, OSError, MemoryError) as error:
        print(f"wfluid {options.verb}: failed: {error or type(error).__name__}", file=sys.stderr)
        return EXIT_FAILED


def _parser() -> Parser:
    parser = Parser(
        prog="wfluid", description="Animate, warp and morph pictures by treating them as a fluid."
    )
    parser.add_argument("--version", action=Version, nargs=0, help="versions of wfluid and what it runs on")
    parser.epilog = "wfluid VERB --help explains a verb; example: " + EXAMPLE
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=Parser)
    animate = verbs.add_parser(
        "animate",
        help="move a picture with forces",
        description="Move a picture with forces and write the frames.",
        epilog=f"example: {EXAMPLE}",
    )
    animate.set_defaults(run=run_animate)
    animate.add_argument("picture", metavar="PICTURE", help="the picture to animate")
    animate.add_argument(
        "-o", "--output", metavar="OUT", help="x.gif, x.mp4, x.webm, or a sequence such as x.####.png"
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
    number(
        "--viscosity", type=float, help="viscosity [longer side^2/s] (0.001); of white, with an image (0.1)"
    )
    number("--viscosity-image", metavar="FILE|self", help="a picture that is bright where the fluid is stiff")
    number("--viscosity-floor", type=float, help="viscosity where the viscosity image is black (0)")
    number("--invert-viscosity", action="store_true", help="stiff where the viscosity image is dark")
    number("--viscosity-moves", action="store_true", help="take the viscosity image along with the picture")
    number("--freeze", metavar="MASK[:STRENGTH]", help="a mask, white where the picture stays (drag 10000/s)")
    number("--effect-mask", metavar="MASK", help="a mask, white where the forces act")
    animate.add_argument(
        "--force-image",
        metavar="FILE[:key=value,…]",
        action="append",
        default=[],
        help="a force from a picture or self; keys kind (gradient, contour, vectors), strength [px], radius, "
        "period, phase, start, end, at; repeatable",
    )
    number("--cells", type=int, default=256, help="cells along the longer side (256)")
    number("--walls", default="free-slip", help="free-slip, no-slip, periodic, or two of them as X,Y")
    number("--scheme", default="standard", help="standard, or paper: Euler, bilinear, Jacobi, phase 0")
    number("--solver", default=None, help="multigrid (default) or jacobi")
    number("--pressure-cycles", type=int, default=3, help="multigrid cycles a projection (3)")
    number("--fps", type=float, default=15.0, help="frames a second (15)")
    number("--duration", type=float, default=2.0, help="length [s] (2)")
    number("--substeps", type=int, default=None, help="steps a frame (so many that dt <= 1/96 s)")
    number("--width", type=int, default=None, help="width of the frames [px] (the picture's)")
    number("--scale", type=float, default=None, help="size of the frames as a factor, instead of --width")
    number("--filter", default="cubic", help="nearest, bilinear, cubic or lanczos (cubic)")
    number("--edge", default="clamp", help="clamp, mirror, wrap or transparent (clamp)")
    number("--colorspace", default="auto", help="what the picture's numbers are: auto, srgb, linear (auto)")
    number("--start", type=int, default=1001, help="number of a sequence's first frame (1001)")
    number("--type", default=None, help="numbers of a sequence: uint8, uint16, half, float (the picture's)")
    number("--compression", default=None, help="of EXR (zip, piz, dwaa, …) and TIFF (lzw, zip, …) sequences")
    number("--quality", type=int, default=None, help="of JPEG and WebP sequences, 1 … 100")
    number("--preview", metavar="FILE", help="draw the pushes on the picture instead of running")
    number("--dry-run", action="store_true", help="say what would be computed and written, and stop")
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
    from wfluid.animation import Animation
    from wfluid.estimate import check_memory
    from wfluid.fluid import Fluid
    from wfluid.output import check_folder, names, open_output
    from wfluid.painted_options import Paintings, files_of
    from wfluid.picture import Encoding, read_picture
    from wfluid.push import Push
    from wfluid.report import Report, write_report
    from wfluid.timeline import Timeline

    began = time.perf_counter()
    settings = {
        "walls": options.walls,
        "scheme": options.scheme,
        "solver": options.solver,
        "pressure_cycles": options.pressure_cycles,
        "viscosity_moves": options.viscosity_moves,
    }
    if options.viscosity_image is None:
        _refuse_without_image(options)
    Fluid(viscosity=0.001 if options.viscosity is None else options.viscosity, **settings)  # before files
    timeline = Timeline(options.duration, options.fps, options.substeps)
    encoding = Encoding(options.type, options.compression, options.quality)
    pushes = [Push.parse(text) for text in options.push]
    if not pushes and not options.force_image:
        raise ValueError("nothing moves the picture: give at least one --push X,Y:DX,DY")
    if options.output is None and not options.preview:
        raise ValueError("where to? give -o OUT, such as -o out.gif, or --preview FILE.png")
    taken = {Path(options.picture).resolve(): "the picture itself"}
    painted = files_of(options.viscosity_image, options.effect_mask, options.freeze, options.force_image)
    taken |= {Path(name).resolve(): "a picture that is read" for name in painted}
    for flag, written in (
        ("-o", options.output),
        ("--report", options.report),
        ("--preview", options.preview),
    ):
        if written is None:
            continue
        check_folder(Path(written))
        for path in names(Path(written), options.start, timeline.frames):
            if path in taken:
                raise ValueError(f"{path}: that is {taken[path]}; write to another name")
            taken[path] = f"written by {flag}"
    picture = read_picture(options.picture, options.colorspace)
    paintings = Paintings(picture, _say_note if not options.quiet else lambda text: None)
    viscosity = paintings.viscosity(
        options.viscosity_image, options.viscosity, options.viscosity_floor or 0.0, options.invert_viscosity
    )
    fluid = Fluid(viscosity=viscosity, freeze=paintings.freeze(options.freeze), **settings)
    weight, duration = paintings.weight(options.effect_mask), timeline.duration
    forces: list = [
        push.force(picture.width, picture.height, duration, fluid.scheme, weight) for push in pushes
    ]
    forces += [paintings.force(text, duration, fluid.scheme, weight) for text in options.force_image]
    width, height = _size(options, picture)
    animation = Animation(
        picture,
        fluid,
        forces,
        timeline,
        cells=options.cells,
        width=width,
        height=height,
        filter=options.filter,
        edge=options.edge,
        device=options.device,
    )
    check_memory(animation, _keeps_frames(options.output))
    output = open_output(options.output, timeline.fps, options.start, encoding) if options.output else None
    if options.dry_run:
        _say_plan(animation, options.output)
        return 0
    if options.preview:
        return _preview(options.preview, picture, pushes, fluid, weight)
    _load(animation, options.quiet)
    report = Report(animation)
    writing = _write_frames(animation, output, report, options.quiet)
    if options.report:
        times = {"write": writing, "total": time.perf_counter() - began}
        write_report(options.report, report.as_dict(times))
    return 0


def _size(options: argparse.Namespace, picture) -> tuple[int | None, int | None]:
    """Width and height of the frames from --width or --scale."""
    scale = options.scale
    if options.width is None and scale is None:
        return None, None
    if options.width is not None and scale is not None:
        raise ValueError("--width and --scale both say the size: give one")
    if scale is not None and not (math.isfinite(scale) and scale > 0):
        raise ValueError(f"scale {scale}: expected a positive number")
    width = options.width if scale is None else max(1, round(scale * picture.width))
    return width, max(1, round(width * picture.height / picture.width))


def _keeps_frames(output: str | None) -> bool:
    return output is not None and output.lower().endswith(".gif")


def _say_plan(animation, output: str | None) -> None:
    """Print what a run would take and write."""
    from wfluid.estimate import estimate
    from wfluid.files import readable_size

    timeline, grid, guess = animation.timeline, animation.grid, estimate(animation, _keeps_frames(output))
    steps = (timeline.frames - 1) * timeline.steps_per_frame
    size = animation.width or animation.picture.width, animation.height or animation.picture.height
    print(f"picture   {animation.picture.width} x {animation.picture.height} pixels")
    print(f"grid      {grid.nx} x {grid.ny} cells")
    print(f"steps     {steps} of {timeline.dt:.4g} s, {timeline.steps_per_frame} a frame")
    print(f"frames    {timeline.frames} of {size[0]} x {size[1]} pixels at {timeline.fps:g} a second")
    print(f"memory    about {readable_size(guess.memory)}")
    print(f"time      about {guess.seconds:.1f} s on one core, without compiling and writing")
    print(f"writes    {output or 'nothing'}")


def _preview(path: str, picture, pushes, fluid, weight) -> int:
    """Write the picture with the controls drawn on it."""
    from wfluid.picture import write_picture
    from wfluid.preview import draw_controls

    write_picture(path, draw_controls(picture, pushes, fluid.viscosity, fluid.freeze, weight))
    return 0


def _refuse_without_image(options: argparse.Namespace) -> None:
    for flag in ("viscosity_floor", "invert_viscosity", "viscosity_moves"):
        if getattr(options, flag) is not None and getattr(options, flag) is not False:
            raise ValueError(f"--{flag.replace('_', '-')} needs a --viscosity-image")


def _say_note(text: str) -> None:
    print(f"wfluid: note: {text}", file=sys.stderr)


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
    except KeyboardInterrupt:
        output.close()  # what is there is whole: a movie ends at its last frame
        finished = ", ".join(map(str, output.written[:1] + output.written[1:][-1:])) or "nothing"
        between = " … " if len(output.written) > 2 else ""
        print(f"interrupted; finished: {finished.replace(', ', between or ', ')}", file=sys.stderr)
        raise
    except BaseException:
        output.abandon()
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
