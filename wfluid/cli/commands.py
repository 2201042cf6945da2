"""The commands, each run with its parsed flags."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wfluid.scene.scene import Scene


def run_warmup(options: argparse.Namespace) -> int:
    """Compile the kernels."""
    from wfluid.fields.device import load_kernels, open_device
    from wfluid.kernels.cell.program import ADJOINT

    device = open_device(options.device)
    seconds = load_kernels(device) + load_kernels(device, ADJOINT)
    if not options.quiet:
        print(f"kernels for {device.name}: {seconds:.1f} s", file=sys.stderr)
    return 0


def run_animate(options: argparse.Namespace) -> int:
    """Make the scene of the flags and run it."""
    from wfluid.cli.options import scene_of_options

    return _run(scene_of_options(options), options)


def run_render(options: argparse.Namespace) -> int:
    """Read a scene, change the values given by --set, and run it."""
    from wfluid.scene.toml_file import read_scene

    settings = [*options.set, *(["frames.allow_folds=true"] if options.allow_folds else [])]
    scene = read_scene(options.scene).with_values(settings)
    return _run(scene.writing(options.output, options.report), options)


def run_check_gradient(options: argparse.Namespace) -> int:
    """Test the gradients of a scene; in a second process if this one is not in double precision."""
    double = {"WFLUID_PRECISION": "float64"}
    if os.environ.get("WFLUID_PRECISION") != double["WFLUID_PRECISION"]:
        import subprocess

        command = [sys.executable, "-m", "wfluid", *options.arguments]
        return subprocess.call(command, env={**os.environ, **double})
    from wfluid.cli.check_gradient import check_gradient
    from wfluid.scene.toml_file import read_scene

    if options.seed < 0:
        raise ValueError(f"--seed {options.seed}: expected a whole number from 0 on")
    scene = read_scene(options.scene).with_values(options.set)
    return check_gradient(scene, options.cells, options.device, options.seed)


def _run(scene: Scene, options: argparse.Namespace) -> int:
    from wfluid.cli.checks import RunOptions
    from wfluid.cli.render import run_scene

    run = RunOptions(
        device=options.device,
        quiet=options.quiet,
        verbose=options.verbose,
        verb=options.verb,
        dry_run=options.dry_run,
        preview=options.preview,
        save_scene=getattr(options, "save_scene", None),
        plot=getattr(options, "plot", None),
        points=getattr(options, "points", None),
    )
    return run_scene(scene, run)
