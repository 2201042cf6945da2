"""Every key of a scene does what its documentation says; a key without a case is a failure."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest
from scene_cases import (
    CASES,
    FORCES,
    PUSH,
    SPOT,
    USUAL,
    less,
    scene_with,
    viscosity_at,
    work,
)
from scenes import KEYS, takes, write_pictures

from wfluid.cli.main import main
from wfluid.pictures.stills import read_picture
from wfluid.scene.reference import tables
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.scene.toml_file import write_scene
from wfluid.staging.build import stage

OUTPUT = "[[output]]"
FORCE_NAMES = {
    (heading, name) for heading, name in KEYS if name == "name" and heading.startswith("[[force]]")
}
KEYFRAMES = {key for key in KEYS if "keyframes" in key[0]}
MORPH = {key for key in KEYS if key[0] == "[morph]"}
OUTPUTS = {key for key in KEYS if key[0] == OUTPUT}
OF_A_RUN = {("at the top", "wfluid"), ("[frames]", "background"), ("[frames]", "allow_folds")}
ELSEWHERE = OF_A_RUN | FORCE_NAMES | OUTPUTS | KEYFRAMES | MORPH
"""Keys that do not change a staged animation: tests below, and of keyframes and morphs, are about them."""

SETTINGS = {(heading, name): table.keys[name] for heading, _, table in tables() for name in table.keys}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with small pictures."""
    folder = tmp_path_factory.mktemp("pictures")
    write_pictures(folder)
    return folder


def look_at(case, folder, heading, table):
    """What a case's look sees of the scene with that table."""
    return case.look(stage(Scene(scene_with(heading, table, case.more), folder)))


def alike(one, other, rtol=1e-5):
    """Whether two looks see the same, numbers to rounding."""
    try:
        return np.shape(one) == np.shape(other) and np.allclose(one, other, rtol=rtol, atol=1e-12)
    except TypeError:
        return one == other


def test_every_key_has_its_case():
    assert set(CASES) | ELSEWHERE == set(KEYS) and not set(CASES) & ELSEWHERE


@pytest.mark.parametrize(("heading", "key"), CASES)
def test_a_key_does_what_it_says(folder, heading, key):
    """With the key the animation shows what is worked out from its documentation, without it not."""
    case = CASES[heading, key]
    table = USUAL.get(heading, {}) if case.table is None else case.table
    seen = look_at(case, folder, heading, {**table, key: case.value})
    assert alike(seen, case.seen), (seen, case.seen)
    without = look_at(case, folder, heading, table if case.without is None else case.without)
    assert not alike(without, case.seen), without


def default_of(key):
    """The value that a key's documented default means; None where it is no value."""
    text = key.shown_default.partition(";")[0]
    values = [{"true": True, "false": False}.get(text, text)]
    if text.endswith("% of the longer side"):
        values = [float(text.split()[0]) / 100 * 60]
    elif text.endswith("for a picture of 512 px"):
        values = [float(text.split()[0]) / 512 * 60]
    elif text[:1].isdigit():
        values = [int(text) if text.isdigit() else float(text)]
    elif " " in text or "'" in text:
        values = []
    return next((value for value in values if takes(key, value)), None)


DEFAULTS = {place: default_of(SETTINGS[place]) for place in CASES if default_of(SETTINGS[place]) is not None}


@pytest.mark.parametrize(("heading", "key"), DEFAULTS)
def test_a_key_left_out_is_its_documented_default(folder, heading, key):
    """Colours to the 8 bits that they are written with."""
    case = CASES[heading, key]
    table = USUAL.get(heading, {}) if case.table is None else case.table
    scene = scene_with(heading, {**table, key: DEFAULTS[heading, key]}, case.more)
    said = case.look(stage(Scene(scene, folder)))
    name = heading.strip("[]")
    if name in scene and isinstance(scene[name], dict):
        scene[name] = {other: value for other, value in scene[name].items() if other != key}
    else:
        scene = scene_with(heading, less(table, key), case.more)
    assert alike(case.look(stage(Scene(scene, folder))), said, 0.03 if key == "color" else 1e-9)


def test_most_defaults_are_looked_at():
    assert len(DEFAULTS) > 60


