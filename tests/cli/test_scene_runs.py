"""Scenes as they are run: what is set in them, where their outputs go, and at what size."""

import json
import os

import numpy as np
import pytest
from scenes import render, write_pictures, write_shot

from wfluid.cli.main import main
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.scene.toml_file import read_scene
from wfluid.staging.build import stage


@pytest.fixture
def shots(tmp_path, monkeypatch):
    """A folder with pictures and the scene; the current folder is the one above."""
    monkeypatch.chdir(tmp_path)
    return write_shot(tmp_path / "shots")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pictures, made the current one."""
    write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


# What is set


GROUP = ("force", 0, "group")


@pytest.mark.parametrize(
    ("settings", "changes"),
    [
        (["time.duration=3"], {("time", "duration"): 3}),
        (["time.duration=3", "time.duration=4.5"], {("time", "duration"): 4.5}),
        ([" time.duration = 3 "], {("time", "duration"): 3}),
        (["seed=7"], {("seed",): 7}),
        (["force.1.turn=-90"], {("force", 1, "turn"): -90}),
        (["force.eye.turn=-90"], {("force", 1, "turn"): -90}),
        (["force.eye.center=[1, 2.5]"], {("force", 1, "center"): [1, 2.5]}),
        (["force.0.by.1=9"], {("force", 0, "by", 1): 9}),
        (["density.ink.source.0.amount=2"], {("density", 0, "source", 0, "amount"): 2}),
        (["density.0.color=#aabbcc"], {("density", 0, "color"): "#aabbcc"}),
        (["output.1.of=ink"], {("output", 1, "of"): "ink"}),
        (["viscosity.image=self"], {("viscosity", "image"): "self"}),
        (["frames.filter=nearest", "frames.width=9"], {("frames",): {"filter": "nearest", "width": 9}}),
        (["fluid.walls=periodic,no-slip"], {("fluid", "walls"): "periodic,no-slip"}),
        (["picture.file=a=b.png"], {("picture", "file"): "a=b.png"}),
        (['picture.file="3"'], {("picture", "file"): "3"}),
        (["envelopes.beat={kind = 'constant'}"], {("envelopes", "beat"): {"kind": "constant"}}),
        (["layer=[]", "output=[]"], {("layer",): [], ("output",): []}),
        (["force.0.envelope=[]", "force.0.envelope=swell"], {("force", 0, "envelope"): ["swell"]}),
        (["group.nose.name=brow", "force.0.group=brow"], {("group", 0, "name"): "brow", GROUP: "brow"}),
        (["force.eye.name=ear", "force.ear.turn=1"], {("force", 1, "name"): "ear", ("force", 1, "turn"): 1}),
    ],
)
def test_a_value_is_set_by_its_path_and_nothing_else_changes(shots, settings, changes):
    """Items by number or by name; the value is TOML, or else a text; tables are made where they miss."""
    before = read_scene("shots/shot.toml")
    after = before.with_values(settings)
    kept = {
        at: value
        for at, value in leaves(before.tables).items()
        if not any(at[: len(path)] == path for path in changes)
    }
    for path, value in changes.items():
        kept |= leaves(value, path)
    assert leaves(after.tables) == kept
    assert before.tables == read_scene("shots/shot.toml").tables
    assert (after.folder, after.source) == (before.folder, before.source)


def leaves(value, path=()):
    """The values by path, as texts."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = {} if items else {path: repr(value)}
    for name, item in items:
        found |= leaves(item, (*path, name))
    return found


def test_what_is_set_is_what_is_rendered(shots, capsys):
    options = ("--set", "time.duration=0.5", "--set", "time.fps=20", "--set", "frames.width=30", "--dry-run")
    assert render("shots/shot.toml", *options) == 0
    assert "frames    11 of 30 x 20 pixels at 20 per second" in capsys.readouterr().out


# Outputs


def made(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix != ".toml" and not path.is_dir())


def numbered(name):
    return [f"{name}.{n}.png" for n in (1001, 1002, 1003)]


def test_outputs_lie_beside_the_scene(shots):
    before = made(shots)
    assert render("shots/shot.toml", "--quiet") == 0
    assert sorted({*made(shots)} - {*before}) == [*numbered("m"), *numbered("o")]
    assert made(shots.parent) == []


