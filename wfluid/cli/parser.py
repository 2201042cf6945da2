"""The commands and their parsers; the flags that say a scene are in `flags`, which loads its tables."""

from __future__ import annotations

import argparse
import re
from typing import NoReturn

from wfluid.cli.commands import run_animate, run_check_gradient, run_render, run_warmup
from wfluid.cli.exits import Exit
from wfluid.cli.run_flags import add_device, add_plot, add_run, repeated

EXAMPLES = {
    "animate": "wfluid animate raccoon.jpg -o nose.gif --push 621,451:22,15:period=1,radius=55",
    "keyframes": "wfluid keyframes cat.png -o look.gif --move 210,160:230,140 --pin 300,220",
    "morph": "wfluid morph cat.png raccoon_face.png --points cat_to_raccoon.csv -o morph.gif",
    "render": "wfluid render shot.toml -o shot.gif --set time.duration=1",
    "check-gradient": "wfluid check-gradient shot.toml --cells 32",
    "warmup": "wfluid warmup --device cpu",
}
"""By command."""

HELP = {
    "animate": "move a picture with forces",
    "keyframes": "send points of a picture to places",
    "morph": "let one picture flow into another",
    "render": "run a scene file",
    "check-gradient": "test the gradients of a scene",
    "warmup": "compile the kernels now",
}
"""What a command does, in a few words."""

DESCRIPTIONS = {
    "animate": "Move a picture with forces and write the frames.",
    "keyframes": "Send points of a picture to places, in time: the forces that do it are found. "
    "Exits with 1 if a point stays away from its place by more than the tolerance.",
    "morph": "Let one picture flow into another through points of both: the flow that takes the ones to the "
    "others is found. Exits with 1 if a point stays away by more than the tolerance.",
    "render": "Run a scene file: everything a shot is made of, in TOML.",
    "check-gradient": "Test by Taylor's rates, in double precision, the gradients with respect to every "
    "number of a scene: 2 is exact, 1 is wrong.",
    "warmup": "Compile the kernels for a device, so that the first animation starts at once.",
}
"""What a command does, with what it ends with."""


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
            self.error(f"there is no flag {flag}{_nearest(flag, list(self._option_string_actions))}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """Print the message and leave with exit code 2."""
        wrong = re.match(r"argument VERB: invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if wrong:
            near = _nearest(wrong[1], list(HELP)) or f"; expected {wrong[2]}"
            message = f"there is no verb {wrong[1]!r}{near}"
        self.exit(Exit.INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _nearest(word: str, known: list[str]) -> str:
    from wfluid.scene.types import nearest

    return nearest(word, known)


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


def build_parser(command: str | None = None) -> Parser:
    """The parser of the command line, with a sub-parser a command.

    Where a command is named, only it gets its flags: those that say a scene take a while to load.
    """
    parser = Parser(
        prog="wfluid", description="Animate, warp and morph pictures by treating them as a fluid."
    )
    parser.add_argument("--version", action=Version, nargs=0, help="versions of wfluid and what it runs on")
    parser.epilog = "wfluid VERB --help explains a verb; example: " + EXAMPLES["animate"]
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=Parser)
    for name, add_flags in (
        ("animate", _add_scene_flags),
        ("keyframes", _add_scene_flags),
        ("morph", _add_scene_flags),
        ("render", _add_render_flags),
        ("check-gradient", _add_check_gradient_flags),
        ("warmup", _add_warmup_flags),
    ):
        verb = verbs.add_parser(
            name, help=HELP[name], description=DESCRIPTIONS[name], epilog=f"example: {EXAMPLES[name]}"
        )
        if command in (None, name):
            add_flags(verb, name)
    return parser


def _add_scene_flags(parser: Parser, command: str) -> None:
    from wfluid.cli.flags import add_animate, add_keyframes, add_morph

    parser.set_defaults(run=run_animate)
    {"animate": add_animate, "keyframes": add_keyframes, "morph": add_morph}[command](parser)


def _add_render_flags(parser: Parser, _: str) -> None:
    parser.set_defaults(run=run_render)
    parser.add_argument("--keys", action=Keys, nargs=0, help="print every key of a scene, as Markdown")
    parser.add_argument("-o", "--output", **repeated("OUT", "write the picture here instead"))
    _add_scene_file(parser)
    add_plot(parser)
    add_run(parser)


def _add_check_gradient_flags(parser: Parser, _: str) -> None:
    parser.set_defaults(run=run_check_gradient)
    _add_scene_file(parser)
    parser.add_argument("--cells", type=int, default=48, help="cells along the longer side (48)")
    parser.add_argument("--seed", type=int, default=0, help="of the random directions (0)")
    add_device(parser)


def _add_warmup_flags(parser: Parser, _: str) -> None:
    parser.set_defaults(run=run_warmup)
    add_device(parser)


def _add_scene_file(parser: Parser) -> None:
    """The scene file, and what is set in it."""
    parser.add_argument("scene", metavar="SCENE.toml", help="the scene")
    text = "change a value, such as time.duration=1 or force.nose.radius=40"
    parser.add_argument("--set", **repeated("KEY=VALUE", text))
