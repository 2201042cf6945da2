"""The command line for tests, in this process or in a separate one."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
import warnings
from dataclasses import dataclass

from wfluid.cli.main import main


@dataclass(frozen=True)
class Ended:
    """The result of a command, with the names of `subprocess.CompletedProcess`."""

    returncode: int
    stdout: str
    stderr: str


def wfluid(*arguments) -> Ended:
    """Run a command line in this process, without start-up time; exceptions reach the test."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as end:  # argparse
            code = end.code
    return Ended(code, out.getvalue(), err.getvalue())


def wfluid_process(*arguments, **settings) -> subprocess.CompletedProcess[str]:
    """Run a command line in a separate process, with exit code, tracebacks and output of libraries."""
    command = [sys.executable, "-m", "wfluid", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **settings)