@pytest.mark.parametrize("kind", [*(kind for kind in FORCES if kind != "grow"), "envelope"])
def test_the_phase_in_an_oscillating_loop_is_half_a_period(folder, kind):
    """As documented: there forces swing along the arrow first."""
    seen = []
    for phase in ({}, {"phase": 0.5}):
        wave = {"period": 0.7, **phase}
        heading, table = f'[[force]] kind = "{kind}"', {**FORCES.get(kind, ({},))[0], **wave}
        if kind == "envelope":
            heading, table = '[envelopes.NAME] kind = "oscillator"', {"kind": "oscillator", **wave}
        scene = scene_with(heading, table, {})
        scene["time"] = {**scene["time"], "loop": "oscillate"}
        seen.append(work(stage(Scene(scene, folder))))
    assert alike(*seen)


@pytest.mark.parametrize(
    ("heading", "table", "look", "seen"),
    [
        ("[viscosity]", {"image": "right.png"}, viscosity_at(0), (0, 0.1)),
        ("[fluid]", {"scheme": "paper"}, lambda a: a.fluid.solver, "jacobi"),
        ("[fluid]", {"scheme": "standard"}, lambda a: a.fluid.solver, "multigrid"),
        ("[[layer]]", {"name": "a", "file": "small.png"}, lambda a: a.layers["a"].data, False),
        ("[[layer]]", {"name": "a", "file": "left.png"}, lambda a: a.layers["a"].data, True),
        ("[time]", {"fps": 7}, lambda a: a.timeline.steps_per_frame, 14),
        ("[picture]", {}, lambda a: (a.width, a.height, a.picture.width), (None, None, 60)),
        ("[frames]", {"scale": 0.51}, lambda a: (a.width, a.height), (31, 21)),
    ],
)
def test_a_default_follows_what_else_is_said(folder, heading, table, look, seen):
    assert alike(look(stage(Scene(scene_with(heading, table, {}), folder))), seen)


def test_a_mask_of_a_force_is_instead_of_the_scenes(folder):
    masks = {"effect": {"mask": "left.png"}, "force": [PUSH, {**PUSH, "mask": "right.png"}]}
    animation = stage(Scene(scene_with("[frames]", {}, masks), folder))
    left, right = (force.weight.values[20, [10, 50]].tolist() for force in animation.forces)
    assert (left, right) == ([1, 0], [0, 1])


def test_a_named_envelope_comes_on_top_of_course_strength_and_group(folder):
    """All of them are multiplied: 2 in the second half of the first second, times -3, times 1 / 2."""
    more = {
        "envelopes": {"half": {"kind": "constant", "end": 1}, "two": {"kind": "samples", **TWICE}},
        "force": [{**PUSH, "group": "nose", "start": 0.5, "strength": -3, "envelope": ["half", "two"]}],
        "group": [{"name": "nose", "strength": 0.5, "envelope": "half"}],
    }
    animation = stage(Scene(scene_with("[frames]", {}, more), folder))
    given = np.array(work(animation))[:, 0] / (2 * 6 / 60 * 2 / 1.5**2)
    np.testing.assert_allclose(given, [0, 0, -0.75, -0.75, 0, 0, 0, 0], atol=1e-12)


TWICE = {"times": [0, 5], "values": [2, 2]}


@pytest.mark.parametrize(("heading", "key"), sorted(FORCE_NAMES))
def test_a_name_is_what_a_force_is_set_by(folder, heading, key):
    table = {"name": "left brow", "strength": 1.0, **USUAL[heading]}
    scene = Scene(scene_with(heading, table, {"force": [PUSH]}), folder)
    before = stage(scene)
    after = stage(scene.with_values(["force.left brow.strength=-2"]))
    np.testing.assert_allclose(work(after), -2 * np.array(work(before)), rtol=1e-9)
    with pytest.raises(SceneError, match="no item 'brow' of 1; did you mean left brow"):
        scene.with_values(["force.brow.strength=-2"])


@pytest.mark.parametrize("version", [2, 1000])
def test_a_version_is_that_of_the_format(folder, version):
    with pytest.raises(SceneError, match=f"wfluid: {version}: a scene of a newer version.*update wfluid"):
        Scene({**scene_with("[frames]", {}, {}), "wfluid": version})


# Outputs

SHOT = {
    "wfluid": 1,
    "picture": {"file": "small.png"},
    "fluid": {"cells": 16},
    "time": {"duration": 0.3, "fps": 10},
    "force": [{**PUSH, "by": [8, 0]}],
    "density": [{"name": "ink", "source": [{**SPOT, "radius": 9, "amount": 2}]}],
    "layer": [{"name": "matte", "file": "right.png"}],
    "tracks": {"points": [[30, 20], [3, 4]]},
    "output": [
        {"file": "a.gif"},
        {"file": "a.####.png"},
        {"file": "late.####.png", "start": 7},
        {"file": "deep.####.png", "type": "uint16"},
        {"file": "whole.####.exr", "type": "float", "compression": "none"},
        {"file": "zip.####.exr", "type": "float", "compression": "zip"},
        {"file": "poor.####.jpg", "quality": 10},
        {"file": "good.####.jpg", "quality": 100},
        {"file": "matte.####.png", "of": "matte"},
        {"file": "ink.####.exr", "of": "ink"},
        {"file": "where.csv", "of": "tracks"},
        {"file": "said.json", "of": "report"},
    ],
}


