"""Compiled kernels that are damaged are found before they are run, and built again."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from wfluid.fields.device import load_kernels
from wfluid.fields.kernel_cache import load_intact


def damaged(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


DAMAGES = {
    "a bit": lambda folder: damaged(folder / "m.o"),
    "cut": lambda folder: (folder / "m.o").write_bytes(b"code"),
    "emptied": lambda folder: (folder / "m.meta").write_bytes(b""),
    "sums": lambda folder: (folder / "wfluid.sha256").write_bytes(b"\xff\n\n"),
    "all": lambda folder: [path.write_bytes(b"?") for path in folder.iterdir()],
    "no folder": lambda folder: (shutil.rmtree(folder), folder.write_bytes(b"")),
}


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Loads "kernels" as in a new process; says what it did."""
    folder = tmp_path / "kernels"

    def build_or_load():
        if (folder / "m.o").exists():
            return "loaded"
        folder.mkdir(exist_ok=True)
        for name in ("m.o", "m.meta", "m.cpp"):
            (folder / name).write_bytes(b"code" * 100)
        return "built"

    def load():
        monkeypatch.setattr("wfluid.fields.kernel_cache._LOADED", set())
        return load_intact(folder, build_or_load)

    return load


def test_what_was_built_is_loaded(load):
    assert [load(), load(), load()] == ["built", "loaded", "loaded"]


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_built_again_and_said(load, tmp_path, damage):
    load()
    DAMAGES[damage](tmp_path / "kernels")
    with pytest.warns(UserWarning, match="are damaged: they are built again"):
        assert load() == "built"
    assert load() == "loaded"


def test_what_does_not_load_is_built_again(tmp_path):
    """Of a cache without checksums."""
    folder = tmp_path / "old"
    folder.mkdir()
    calls = []

    def load():
        calls.append(folder.exists())
        if folder.exists():
            raise Exception("no object file")
        folder.mkdir()
        return "built"

    with pytest.warns(UserWarning, match="damaged"):
        assert load_intact(folder, load) == "built"
    assert calls == [True, False]


def test_missing_files_are_left_to_warp(load, tmp_path):
    load()
    (tmp_path / "kernels" / "m.o").unlink()
    assert load() == "built"


def test_a_cache_that_cannot_be_written_to_is_refused_with_the_remedy(device, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("wfluid.fields.device.load_intact", fail)
    with pytest.raises(RuntimeError, match=r"\(No space left on device\); name another folder in WARP_CACHE"):
        load_kernels(device)


@pytest.mark.long
def test_a_run_with_a_damaged_cache_rebuilds_it(tmp_path):
    """The machine code would crash the process."""
    code = """
import sys
from wfluid.fields.device import _folder, load_kernels, open_device
import wfluid.step.solver
device = open_device()
load_kernels(device)
print(_folder(device, "wfluid"))
"""
    environment = {**os.environ, "WARP_CACHE_PATH": str(tmp_path)}

    def run():
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=200, env=environment
        )

    (binary,) = Path(run().stdout.strip()).glob("*.o")
    data = bytearray(binary.read_bytes())
    data[1000:60_000] = b"\x17" * 59_000
    binary.write_bytes(data)
    again = run()
    assert again.returncode == 0 and again.stderr.count("are damaged: they are built again") == 1
    assert "damaged" not in run().stderr
    assert wp.config.kernel_cache_dir != str(tmp_path)
