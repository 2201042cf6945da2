"""What needs double precision runs in a process of its own: precision is chosen once a process."""

import os
import subprocess
import sys
from pathlib import Path


def test_what_is_marked_float64_holds_in_double_precision(request):
    command = [sys.executable, "-m", "pytest", "-m", "float64", str(Path(__file__).parent)]
    command += ["--device", request.config.getoption("--device"), "-p", "no:cacheprovider"]
    environment = dict(os.environ, WFLUID_PRECISION="float64")
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-2000:]
    assert " passed" in result.stdout, "no test ran in double precision"
