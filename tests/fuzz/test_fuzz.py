"""Mutated and cut files of every readable kind: read with finite values, or refused in one line.

`--fuzz N` sets the number of files. They are read by `fuzz_worker.py`, in processes of their own with limits
of time and memory, so that a native library that ends or blocks the process is found, with the file that did.
"""

import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import OpenImageIO as oiio
import pytest
from fuzz_files import TEXT_ENDINGS, write_good_files
from fuzz_mutations import mutated_files

from wfluid.pictures.stills import read_picture

WORKER = Path(__file__).parents[1] / "support" / "fuzz_worker.py"

BATCH = 500
"""Files a process reads."""


def faults_of(paths, seconds=10.0, plant="none"):
    """What was wrong, as "name: why", and the number of files by format and outcome."""
    faults, counts = [], Counter()
    while paths:
        batch, paths = paths[:BATCH], paths[BATCH:]
        command = [sys.executable, WORKER, str(seconds), plant, *batch]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
        ended = [line.split()[1] for line in done.stdout.splitlines() if len(line.split()) == 2]
        counts.update((path.suffix, outcome) for path, outcome in zip(batch, ended, strict=False))
        if len(ended) < len(batch):
            why = done.stderr.strip()[-800:]
            if done.returncode == -signal.SIGALRM:
                why = f"no end after {seconds:g} s"
            faults.append(f"{batch[len(ended)].name}: exit {done.returncode}: {why}")
            paths = batch[len(ended) + 1 :] + paths
        elif done.returncode or done.stderr:
            faults.append(f"{batch[0].name} … {batch[-1].name}: exit {done.returncode}: {done.stderr[-800:]}")
    return faults, counts


def test_mutated_files_are_read_or_refused(tmp_path, request):
    faults, counts = faults_of(mutated_files(tmp_path, request.config.getoption("--fuzz")))
    for ending in sorted({ending for ending, _ in counts}):  # with -s
        print(f"{ending:6} {counts[ending, 'read']:5} read {counts[ending, 'refused']:5} refused")
    assert not faults, "\n".join(faults)


def test_the_good_files_are_of_every_format_that_is_read(tmp_path):
    """Of all that OpenImageIO reads, "null" is no file."""
    kinds = set()
    for path in write_good_files(tmp_path):
        if path.suffix in TEXT_ENDINGS:
            continue
        source = oiio.ImageInput.open(str(path))
        kinds.add(source.format_name())
        if not source.spec().deep:
            picture = read_picture(path)
            assert {picture.width, picture.height} == {40, 48}
    assert kinds == set(oiio.get_string_attribute("input_format_list").split(",")) - {"null"}


@pytest.mark.parametrize(
    ("plant", "says"),
    [
        ("crash", "exit -6"),
        ("hang", "no end after 2 s"),
        ("foreign", "KeyError"),
        ("nan", "values that are not finite"),
        ("lines", "one\\ntwo"),
        ("memory", "MemoryError"),
        ("noise", "libfoo: warning"),
    ],
)
def test_a_planted_fault_is_found(tmp_path, plant, says):
    write_good_files(tmp_path)
    paths = [tmp_path / name for name in ("plain.png", "mutated.png")]
    paths[1].write_bytes(paths[0].read_bytes())
    (fault,), _ = faults_of(paths, 2.0, plant)
    assert says in fault and "mutated.png" in fault
