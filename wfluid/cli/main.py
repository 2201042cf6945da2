"""The command line: wfluid animate, keyframes, morph, render, check-gradient, warmup; wfluid --version.

Exit codes: 0 done, 1 the run failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

from wfluid.cli.exits import EXIT_FAILED, EXIT_INPUT, EXIT_INTERRUPTED
from wfluid.cli.parser import build_parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code."""
    options = build_parser().parse_args(arguments)
    options.arguments = sys.argv[1:] if arguments is None else list(arguments)
    warnings.simplefilter("ignore")
    warnings.filterwarnings("always", module="wfluid")
    warnings.showwarning = _show_warning
    from wfluid.pictures.formats import PictureError

    try:
        return options.run(options)
    except (PictureError, ValueError) as error:
        print(f"wfluid {options.verb}: {error}", file=sys.stderr)
        return EXIT_INPUT
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except (RuntimeError, ArithmeticError, OSError, MemoryError) as error:
        print(f"wfluid {options.verb}: failed: {error or type(error).__name__}", file=sys.stderr)
        return EXIT_FAILED


def _show_warning(message, *_, **__) -> None:
    print(f"wfluid: warning: {message}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
