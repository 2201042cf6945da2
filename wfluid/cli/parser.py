"""The flags of every command."""

from __future__ import annotations

import argparse
import difflib
import re
from typing import NoReturn

from wfluid.cli.commands import run_animate, run_check_gradient, run_render, run_warmup
from wfluid.cli.exits import EXIT_INPUT

KEYFRAMES_EXAMPLE = "wfluid keyframes cat.png -o look.gif --move 210,160:230,140 --pin 300,220"
MORPH_EXAMPLE = "wfluid morph cat.png raccoon_face.png --points cat_to_raccoon.csv -o morph.gif"
EXAMPLE = "wfluid animate raccoon.jpg -o nose.gif --push 621,451:22,15:period=1,radius=55"


_PLOT = {"metavar": "FILE.png", "help": "draw arrows, ways, deformed grid and convergence of keyframes"}


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, with the nearest flag or verb that exists."""

    def __init__(self, *arguments, **settings):
        super().__init__(*arguments, allow_abbrev=False, **settings)
        self._negative_number_matcher = re.compile(r"^-\.?\d")  # so that --wind -3,0 is a flag and its value

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

        from wfluid.cli.report import versions
        from wfluid.fields.device import open_device

        open_device()
        print("\n".join(f"{name} {version}" for name, version in versions().items()))
        print("devices: " + ", ".join(f"{device.alias} ({device.name})" for device in warp.get_devices()))
        parser.exit()


class Keys(argparse.Action):
    """Prints the keys of a scene file."""

    def __call__(self, parser, *_) -> NoReturn:
        """Load the schema only now, when it is asked for."""
        from wfluid.scene.reference import reference

        print(reference(), end="")
        parser.exit()


def build_parser() -> Parser:
    """The parser of the command line, with a sub-parser a command."""
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
    _drawn(animate)
    _made(animate)
    _followed(animate)
    _shot(animate)
    _running(animate)
    _common(animate)
    keyframes = verbs.add_parser(
        "keyframes",
        help="send points of a picture to places",
        description="Send points of a picture to places, in time: the forces that do it are found. "
        "Exits with 1 if a point stays away from its place by more than the tolerance.",
        epilog=f"example: {KEYFRAMES_EXAMPLE}",
    )
    keyframes.set_defaults(run=run_animate)
    keyframes.add_argument("picture", metavar="PICTURE", help="the picture to animate")
    add = keyframes.add_argument
    add("--move", **_repeated("X0,Y0:X1,Y1[@T]", "the point X0,Y0 should be at X1,Y1 at T seconds [px]"))
    add("--pin", **_repeated("X,Y", "this point should stay [px]"))
    add("--points", metavar="FILE.csv", help="moves in a file: from x, from y, to x, to y[, seconds]")
    add("--time", type=float, help="when points arrive whose time is not given [s] (1, or the duration)")
    add("--plot", **_PLOT)
    add("--tolerance", type=float, help="how far from its place a point may end [px] (0.25 of 512)")
    _drawn(keyframes)
    _made(keyframes)
    _followed(keyframes)
    _shot(keyframes)
    _running(keyframes)
    _common(keyframes)
    _add_morph(verbs)
    render = verbs.add_parser(
        "render",
        help="run a scene file",
        description="Run a scene file: everything a shot is made of, in TOML.",
        epilog="example: wfluid render shot.toml -o shot.gif --set time.duration=1",
    )
    render.set_defaults(run=run_render)
    render.add_argument("scene", metavar="SCENE.toml", help="the scene")
    render.add_argument("--keys", action=Keys, nargs=0, help="print every key of a scene, as Markdown")
    render.add_argument("--plot", **_PLOT)
    render.add_argument("-o", "--output", **_repeated("OUT", "write the picture here instead"))
    render.add_argument(
        "--set", **_repeated("KEY=VALUE", "change a value, such as time.duration=1 or force.nose.radius=40")
    )
    _running(render)
    _common(render)
    check = verbs.add_parser(
        "check-gradient",
        help="test the gradients of a scene",
        description="Test by Taylor's rates, in double precision, the gradients with respect to every number "
        "of a scene: 2 is exact, 1 is wrong.",
        epilog="example: wfluid check-gradient shot.toml --cells 32",
    )
    check.set_defaults(run=run_check_gradient)
    check.add_argument("scene", metavar="SCENE.toml", help="the scene")
    check.add_argument(
        "--set", **_repeated("KEY=VALUE", "change a value, such as time.duration=1 or force.nose.radius=40")
    )
    check.add_argument("--cells", type=int, default=48, help="cells along the longer side (48)")
    check.add_argument("--seed", type=int, default=0, help="of the random directions (0)")
    _common(check)
    warmup = verbs.add_parser(
        "warmup",
        help="compile the kernels now",
        description="Compile the kernels for a device, so that the first animation starts at once.",
        epilog="example: wfluid warmup --device cpu",
    )
    warmup.set_defaults(run=run_warmup)
    _common(warmup)
    return parser


def _add_morph(verbs) -> None:
    morph = verbs.add_parser(
        "morph",
        help="let one picture flow into another",
        description="Let one picture flow into another through points of both: the flow that takes the ones "
        "to the others is found. Exits with 1 if a point stays away by more than the tolerance.",
        epilog=f"example: {MORPH_EXAMPLE}",
    )
    unused = {"push": [], "vortex": [], "grow": [], "stroke": [], "wind": [], "noise": [], "force_image": []}
    unused |= {"ink": [], "smoke": [], "layer": [], "track": [], "tracks": None, "effect_mask": None}
    morph.set_defaults(run=run_animate, time=None, loop=None, substeps=None, **unused)
    add = morph.add_argument
    add("picture", metavar="A", help="the picture to begin with")
    add("to", metavar="B", help="the picture that it flows into")
    add("-o", "--output", **_OUTPUT)
    add("--points", metavar="FILE.csv", help="points that correspond: x in A, y in A, x in B, y in B [px]")
    add("--move", **_repeated("X0,Y0:X1,Y1", "the point X0,Y0 of A is X1,Y1 of B [px]"))
    add("--pin", **_repeated("X,Y", "this point of A should stay [px]"))
    add("--fit", help="how B covers A's frame: fill, fit (with bars) or stretch (fill)")
    add("--warp-curve", help="how far points are on their ways: linear, ease, or keys S:PART,… (ease)")
    add("--blend-curve", help="how much of B is seen, the same (ease)")
    add("--blend", help="what is mixed: linear light, or display values (linear)")
    add(
        "--timing",
        metavar="MASK[:DELAY]",
        help="a mask, white where it happens first, black DELAY later (0.5)",
    )
    add("--reverse", action="store_true", help="from B to A: the same frames, the last one first")
    add("--pingpong", action="store_true", help="there and back")
    add("--tolerance", type=float, help="how far from its place a point may end [px] (0.5 of 512)")
    add("--plot", **_PLOT)
    _made(morph)
    _shot(morph)
    _running(morph)
    _common(morph)


def _followed(parser: argparse.ArgumentParser) -> None:
    """The flags of what goes with the picture, and of the steps."""
    number = parser.add_argument
    number("--effect-mask", metavar="MASK", help="a mask, white where the forces act")
    number("--substeps", type=int, help="steps a frame (so many that dt <= 1/96 s; for keyframes 1/48 s)")
    number("--loop", help="oscillate, pingpong or crossfade: the end meets the beginning")
    number("--track", metavar="X,Y", action="append", default=[], help="follow this point; repeatable")
    number("--tracks", metavar="FILE.csv", help="write where the followed points go")
    number(
        "--layer",
        metavar="FILE",
        action="append",
        default=[],
        help="a picture or matte that goes through the same map, written beside OUT as OUT_FILE; repeatable",
    )


def _shot(parser: argparse.ArgumentParser) -> None:
    """The flags of grid, time and frames."""
    number = parser.add_argument
    number("--cells", type=int, help="cells along the longer side (256)")
    number("--walls", help="free-slip (default), no-slip, periodic, or two of them as X,Y")
    number("--scheme", help="standard (default), or paper: Euler, bilinear, Jacobi, phase 0")
    number("--solver", help="multigrid (default) or jacobi")
    number("--pressure-cycles", type=int, help="multigrid cycles a projection (3)")
    number("--fps", type=float, help="frames a second (15)")
    number("--duration", type=float, help="length [s] (2; of keyframes, to the last)")
    number("--seed", type=int, help="of noises that name none (0)")
    number("--width", type=int, help="width of the frames [px] (the picture's)")
    number("--scale", type=float, help="size of the frames as a factor, instead of --width")
    number("--filter", help="nearest, bilinear, cubic or lanczos (cubic)")
    number("--edge", help="clamp, mirror, wrap or transparent (clamp)")
    number("--colorspace", help="what the picture's numbers are: auto, srgb, linear (auto)")
    number("--start", type=int, help="number of a sequence's first frame (1001)")
    number("--type", help="numbers of a sequence: uint8, uint16, half, float (the picture's)")
    number("--compression", help="of EXR (zip, piz, dwaa, …) and TIFF (lzw, zip, …) sequences")
    number("--quality", type=int, help="of JPEG and WebP sequences, 1 … 100")
    number("--save-scene", metavar="FILE.toml", help="write what this command line says as a scene")


def _repeated(metavar: str, text: str) -> dict:
    return {"metavar": metavar, "action": "append", "default": [], "help": f"{text}; repeatable"}


_OUTPUT = _repeated("OUT", "x.gif, x.mp4, x.webm, or a sequence such as x.####.png")


def _drawn(parser: argparse.ArgumentParser) -> None:
    """The flags that say what moves the picture."""
    add = parser.add_argument
    timing = "start, end, at, period, phase, rise, fall, strength"
    add("-o", "--output", **_OUTPUT)
    add(
        "--push",
        **_repeated(
            "X,Y:DX,DY[:key=value,…]",
            f"push the point X,Y along the arrow DX,DY [px]; keys radius, {timing}",
        ),
    )
    spot = "with the keys of a push"
    add("--vortex", **_repeated("X,Y:DEGREES[:…]", f"twirl around X,Y, clockwise; {spot}"))
    add("--grow", **_repeated("X,Y:FACTOR[:…]", f"grow around X,Y, or shrink with a factor below 1; {spot}"))
    add("--stroke", **_repeated("X,Y/X,Y/…[:…]", "drag along a line; keys radius, start, end, strength"))
    add("--wind", **_repeated("DX,DY[:…]", "push everything; for periodic walls or under a mask"))
    add("--noise", **_repeated("PIXELS[:…]", "turbulence that carries so far; keys also scale, seed, change"))
    add(
        "--force-image",
        **_repeated(
            "FILE[:…]",
            "a force from a picture or self; keys also along (gradient, contour, vectors), amount [px]",
        ),
    )
    pours = "keys radius, amount, diffusion, lift [px], start, end, at, rise, fall"
    add("--ink", **_repeated("X,Y:#RRGGBB[:…]", f"pour ink of a colour; {pours}"))
    add("--smoke", **_repeated("X,Y:#RRGGBB[:…]", f"pour smoke of a colour; {pours}"))


def _made(parser: argparse.ArgumentParser) -> None:
    """The flags that say what the picture is made of."""
    add = parser.add_argument
    add(
        "--viscosity",
        type=float,
        help="viscosity [longer side^2/s] (0.001, keyframes 0.005, morph 0.03); of an image's white (0.1)",
    )
    add("--viscosity-image", metavar="FILE|self", help="a picture that is bright where the fluid is stiff")
    add("--viscosity-floor", type=float, help="viscosity where the viscosity image is black (0)")
    add("--invert-viscosity", action="store_true", help="stiff where the viscosity image is dark")
    add("--viscosity-moves", action="store_true", help="take the viscosity image along with the picture")
    add("--freeze", metavar="MASK[:STRENGTH]", help="a mask, white where the picture stays (drag 10000/s)")


def _running(parser: argparse.ArgumentParser) -> None:
    """The flags of whatever runs a scene."""
    parser.add_argument("--preview", metavar="FILE", help="draw the controls on the picture and stop")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and stop")
    parser.add_argument("--report", metavar="FILE.json", help="write settings, times and quality figures")


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--device", default=None, help="cpu (default), cuda, cuda:1, …")
    parser.add_argument("--quiet", action="store_true", help="no progress on stderr")