def test_other_outputs_of_the_picture_leave_those_of_layers(shots):
    """They and the report are named from the current folder, and are the same frames."""
    assert render("shots/shot.toml", "--quiet") == 0
    usual = {name: (shots / name).read_bytes() for name in (*numbered("m"), *numbered("o"))}
    for name in usual:
        (shots / name).unlink()
    before = made(shots)
    assert render("shots/shot.toml", "-o", "b.####.png", "-o", "c.gif", "--report", "r.json", "--quiet") == 0
    assert made(shots.parent) == [*numbered("b"), "c.gif", "r.json"]
    assert sorted({*made(shots)} - {*before}) == numbered("m")
    for n in range(3):
        assert (shots.parent / numbered("b")[n]).read_bytes() == usual[numbered("o")[n]]
        assert (shots / numbered("m")[n]).read_bytes() == usual[numbered("m")[n]]
    assert json.loads((shots.parent / "r.json").read_text())["frames"] == 3


def test_a_preview_draws_the_forces_and_runs_nothing(shots):
    before = made(shots)
    assert render("shots/shot.toml", "--preview", "p.png") == 0
    assert made(shots.parent) == ["p.png"] and made(shots) == before
    change = np.abs(read_picture("p.png").pixels - 0.8 * read_picture(shots / "small.png").pixels)
    assert change[20, 30:34].max() > 0.2 > 0.02 > change[35:, 40:].max()


# The same as a command line

QUICK = ("--cells", "16", "--duration", "0.2", "--fps", "10", "--quiet")
EVERYTHING = (
    *(
        "--push",
        "30,20:5,1:radius=8,period=0.3,mask=right.png",
        "--vortex",
        "15,10:40",
        "--grow",
        "40,30:1.2",
    ),
    *("--stroke", "5,30/30,35:strength=0.4", "--noise", "2:scale=20,change=0.1", "--seed", "5"),
    *("--force-image", "self:along=contour,amount=2", "--wind", "1,2:mask=left.png"),
    *("--ink", "20,20:#a01020:amount=2,lift=10", "--smoke", "40,20:#ffffff:at=0.05", "--layer", "right.png"),
    *(
        "--viscosity-image",
        "other.png",
        "--viscosity",
        "0.01",
        "--viscosity-moves",
        "--freeze",
        "left.png:20",
    ),
    *(
        "--effect-mask",
        "other.png",
        "--track",
        "30,20",
        "--walls",
        "periodic,no-slip",
        "--pressure-cycles",
        "4",
    ),
    *(
        "--width",
        "45",
        "--filter",
        "lanczos",
        "--edge",
        "mirror",
        "--colorspace",
        "linear",
        "--substeps",
        "3",
    ),
)
"""A command line with every kind of control."""


def frames(folder, name):
    return [(folder / f"{name}.{n}.png").read_bytes() for n in (1001, 1002, 1003)]


def test_a_saved_scene_renders_the_same_bytes(folder):
    """Of the picture under another name, and of all that the command line wrote."""
    command = ("animate", "small.png", *EVERYTHING, *QUICK, "-o", "a.####.png", "--tracks", "a.csv")
    assert main([*command, "--report", "a.json", "--save-scene", "x.toml"]) == 0
    before, report = {path: path.read_bytes() for path in folder.iterdir()}, json.loads(read("a.json"))
    assert main(["render", "x.toml", "-o", "b.####.png", "--quiet"]) == 0
    assert frames(folder, "b") == frames(folder, "a") and len({*frames(folder, "a")}) == 3
    written = [path for path in before if path.suffix not in (".toml", ".json") and path.name.startswith("a")]
    assert len(written) == 7
    for path in written:
        path.unlink()
    assert main(["render", "x.toml", "--quiet"]) == 0
    assert {path: path.read_bytes() for path in written} == {path: before[path] for path in written}
    again = json.loads(read("a.json"))
    assert {**report, "seconds": None} == {**again, "seconds": None}


def read(name):
    with open(name) as file:
        return file.read()


@pytest.mark.parametrize("where", ["shots/x.toml", "deep/er/x.toml", "../away/x.toml"])
def test_a_scene_saved_in_another_folder_finds_its_pictures_from_anywhere(folder, monkeypatch, where):
    """Names of files become relative to the scene; absolute ones stay."""
    home = folder / "home"
    for path in (home, (home / where).parent, folder / "elsewhere"):
        path.mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(home)
    picture, mask = os.path.join("..", "small.png"), str(folder / "right.png")
    controls = (
        "--push",
        "30,20:5,0",
        "--effect-mask",
        mask,
        "--layer",
        "../right.png",
        "--force-image",
        "self",
    )
    assert main(["animate", picture, *controls, *QUICK, "-o", "a.####.png", "--save-scene", where]) == 0
    tables = read_scene(home / where).tables
    assert (home / where).parent.joinpath(tables["picture"]["file"]).samefile(folder / "small.png")
    assert not os.path.isabs(tables["picture"]["file"]) and tables["effect"]["mask"] == mask
    assert [force.get("file") for force in tables["force"]] == [None, "self"]
    layers = frames(home, "a_right")
    for path in home.glob("a_right.*"):
        path.unlink()
    monkeypatch.chdir(folder / "elsewhere")
    assert main(["render", str(home / where), "-o", "b.####.png", "--quiet"]) == 0
    assert frames(folder / "elsewhere", "b") == frames(home, "a")
    assert frames(home, "a_right") == layers


