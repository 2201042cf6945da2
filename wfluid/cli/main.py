"""The command line: wfluid animate, keyframes, morph, render, check-gradient, warmup; wfluid --version.

Exit codes: 0 done, 1 the run failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

from wfluid.cli.exits import Exit
from wfluid.cli.parser import build_parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code.

    Without `arguments`, those of the process.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    command = next((word for word in words if not word.startswith("-")), "")
    options = build_parser(command).parse_args(words)
    options.arguments = words
    warnings.simplefilter("ignore")
    warnings.filterwarnings("always", module="wfluid")
    warnings.showwarning = _show_warning
    try:
        return options.run(options)
    except ValueError as error:
        print(f"wfluid {options.verb}: {error}", file=sys.stderr)
        return Exit.INPUT
    except KeyboardInterrupt:
        return Exit.INTERRUPTED
    except (RuntimeError, ArithmeticError, OSError, MemoryError) as error:
        print(f"wfluid {options.verb}: failed: {error or type(error).__name__}", file=sys.stderr)
        return Exit.FAILED


def _show_warning(message, *_, **__) -> None:
    print(f"wfluid: warning: {message}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