@pytest.fixture(scope="module")
def shot(folder):
    """The folder where a scene with every kind of output was run."""
    write_scene(folder / "shot.toml", Scene(SHOT, folder))
    assert main(["render", str(folder / "shot.toml"), "--quiet"]) == 0
    return folder


def sequence(shot, name):
    return [read_picture(path).pixels for path in sorted(shot.glob(f"{name}.[0-9]*"))]


def spec_of(path):
    return oiio.ImageInput.open(str(path)).spec()


def test_every_output_is_written_once_and_whole(shot):
    """One file each, or one a frame; nothing else."""
    written = {path.name for path in shot.iterdir()} - {"shot.toml"}
    wanted = {"a.gif", "where.csv", "said.json", "small.png", "other.png", "right.png", "left.png"}
    for output in SHOT["output"]:
        if "####" in output["file"]:
            start = output.get("start", 1001)
            wanted |= {output["file"].replace("####", f"{start + n:04}") for n in range(4)}
    assert written == wanted


def test_output_of_says_what_is_shown(shot):
    """The picture by default; a layer warped, a density's numbers, where points are, how it went."""
    picture, matte, ink = (sequence(shot, name) for name in ("a", "matte", "ink"))
    assert np.abs(picture[3] - picture[0]).max() > 0.1
    np.testing.assert_array_equal(matte[0], read_picture(shot / "right.png").pixels)
    assert 1 < np.abs(matte[3] - matte[0]).sum() and matte[0].shape == (40, 60, 1)
    assert [frame.shape for frame in ink] == [(40, 60, 1)] * 4 and ink[0].max() == 0
    assert ink[3].mean() == pytest.approx(3 * ink[1].mean(), rel=0.05)
    assert ink[3].max() == pytest.approx(2, rel=0.1)
    rows = [line.split(",") for line in (shot / "where.csv").read_text().splitlines()]
    assert rows[:3] == [
        ["frame", "time", "point", "x", "y"],
        ["0", "0", "0", "30.0000", "20.0000"],
        ["0", "0", "1", "3.0000", "4.0000"],
    ]
    assert len(rows) == 9 and rows[7][:3] == ["3", "0.3", "0"] and 32 < float(rows[7][3]) < 40
    report = json.loads((shot / "said.json").read_text())
    assert (report["frames"], report["picture"], report["grid"]) == (4, [60, 40], [16, 11])
    assert report["settings"]["densities"] == ["ink"] and report["settings"]["layers"] == ["matte"]


def test_output_start_is_the_first_number(shot):
    for n in range(4):
        late, usual = shot / f"late.{7 + n:04}.png", shot / f"a.100{1 + n}.png"
        assert late.read_bytes() == usual.read_bytes()


def test_output_type_is_that_of_the_files_numbers(shot):
    kinds = [
        str(spec_of(shot / f"{name}").format) for name in ("a.1001.png", "deep.1001.png", "zip.1001.exr")
    ]
    assert kinds == ["uint8", "uint16", "float"]


def test_output_compression_is_that_of_the_files(shot):
    assert spec_of(shot / "whole.1002.exr")["compression"] == "none"
    assert spec_of(shot / "zip.1002.exr")["compression"] == "zip"
    np.testing.assert_array_equal(sequence(shot, "whole"), sequence(shot, "zip"))


def test_output_quality_is_paid_in_bytes(shot):
    poor, good = (sum(path.stat().st_size for path in shot.glob(f"{name}.*")) for name in ("poor", "good"))
    assert good > 2 * poor
    error = [np.abs(sequence(shot, name)[1] - sequence(shot, "a")[1]).mean() for name in ("poor", "good")]
    assert error[0] > 1.2 * error[1]


def test_output_file_decides_the_kind(shot):
    """A GIF of all frames."""
    gif = oiio.ImageInput.open(str(shot / "a.gif"))
    assert gif.seek_subimage(3, 0) and not gif.seek_subimage(4, 0)


def test_outputs_have_a_test_for_each_key():
    tested = {name.split("_")[2] for name in globals() if name.startswith("test_output_")}
    assert tested == {name for heading, name in KEYS if heading == OUTPUT}
