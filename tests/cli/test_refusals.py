"""What is refused on a command line names the flag that the user gave, with the remedy."""

import numpy as np
import pytest
from command import wfluid

from wfluid.animation.animation import Animation
from wfluid.domain.timeline import Timeline
from wfluid.model.fluid import Fluid
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture
from wfluid.scene.short_forms import parse_force

PUSH = ("--push", "10,10:3,0:radius=8")
MOVE = ("--move", "10,10:12,10")
PAIR = ("morph", "a.png", "a.png", *MOVE)

SCENE = """wfluid = 1
[picture]
file = "a.png"
[frames]
filter = "cubic"
[[force]]
kind = "push"
center = [10.0, 20.0]
by = [3.0, 0.0]
radius = 8.0
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder with a picture, a white mask and a scene, which is the current one."""
    monkeypatch.chdir(tmp_path)
    values = np.random.default_rng(1).random((48, 40, 3)).astype(np.float32)
    write_picture("a.png", Picture(values, None, "uint8", None))
    write_picture("white.png", Picture(np.ones((48, 40, 1), np.float32), None, "uint8", None))
    (tmp_path / "a.toml").write_text(SCENE)
    return tmp_path


REFUSED = {
    # --set
    (
        "render",
        "a.toml",
        "--set",
        "frames.width=-3",
    ): "--set frames.width=-3: frames.width: -3: expected a wh",
    ("render", "a.toml", "--set", "force.0.radius=-1"): "--set force.0.radius=-1: force.0.radius: -1: expec",
    (
        "render",
        "a.toml",
        "--set",
        "force.0.raduis=1",
    ): "--set force.0.raduis=1: force.0.raduis: no such key; did y",
    (
        "render",
        "a.toml",
        "--set",
        "framse.width=10",
    ): "--set framse.width=10: framse: no such key; did you mean fr",
    ("render", "a.toml", "--set", "force.0.by=[1]"): "--set force.0.by=[1]: force.0.by: [1]: expected two",
    (
        "render",
        "a.toml",
        "--set",
        "frames.scale=1e308",
    ): "--set frames.scale=1e308: frames.scale: 1e+308: expected a number above 0 to 32768",
    (
        *("render", "a.toml", "--set", "frames.width=20", "--set", "frames.scale=1"),
        *("--set", "fluid.cells=16"),
    ): "a.toml:4 with --set frames.width=20 and --set frames.scale=1: frames: width and scale both set",
    # a table's flags
    ("animate", "a.png", *PUSH, "--scale", "1e308"): "--scale 1e+308: expected a number above 0 to 32768",
    ("animate", "a.png", *PUSH, "--scale", "2", "--width", "9"): "--width and --scale: width and scale both",
    ("animate", "a.png", *PUSH, "--scale", "30000"): "--scale: width 1200000: expected 1 … 32768 pixels",
    (
        "animate",
        "a.png",
        *PUSH,
        "--freeze",
        "white.png",
    ): "--freeze: white.png: the freeze mask is painted all",
    ("animate", "a.png", *PUSH, "--freeze", "none.png"): "--freeze: none.png: no such picture",
    (
        "animate",
        "a.png",
        *PUSH,
        "--walls",
        "foo",
    ): "--walls 'foo': expected free-slip, no-slip, periodic, or two",
    ("animate", "a.png", *PUSH, "--walls", "perodic"): "or two of them as x,y; did you mean periodic?",
    ("animate", "a.png", *PUSH, "--walls", "periodic,x"): "--walls 'periodic,x': expected free-slip",
    ("animate", "a.png", *PUSH, "--duration", "1e-9"): "--duration: 1e-09 s at 15 fps is",
    ("keyframes", "a.png", *MOVE, "--pin", "10,10"): "--move: the point 10,10 is pinned and moved",
    ("keyframes", "a.png", *MOVE, "--loop", "pingpong"): "--loop: a loop (pingpong) ends as it begins",
    (
        "keyframes",
        "a.png",
        "--move",
        "9,9:8,8@3",
        "--duration",
        "1",
    ): "--move 9,9:8,8@3: a keyframe at 3 s: expec",
    (*PAIR, "--timing", "none.png"): "--timing: none.png: no such picture",
    (*PAIR, "--warp-curve", "0:0,0:1"): "--warp-curve: two keys have one time",
    # short forms
    (
        "animate",
        "a.png",
        "--push",
        "1,1:1,1:raduis=10",
    ): "'raduis=10' is not key=value with a key of radius, ",
    ("animate", "a.png", "--push", "1,1:1,1:radis=10"): "strength, mask; did you mean radius?",
    ("animate", "a.png", "--ink", "1,1:#ffffff:amont=1"): "; did you mean amount?",
    # numbers and flags
    (
        "animate",
        "a.png",
        *PUSH,
        "--width",
        "abc",
    ): "wfluid animate: --width 'abc': expected a whole number (see",
    ("animate", "a.png", *PUSH, "--fps", "x"): "wfluid animate: --fps 'x': expected a number (see",
    ("animate", "a.png", *PUSH, "--width"): "wfluid animate: --width: its value is missing (see",
    (
        "check-gradient",
        "a.toml",
        "--seed",
        "1.5",
    ): "wfluid check-gradient: --seed '1.5': expected a whole number",
    ("render", "a.toml", "--width", "10"): "there is no flag --width; give --set frames.width=VALUE (see",
    ("render", "a.toml", "--seed=10"): "there is no flag --seed; give --set seed=VALUE (see",
    ("render", "a.toml", "--quite"): "there is no flag --quite; did you mean --quiet?",
}


