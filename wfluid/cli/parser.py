"""The parser of the command line; the flags that describe a scene are in `flags`."""

from __future__ import annotations

import argparse
import re
from typing import Any, NoReturn

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
    "keyframes": "move points of a picture to targets",
    "morph": "morph one picture into another",
    "render": "run a scene file",
    "check-gradient": "test the gradients of a scene",
    "warmup": "compile the kernels now",
}
"""Short descriptions, by command."""

DESCRIPTIONS = {
    "animate": "Move a picture with forces and write the frames. The exit code is 1 if the picture folds.",
    "keyframes": "Move points of a picture to targets at given times: a search finds the forces. "
    "The exit code is 1 if the distance of a point from its target is larger than the tolerance, or if the "
    "picture folds.",
    "morph": "Morph one picture into another: a search finds the flow that moves points of the first picture "
    "to points of the second. The exit code is 1 if a distance is larger than the tolerance, or if a picture "
    "folds.",
    "render": "Run a scene file, a TOML file that describes one shot. The exit code is 1 if the picture "
    "folds.",
    "check-gradient": "Test the gradient with respect to every variable of a scene by Taylor rates, in "
    "double precision: a rate of 2 is right, 1 is wrong. The exit code is 1 if a rate is below 1.9.",
    "warmup": "Compile the kernels for a device, so that the first animation starts at once.",
}
"""Descriptions with exit codes, by command."""


class Parser(argparse.ArgumentParser):
    """Reports errors in one line, with the nearest known flag or verb."""

    def __init__(self, *arguments: Any, **settings: Any):
        super().__init__(*arguments, **{"allow_abbrev": False, **settings})
        self._negative_number_matcher = re.compile(r"^-\.?\d")  # so that --wind -3,0 is a flag and its value

    def parse_known_args(self, args=None, namespace=None):
        """Parse; refuse unknown flags here, where the flags of the verb are known."""
        options, unknown = super().parse_known_args(args, namespace)
        for word in unknown:
            flag = word.partition("=")[0]
            if not flag.startswith("-"):
                self.error(f"{word!r} is one argument too many")
            known = list(self._option_string_actions)
            self.error(f"there is no flag {flag}{_key_of(flag, known) or _nearest(flag, known)}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """Print the message and leave with exit code 2."""
        wrong = re.match(r"argument VERB: invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if wrong:
            near = _nearest(wrong[1], list(HELP)) or f"; expected {wrong[2]}"
            message = f"there is no verb {wrong[1]!r}{near}"
        if wrong := re.match(r"argument (\S+): invalid (int|float) value: (.*)", message):
            message = f"{wrong[1]} {wrong[3]}: expected a {'whole ' if wrong[2] == 'int' else ''}number"
        if wrong := re.match(r"argument (\S+): expected one argument", message):
            message = f"{wrong[1]}: its value is missing"
        self.exit(Exit.INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _nearest(word: str, known: list[str]) -> str:
    from wfluid.scene.types import nearest

    return nearest(word, known)


def _key_of(flag: str, known: list[str]) -> str:
    """How --set, where it is known, gives the value of another command's flag; empty if it does not."""
    if "--set" not in known:
        return ""
    from wfluid.scene.format import SCENE
    from wfluid.scene.schema import Key, Table

    for name, part in SCENE.keys.items():
        keys = {f"{name}.{inner}": one for inner, one in part.keys.items()} if isinstance(part, Table) else {}
        for path, key in (keys or {name: part}).items():
            if isinstance(key, Key) and key.flag == flag:
                return f"; give --set {path}=VALUE"
    return ""


class Version(argparse.Action):
    """Prints the versions of the libraries, and the devices."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Load the libraries only now."""
        import warp

        from wfluid.cli.report import versions
        from wfluid.fields.device import open_device

        open_device()
        print("\n".join(f"{name} {version}" for name, version in versions().items()))
        print("devices: " + ", ".join(f"{device.alias} ({device.name})" for device in warp.get_devices()))
        parser.exit()


class Keys(argparse.Action):
    """Prints the keys of a scene file."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Load the tables only now."""
        from wfluid.scene.reference import reference

        print(reference(), end="")
        parser.exit()


def build_parser(command: str | None = None) -> Parser:
    """The parser of the command line, with a sub-parser for each command.

    With `command`, only that one gets its flags: the tables behind them take time to load.
    """
    parser = Parser(
        prog="wfluid", description="Animate, warp and morph pictures by treating them as a fluid."
    )
    parser.add_argument("--version", action=Version, nargs=0, help="print the versions and devices, and stop")
    parser.epilog = "wfluid VERB --help lists the flags of a verb; example: " + EXAMPLES["animate"]
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
    parser.add_argument(
        "--keys", action=Keys, nargs=0, help="print every key of a scene as Markdown, and stop"
    )
    parser.add_argument(
        "-o", "--output", **repeated("OUT", "write the picture to OUT instead of the scene's outputs")
    )
    _add_scene_file(parser)
    parser.add_argument("--allow-folds", action="store_true", help="accept frames in which the picture folds")
    add_plot(parser)
    add_run(parser)


def _add_check_gradient_flags(parser: Parser, _: str) -> None:
    parser.set_defaults(run=run_check_gradient)
    _add_scene_file(parser)
    parser.add_argument("--cells", type=int, default=48, help="cells along the longer side (48)")
    parser.add_argument("--seed", type=int, default=0, help="random seed of the test directions (0)")
    add_device(parser)


def _add_warmup_flags(parser: Parser, _: str) -> None:
    parser.set_defaults(run=run_warmup)
    add_device(parser)


def _add_scene_file(parser: Parser) -> None:
    """Add the scene file and --set."""
    parser.add_argument("scene", metavar="SCENE.toml", help="the scene file")
    text = "change a value of the scene, such as time.duration=1 or force.nose.radius=40"
    parser.add_argument("--set", **repeated("KEY=VALUE", text))
