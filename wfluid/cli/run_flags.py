"""The flags of whatever runs."""

from __future__ import annotations

import argparse
from typing import Any


def add_run(parser: argparse.ArgumentParser) -> None:
    """The flags of whatever runs a scene."""
    parser.add_argument("--preview", metavar="FILE", help="draw the controls on the picture and stop")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and stop")
    parser.add_argument("--report", metavar="FILE.json", help="write settings, times and quality figures")
    add_device(parser)


def add_plot(parser: argparse.ArgumentParser) -> None:
    """The figure of a search."""
    text = "draw arrows, ways, deformed grid and convergence of keyframes"
    parser.add_argument("--plot", metavar="FILE.png", help=text)


def add_device(parser: argparse.ArgumentParser) -> None:
    """Where it runs."""
    parser.add_argument("--device", default=None, help="cpu (default), cuda, cuda:1, …")
    parser.add_argument("--quiet", action="store_true", help="no progress on stderr")


def repeated(metavar: str, text: str) -> dict[str, Any]:
    """Settings of a flag that may be given several times."""
    return {"metavar": metavar, "action": "append", "default": [], "help": f"{text}; repeatable"}
