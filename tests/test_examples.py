"""Every example runs small and its check holds; the README's code runs."""

import importlib.util
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from wfluid import Morph, Timeline, match_keyframes, read_scene
from wfluid.morphing.settings import MorphSettings
from wfluid.staging.build import stage_all

ROOT = Path(__file__).parents[1]

SCENES, SEARCHED = ROOT / "examples" / "scenes", ("keyframes", "morph")
"""The scenes, and those whose forces were found by a search."""


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


def test_the_viscosity_check_holds(device):
    example = load("viscosity")
    made = [list(a.frames()) for a in example.animations(cells=64, width=96, device=device.alias)]
    print(example.check(made))
    assert example.side_by_side([frames[-1] for frames in made]).pixels.shape == (96, 288, 3)
    with pytest.raises(AssertionError):
        example.check(made[::-1])


def test_the_variable_viscosity_check_holds(device):
    """Strain in the stiff mask at most 0.12 of the free one, frozen eyes at most 1/100 of what is around."""
    example = load("variable_viscosity")
    made = [list(a.frames()) for a in example.animations(cells=128, width=96, device=device.alias)]
    print(example.check(made))
    assert example.sheet([frames[-1] for frames in made]).pixels.shape == (144, 288, 3)
    with pytest.raises(AssertionError):
        example.check([made[1], made[0], made[2]])
    with pytest.raises(AssertionError):
        example.check([made[0], made[1], made[1]])


def test_the_sensitivity_check_holds(device):
    """Stiffening where the gradient says takes from the nose's way what it foretold, within 3 %."""
    figures = load("sensitivity").check(cells=48, device=device.alias)
    assert figures["lost_here"] > 0.2


def test_the_keyframes_check_holds(device):
    """Every arrow's point arrives to a quarter of a pixel, in the flow and in the picture."""
    example = load("keyframes")
    match = example.matched(96, 0.5, ("left eye", "nose"), device=device.alias)
    print(example.check(match))
    moved = replace(match.arrivals[0], source=(0.5, 0.5))
    with pytest.raises(AssertionError):
        example.check(replace(match, arrivals=(moved, *match.arrivals[1:])))


def test_the_keyframe_paths_check_holds(device):
    """The nose is at every place of its circle in time; fewer places, or a nose beside one, fail."""
    example = load("keyframe_path")
    match = example.matched(cells=64, width=64, stops=2, device=device.alias)
    print(example.check(match, stops=2))
    with pytest.raises(AssertionError):
        example.check(match)


@pytest.mark.long
def test_every_scene_shows_its_control(device):
    """Each moves and does not fold; areas change by what the growth says and by nothing else."""
    example = load("scene_sheet")
    made = example.animations(cells=64, width=32, device=device.alias)
    frames = {name: list(animation.frames()) for name, animation in made.items()}
    print(example.check(frames))
    assert len(frames) == len(list(SCENES.glob("*.toml"))) - len(SEARCHED) >= 20
    assert made["layers"].layers and len(frames["layers"][-1].points) == 3
    with pytest.raises(AssertionError):
        example.check({"grow": frames["vortex"]})
    with pytest.raises(AssertionError):
        example.check({"vortex": frames["vortex"][:1]})


def test_the_morphs_check_holds(device):
    """The scene's forces on its grid; frames in another order, or too few, or a search cut short fail."""
    example, scene = load("morph"), stage_all(read_scene(SCENES / "morph.toml"), device.alias)
    aims = scene.aims
    match = match_keyframes(scene.animation, aims.keyframes, start=aims.found, tolerance=aims.tolerance)
    made = Morph(match, scene.pair, MorphSettings(Timeline(0.5, 24)))
    frames = list(made.frames())
    print(example.check(made, frames))
    with pytest.raises(AssertionError):
        example.check(made, frames[::-1])
    with pytest.raises(AssertionError):
        example.check(made, frames[:-1])
    short = example.morphing(cells=32, seconds=0.25, device=device.alias, progress=lambda at: True)
    shown = list(short.frames())
    assert len(shown) == 7
    with pytest.raises(AssertionError):
        example.check(short, shown)


@pytest.mark.parametrize("name", SEARCHED)
def test_scenes_with_found_forces_need_no_search(device, name):
    staged = stage_all(read_scene(SCENES / f"{name}.toml"), device.alias)
    aims = staged.aims
    match = match_keyframes(
        staged.animation, aims.keyframes, pins=aims.pins, start=aims.found, tolerance=aims.tolerance
    )
    assert match.status == "reached" and match.evaluations == 0


def test_the_scenes_reference_is_what_the_command_prints():
    from wfluid.scene.reference import reference

    text = (ROOT / "examples" / "scenes" / "README.md").read_text()
    assert text.endswith(reference())


def test_any_picture_moves(device):
    example = load("any_picture")
    assert example.check(list(example.frames(example.CAT, cells=48, device=device.alias))) > 0.005


@pytest.mark.long
def test_examples_refuse_unknown_options(tmp_path):
    for path in (ROOT / "examples").glob("*.py"):
        result = subprocess.run(
            [sys.executable, str(path), "--nonsense"], cwd=tmp_path, capture_output=True, text=True
        )
        assert result.returncode == 2 and "Traceback" not in result.stderr
        assert list(tmp_path.iterdir()) == []


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["oscillator", "viscosity", "variable_viscosity", "any_picture", "scene_sheet"]
)
def test_an_example_writes_its_animation(tmp_path, name):
    cells = "64" if name == "scene_sheet" else "32"
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), "--frames", "3", "--cells", cells]
    result = subprocess.run(
        [*command, "--output", "out.####.png"], cwd=tmp_path, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    assert len(list(tmp_path.glob("out.100?.png"))) == 3


def test_the_readmes_python_runs(tmp_path):
    code = "\n".join(re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S))
    os.symlink(ROOT / "examples", tmp_path / "examples")
    result = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "nose.gif").exists()


def test_every_option_of_the_command_is_in_the_readme():
    from wfluid.cli.parser import build_parser
    from wfluid.scene.forces import TIMING_KEYS

    text = (ROOT / "README.md").read_text()
    (verbs,) = [a for a in build_parser()._actions if a.dest == "verb"]
    for verb, parser in verbs.choices.items():
        assert f"wfluid {verb}" in text
        for action in parser._actions:
            for flag in action.option_strings:
                assert flag in ("-h", "--help", "--output") or f"{flag}" in text, f"{verb} {flag}"
    assert all(f"`{key}`" in text for key in TIMING_KEYS if key != "envelope")
