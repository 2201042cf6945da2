"""wfluid: animate, warp and morph pictures by treating them as a fluid.

>>> from wfluid import Fluid, GaussianForce, Oscillator, animate, write_animation
>>> nose = GaussianForce((0.61, 0.44), (1.5, 1.0), 0.06, Oscillator(period=1.0))
>>> frames = animate("examples/images/raccoon.jpg", Fluid(), nose, duration=0.25, cells=64)
>>> frames
Run(7 frames at 24 per second)
>>> write_animation("nose.gif", frames)
[PosixPath('nose.gif')]

One unit of length is the picture's longer side, one unit of time a second; x points right, y down.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

__version__ = "0.1.0"


@cache
def _homes() -> dict[str, str]:
    """The module of each public name: the imports of __init__.pyi, which type checkers read too."""
    import ast
    import pathlib

    return {
        alias.name: node.module
        for node in ast.parse(pathlib.Path(__file__).with_suffix(".pyi").read_text()).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `import wfluid` loads neither Warp nor OpenImageIO."""
    if name == "__all__":
        return ["__version__", *_homes()]
    if name not in _homes():
        raise AttributeError(f"module 'wfluid' has no attribute {name!r}")
    return getattr(import_module(_homes()[name]), name)


def __dir__() -> list[str]:
    return sorted(["__version__", *_homes()])