@pytest.mark.parametrize("words", REFUSED, ids=lambda words: " ".join(words[-2:]))
def test_a_refusal_names_the_flag(words):
    output = () if words[-1] in ("--width", "--quite") or words[0] == "check-gradient" else ("-o", "a.gif")
    ended = wfluid(*words, *output)
    assert ended.returncode == 2 and ended.stderr.count("\n") == 1
    assert REFUSED[words] in ended.stderr


def test_keyframes_without_a_time_arrive_in_the_last_frame():
    """At 15 frames a second, 0.3 s end after the frame at 4/15 s."""
    ended = wfluid("keyframes", "a.png", *MOVE, "--duration", "0.3", "-o", "a.gif", "--dry-run")
    assert ended.returncode == 0
    assert "a keyframe at 0.3 s is moved to 0.266667 s" in ended.stderr


def test_a_dry_run_writes_the_files_that_describe_the_run(folder):
    words = ("animate", "a.png", *PUSH, "--save-scene", "s.toml", "--preview", "v.png", "-o", "a.gif")
    ended = wfluid(*words, "--dry-run")
    assert ended.returncode == 0 and "writes    a.gif" in ended.stdout
    assert {path.name for path in folder.iterdir()} >= {"s.toml", "v.png"} and not (folder / "a.gif").exists()


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("wfluid = 1\nwfluid = 1\n[picture]\n", "2:11"),
        ("[picture]\nfile = 'a'\n[picture]\nsize = [1, 2]\n", "3:9"),
        ("[picture]\nfile = 'a'\nfile = 'b'\n\n[time]\n", "3:11"),
    ],
)
def test_a_key_given_twice_is_reported_in_its_line(folder, text, place):
    (folder / "b.toml").write_text(text)
    assert f"wfluid render: b.toml:{place}: no TOML: Key" in wfluid("render", "b.toml").stderr


def test_an_unknown_kind_of_force_is_refused():
    with pytest.raises(ValueError, match=r"kind 'psh': expected one of push, .*; did you mean push\?"):
        parse_force("psh", "1,1:1,1")
    with pytest.raises(ValueError, match="kind 'ink': expected one of push"):
        parse_force("ink", "1,1:#ffffff")


@pytest.mark.parametrize("walls", [None, 3])
def test_walls_of_another_type_are_refused(walls):
    with pytest.raises(TypeError, match=f"walls {walls}: expected Walls, or a text such as 'free-slip'"):
        Fluid(walls=walls)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("cells", 16.5, "cells 16.5: expected a whole number, 4 … 8192"),
        ("cells", "16", "cells '16': expected a whole number, 4 … 8192"),
        ("cells", 3, "cells 3: expected 4 … 8192"),
        ("width", 2.5, "width 2.5: expected a whole number, 1 … 32768 pixels"),
        ("height", 0, "height 0: expected 1 … 32768 pixels"),
    ],
)
def test_sizes_of_an_animation_are_whole_numbers(name, value, says):
    picture = Picture(np.zeros((8, 8, 3), np.float32), None, "uint8", None)
    with pytest.raises(ValueError, match=says):
        Animation(picture, Fluid(), [], Timeline(1.0), **{name: value})
