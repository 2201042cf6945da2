"""wfluid check-gradient: a table of Taylor rates, an exit code that tells right from wrong."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import wfluid.cli.check_gradient
from wfluid.cli.main import main
from wfluid.gradient.taylor import Rate, taylor_rates
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture
from wfluid.scene.toml_file import read_scene

SCENE = """
wfluid = 1
[picture]
file = "p.png"
size = [24, 20]
[time]
duration = 0.125
fps = 8
[viscosity]
value = 0.01
[[density]]
name = "ink"
[[density.source]]
center = [12, 10]
amount = 3
radius = 4
[[force]]
kind = "push"
center = [9, 11]
by = [3, 1]
radius = 5
period = 0.5
{more}
"""


@pytest.fixture
def scene(tmp_path):
    pixels = np.linspace(0, 1, 24 * 20 * 3, dtype=np.float32).reshape(20, 24, 3)
    write_picture(tmp_path / "p.png", Picture(pixels, None, "uint8", None))

    def make(more=""):
        path = tmp_path / "s.toml"
        path.write_text(SCENE.format(more=more))
        return path

    return make


def run(*arguments):
    command = [sys.executable, "-m", "wfluid", "check-gradient", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_every_number_of_a_scene_stands_in_the_table_with_rate_two(scene):
    more = '[[force]]\nkind = "grow"\ncenter = [15, 8]\nfactor = 1.2\nradius = 4\n'
    result = run(scene(more), "--cells", 16)
    assert result.returncode == 0, result.stdout + result.stderr
    table = {line.split()[0]: line.split() for line in result.stdout.splitlines()[2:]}
    names = {name.partition("]")[2].lstrip(".") for name in table if name.startswith("forces[0]")}
    assert names == {
        "vector",
        "center",
        "radius",
        "envelope.amplitude",
        "envelope.period",
        "envelope.phase",
    }
    for name in ("forces[1].rate", "fluid.viscosity", "velocity", "fluid.densities[0].sources[0].rate"):
        assert name in table
    rates = [float(words[4]) for words in table.values() if words[4] != "linear"]
    assert len(rates) >= 9
    assert min(rates) >= 1.9, result.stdout
    assert sum(rate <= 2.1 for rate in rates) >= len(rates) - 2, (
        result.stdout
    )  # a cubic remainder is right too
    assert " float64:" in result.stdout


def test_bad_input_is_one_line_and_exit_code_two(scene, tmp_path):
    for arguments, says in [
        ((tmp_path / "none.toml",), "none.toml"),
        ((scene(), "--set", "force.1.radius=-1"), "radius"),
        ((scene(), "--cells", "2"), "cells"),
        ((scene(), "--sells", "20"), "did you mean --cells"),
    ]:
        result = run(*arguments)
        assert result.returncode == 2, result.stderr
        assert says in result.stderr and result.stderr.count("\n") == 1, result.stderr


def test_a_rate_that_fails_is_exit_code_one(scene, monkeypatch, capsys):
    rates = [Rate("good", 1, 1.0, 1e-6, 2.0), Rate("bad", 2, 1.0, 0.5, 1.02)]
    monkeypatch.setattr(wfluid.cli.check_gradient, "taylor_rates", lambda functional, seed: rates)
    read = read_scene(scene())
    assert wfluid.cli.check_gradient.check_gradient(read, 16, None, 0) == 1
    good, bad = capsys.readouterr().out.splitlines()[-2:]
    assert "below" in bad and "below" not in good
    rates.pop()
    assert wfluid.cli.check_gradient.check_gradient(read, 16, None, 0) == 0


def quadratic(wrong):
    """f = sum of m^2 over two slices, one linear term; the gradient of the second slice off by a factor."""
    factor = np.array([1.0, 1.0, wrong, wrong, 1.0])

    def value(m):
        return float(np.sum(m[:4] ** 2 * [1, 2, 3, 4]) + 5 * m[4] + 7)

    def value_and_gradient(m):
        return value(m), factor * np.append(2 * m[:4] * [1, 2, 3, 4], 5.0)

    slices = [SimpleNamespace(name=f"{a}", entries=slice(a, b)) for a, b in ((0, 2), (2, 4), (4, 5))]
    return SimpleNamespace(
        start=np.ones(5),
        value=value,
        value_and_gradient=value_and_gradient,
        variables=SimpleNamespace(slices=slices),
    )


def test_taylors_test_tells_a_wrong_gradient_from_a_right_one():
    """Of a quadratic the remainder is the square itself: rate 2; of a gradient 0.1 % off it is not."""
    right = list(taylor_rates(quadratic(1.0)))
    assert [rate.holds for rate in right] == [True, True, True]
    assert all(abs(rate.rate - 2) < 1e-3 for rate in right[:2]) and np.isinf(right[2].rate)
    wrong = list(taylor_rates(quadratic(1.001)))
    assert [rate.holds for rate in wrong] == [True, False, True]
    assert wrong[1].rate < 1.2


def test_warmup_builds_the_adjoints_kernels_too(monkeypatch):
    loaded = []

    def load(device, module="wfluid"):
        loaded.append(module)
        return 0.0

    monkeypatch.setattr("wfluid.fields.device.load_kernels", load)
    assert main(["warmup", "--quiet"]) == 0
    assert loaded == ["wfluid", "wfluid.adjoint"]
