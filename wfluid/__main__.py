"""`python -m wfluid` is the command `wfluid`."""

import sys

from wfluid.cli.main import main

sys.exit(main())
