"""Flags that several commands share."""

from __future__ import annotations

import argparse
from typing import Any


def add_run(parser: argparse.ArgumentParser) -> None:
    """Add the flags of commands that run a scene."""
    parser.add_argument(
        "--preview", metavar="FILE", help="draw the controls on the picture, write it to FILE, and stop"
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="print what a run would compute and write, and stop; --preview and --save-scene still write",
    )
    parser.add_argument(
        "--report", metavar="FILE.json", help="write settings, times and quality measures as JSON"
    )
    parser.add_argument(
        "--verbose", action="store_true", help="add residuals, iterations and objectives to the messages"
    )
    add_device(parser)


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add the flag for a figure of a search."""
    text = "draw keyframes, paths, deformed grid and convergence of the search"
    parser.add_argument("--plot", metavar="FILE.png", help=text)


def add_device(parser: argparse.ArgumentParser) -> None:
    """Add the flags for device and progress."""
    parser.add_argument("--device", default=None, help="cpu, cuda, cuda:1, … (cpu)")
    parser.add_argument("--quiet", action="store_true", help="print no progress, notes and last line")


def repeated(metavar: str, text: str) -> dict[str, Any]:
    """Arguments of `add_argument` for a repeatable flag."""
    return {"metavar": metavar, "action": "append", "default": [], "help": f"{text}; repeatable"}
