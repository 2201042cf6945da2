"""Every example runs small and its check holds; the README's code runs."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def load(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_oscillators_check_holds(device):
    example = load("oscillator")
    frames = list(example.animation(cells=96, width=160, device=device.alias).frames())
    figures = example.check(frames)
    print(figures)
    with pytest.raises(AssertionError):
        example.check(frames[:4])  # a quarter of a period is no swing


def test_examples_refuse_unknown_options(tmp_path):
    for path in (ROOT / "examples").glob("*.py"):
        result = subprocess.run(
            [sys.executable, str(path), "--nonsense"], cwd=tmp_path, capture_output=True, text=True
        )
        assert result.returncode == 2 and "Traceback" not in result.stderr
        assert list(tmp_path.iterdir()) == []


def test_an_example_writes_its_animation(tmp_path):
    command = [sys.executable, str(ROOT / "examples" / "oscillator.py"), "--frames", "3", "--cells", "32"]
    result = subprocess.run([*command, "--width", "120"], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "raccoon.gif").stat().st_size > 1000


def test_the_readmes_python_runs(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    os.symlink(ROOT / "examples", tmp_path / "examples")
    result = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "nose.gif").exists()


def test_every_option_of_the_command_is_in_the_readme():
    from wfluid.cli import _parser
    from wfluid.push import KEYS

    text = (ROOT / "README.md").read_text()
    (verbs,) = [a for a in _parser()._actions if a.dest == "verb"]
    for verb, parser in verbs.choices.items():
        assert f"wfluid {verb}" in text
        for action in parser._actions:
            for flag in action.option_strings:
                assert flag in ("-h", "--help", "--output") or f"{flag}" in text, f"{verb} {flag}"
    assert all(f"`{key}`" in text for key in KEYS)