def test_saving_a_scene_alone_runs_nothing(folder, capsys, monkeypatch):
    """It says what its pixels refer to, so that a picture of another size may take its place."""
    monkeypatch.setattr("wfluid.cli.render.write_frames", lambda *_: pytest.fail("frames are made"))
    assert main(["animate", "small.png", "--push", "30,20:5,0", "--save-scene", "x.toml"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("wrote x.toml in ") and said.out.count("\n") == 1 and said.err == ""
    assert read_scene("x.toml").tables == {
        "wfluid": 1,
        "picture": {"size": [60, 40], "file": "small.png"},
        "force": [{"kind": "push", "center": [30.0, 20.0], "by": [5.0, 0.0]}],
    }
    assert {path.name for path in folder.iterdir() if path.suffix != ".png"} == {"x.toml"}


# Sizes

MOTION = {
    "wfluid": 1,
    "fluid": {"cells": 32},
    "time": {"duration": 0.4, "fps": 10},
    "frames": {"width": 16},
    "force": [
        {"kind": "push", "center": [200, 240], "by": [60, 20], "radius": 50},
        {"kind": "vortex", "center": [480, 160], "turn": 50, "period": 0.6},
        {"kind": "grow", "path": [[0, 300, 300], [0.4, 400, 380]], "factor": 1.2, "radius": 60},
        {"kind": "stroke", "points": [[100, 400], [300, 440], [360, 400]], "strength": 0.5},
        {"kind": "noise", "amount": 12, "scale": 160, "seed": 3},
        {"kind": "noise", "amount": 8, "change": 0.2},
        {"kind": "buoyancy", "density": "ink", "by": [0, -80]},
    ],
    "density": [{"name": "ink", "source": [{"center": [320, 300], "radius": 40}]}],
    "tracks": {"points": [[320, 240], [0, 480]]},
}
"""Drawn on 640 x 480 pixels."""


def last_frame(folder, width, height, **picture):
    """Of that motion over a picture of that size, which is as drawn there unless it says a size."""
    x, y = np.linspace(0, 1, width), np.linspace(0, 1, height)[:, None]
    pixels = np.stack(np.broadcast_arrays(x, y, x * y), axis=2).astype(np.float32)
    write_picture(folder / "picture.png", Picture(pixels, dtype="uint8"))
    tables = {**MOTION, "picture": {"file": "picture.png", **picture}}
    notes = []
    *_, last = stage(Scene(tables, folder), note=notes.append).frames()
    assert notes == [] and last.quality.displacement_max > 0.02
    return last


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    return last_frame(tmp_path_factory.mktemp("drawn"), 640, 480)


@pytest.mark.parametrize("size", [(640, 480), (320, 240), (160, 120), (200, 150), (4, 3)])
def test_a_scene_gives_the_same_motion_at_any_size_of_the_picture(tmp_path, drawn, size):
    """Its map, its densities and its points, to the bit: nothing of them depends on pixels."""
    last = last_frame(tmp_path, *size, size=[640, 480])
    np.testing.assert_array_equal(last.map.displacement, drawn.map.displacement)
    np.testing.assert_array_equal(last.densities["ink"], drawn.densities["ink"])
    np.testing.assert_array_equal(last.points, drawn.points)


@pytest.mark.parametrize("size", [(161, 121), (333, 250)])
def test_a_picture_whose_sides_are_rounded_moves_nearly_the_same(tmp_path, drawn, size):
    last = last_frame(tmp_path, *size, size=[640, 480])
    error = np.abs(last.map.displacement - drawn.map.displacement).max()
    assert error < 0.03 * drawn.quality.displacement_max, error


def test_without_a_size_the_scenes_pixels_are_the_pictures(tmp_path, drawn):
    """On a larger picture the same numbers are a smaller drawing."""
    last = last_frame(tmp_path, 800, 600)
    assert np.abs(last.map.displacement - drawn.map.displacement).max() > 0.02
    with pytest.raises(SceneError, match="outside the picture of 320 x 240 pixels"):
        last_frame(tmp_path, 320, 240)
