"""Every sample in a docstring (>>>) runs and prints what it says."""

import doctest
import importlib
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted((ROOT / "wfluid").rglob("*.py"))
    if ">>> " in path.read_text()
]
"""Those with samples."""


def failures(module):
    """What doctest reports of a module's samples."""
    runner, report = doctest.DocTestRunner(verbose=False), []
    for test in doctest.DocTestFinder(exclude_empty=True).find(module):
        runner.run(test, out=report.append)
    assert runner.tries, f"{module.__name__} has no samples"
    return "".join(report)


@pytest.mark.parametrize("name", MODULES)
def test_the_samples_of_a_module_run(device, name, tmp_path, monkeypatch):
    os.symlink(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    report = failures(importlib.import_module(name))
    assert not report, report
