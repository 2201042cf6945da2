"""`python -m wfluid` is the command `wfluid`."""

import sys

from wfluid.cli import main

sys.exit(main())
