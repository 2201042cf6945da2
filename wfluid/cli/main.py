"""The command line: wfluid animate, keyframes, morph, render, check-gradient, warmup; wfluid --version.

Exit codes: 0 done, 1 the run failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any

from wfluid.cli.exits import Exit
from wfluid.cli.hints import fitted_hint
from wfluid.cli.parser import build_parser
from wfluid.cli.streams import safe_streams


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code.

    Without `arguments`, those of the process.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    with safe_streams() as failure:
        try:
            code = _run(words)
        except SystemExit as end:  # of the parser, such as after --help
            code = end.code if isinstance(end.code, int) else Exit.FAILED
        if code == Exit.DONE and (why := failure()):
            print(f"wfluid: failed: what it prints was cut off ({why})", file=sys.stderr)
            return Exit.FAILED
        return code


def _run(words: Sequence[str]) -> int:
    command = next((word for word in words if not word.startswith("-")), "")
    options = build_parser(command).parse_args(words)
    options.arguments = words
    warnings.simplefilter("ignore")
    warnings.filterwarnings("always", module="wfluid")
    verbose = getattr(options, "verbose", False)

    def show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
        text = str(message) if verbose else getattr(message, "plain", message)
        print(f"wfluid: warning: {fitted_hint(options.verb, str(text))}", file=sys.stderr)

    warnings.showwarning = show_warning
    try:
        return options.run(options)
    except ValueError as error:
        print(f"wfluid {options.verb}: {fitted_hint(options.verb, str(error))}", file=sys.stderr)
        return Exit.INPUT
    except KeyboardInterrupt:
        return Exit.INTERRUPTED
    except (RuntimeError, ArithmeticError, OSError, MemoryError) as error:
        why = fitted_hint(options.verb, str(error)) or type(error).__name__
        print(f"wfluid {options.verb}: failed: {why}", file=sys.stderr)
        return Exit.FAILED


if __name__ == "__main__":
    sys.exit(main())
