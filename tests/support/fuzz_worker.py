"""A process that reads mutated files, and ends with an error at the first that is not read or refused.

`fuzz_worker.py SECONDS PLANT FILE…` prints the number of each file as it starts, then "read" or "refused".
A file that takes longer than SECONDS ends the process by a signal; memory beyond the limit cannot be had.
PLANT is a fault of `PLANTS`, put into the reader, or "none".
"""

import os
import resource
import signal
import sys
import time
from pathlib import Path

import numpy as np

import wfluid.pictures.stills as stills
from wfluid.system.errors import FileError

MEMORY = 1 << 30
"""Memory that a file may take [bytes]; half of it counts as free."""


def _noise(path):
    os.write(2, b"libfoo: warning\n")
    return _READ(path)


def _spoiled(path):
    picture = _READ(path)
    return picture.with_pixels(np.full_like(picture.pixels, np.nan))


def _foreign(path):
    raise KeyError(path)


def _two_lines(path):
    raise stills.PictureError(f"{path}: one\ntwo")


PLANTS = {
    "crash": lambda path: os.abort(),
    "hang": lambda path: time.sleep(1000),
    "foreign": _foreign,
    "nan": _spoiled,
    "lines": _two_lines,
    "memory": lambda path: np.ones(2 * MEMORY, np.uint8),
    "noise": _noise,
}
"""Faults that a reader may have, by name, in place of `read_picture`."""

_READ = stills.read_picture

if sys.argv[2] in PLANTS:

    def _planted(path, *_, **__):
        return PLANTS[sys.argv[2]](path) if "mutated" in str(path) else _READ(path)

    stills.read_picture = _planted

# what follows takes over the reader
from wfluid.domain.walls import Walls  # noqa: E402
from wfluid.files.points import read_points  # noqa: E402
from wfluid.model.force import flatten  # noqa: E402
from wfluid.model.image_force import ImageForce  # noqa: E402
from wfluid.pictures import reading  # noqa: E402
from wfluid.scene.scene import Scene  # noqa: E402
from wfluid.scene.schema import SceneError  # noqa: E402
from wfluid.scene.toml_file import read_scene  # noqa: E402
from wfluid.staging.build import StagedMorph, stage_all  # noqa: E402

PLAIN = {"wfluid": 1, "picture": {"file": "plain.png"}, "fluid": {"cells": 16}, "time": {"fps": 10}}
MOVES = {"move": [{"from": [10.0, 20.0], "to": [12.0, 20.0]}]}
PUSH = {"kind": "push", "center": [10.0, 20.0], "by": [3.0, 0.0]}

USES = {
    "picture": lambda file: {"picture": {"file": file}, "force": [{**PUSH, "center": [0.0, 0.0]}]},
    "layer": lambda file: {"layer": [{"name": "a", "file": file}], "force": [PUSH]},
    "effect mask": lambda file: {"effect": {"mask": file}, "force": [PUSH]},
    "freeze mask": lambda file: {"freeze": {"mask": file}, "force": [PUSH]},
    "viscosity": lambda file: {"viscosity": {"image": file}, "force": [PUSH]},
    "slopes": lambda file: {"force": [{"kind": "image", "file": file, "along": "contour"}]},
    "vectors": lambda file: {"force": [{"kind": "image", "file": file, "along": "vectors"}]},
    "density": lambda file: {"density": [{"name": "a", "image": file, "source": [{"image": file}]}]},
    "morph": lambda file: {"morph": {"to": file}, "keyframes": MOVES},
    "timing mask": lambda file: {"morph": {"to": "plain.png", "timing": file}, "keyframes": MOVES},
}
"""Tables of a scene that use a file."""


def use(path: Path, number: int) -> None:
    """Read a file, and make the objects of a scene that uses it in one of many ways.

    Raises:
        ValueError: the file is refused.
    """
    if path.suffix == ".csv":
        rows = read_points(path)
        assert rows, "no rows"
        _check_finite([(*row.source, *row.target, row.time or 1.0) for row in rows])
        _stage({"keyframes": {"points": path.name}}, path.parent)
    elif path.suffix == ".toml":
        _check(stage_all(read_scene(path)))
    else:
        _check_finite(stills.read_picture(path).pixels)
        uses = list(USES.values())
        _stage(uses[number % len(uses)](path.name), path.parent)


def _stage(tables: dict, folder: Path) -> None:
    _check(stage_all(Scene({**PLAIN, **tables}, folder)))


def _check(staged) -> None:
    """Check that every number of a scene's objects is finite, as far as it comes from files."""
    animation = staged.animation
    fluid, grid = animation.fluid, animation.grid
    pictures = [animation.picture, *animation.layers.values()]
    paintings = [fluid.viscosity, *(density.initial for density in fluid.densities)]
    paintings += [source for density in fluid.densities for source in density.sources]
    if isinstance(staged, StagedMorph):
        pictures += [staged.pair.a, staged.pair.b]
        paintings.append(staged.settings.mask)
    for picture in pictures:
        _check_finite(picture.pixels)
    for painting in paintings:
        painting = getattr(painting, "picture", painting)
        if hasattr(painting, "sample"):
            _check_finite(painting.sample(grid))
    if fluid.freeze:
        _check_finite(fluid.freeze.sample(grid))
    for force in flatten(animation.forces):
        if force.weight:
            _check_finite(force.weight.sample(grid))
        if isinstance(force, ImageForce):
            for along in force.fields(grid, Walls()):
                for values in along:
                    _check_finite(values)


def _check_finite(values) -> None:
    assert np.isfinite(values).all(), "values that are not finite"


def _size() -> int:
    """Size of the process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def run(paths: list[Path], seconds: float) -> None:
    """Use files, each within its limits of time and memory."""
    reading.free_memory = lambda: MEMORY // 2
    use(paths[0].parent / "plain.png", 0)  # loads libraries
    limit = _size() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for number, path in enumerate(paths):
        print(number, end=" ", flush=True)
        signal.setitimer(signal.ITIMER_REAL, seconds)
        try:
            use(path, number)
            print("read")
        except (FileError, SceneError) as error:
            assert "\n" not in str(error) and len(str(error)) < 1000, repr(error)
            print("refused")
        signal.setitimer(signal.ITIMER_REAL, 0)


if __name__ == "__main__":
    run([Path(name) for name in sys.argv[3:]], float(sys.argv[1]))
