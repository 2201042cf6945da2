"""Native libraries are kept quiet; what the program prints is not lost."""

import subprocess
import sys

CODE = """
import os
from wfluid.system.quiet import quiet_libraries
print("before")
with quiet_libraries():
    os.write(1, b"library")
    os.write(2, b"library")
print("after", flush=True)
os.write(2, b"after")
"""


def test_only_the_output_of_libraries_is_dropped():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("before\nafter\n", "after")


def test_a_file_in_the_place_of_a_closed_stream_is_written_to(tmp_path):
    code = """
import os, sys
from wfluid.system.quiet import quiet_libraries
os.close(1)
sys.stdout = None
file = open(sys.argv[1], "wb", buffering=0)
with quiet_libraries():
    file.write(b"pixels")
sys.exit(file.fileno())
"""
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "file"])
    assert (done.returncode, (tmp_path / "file").read_bytes()) == (1, b"pixels")
