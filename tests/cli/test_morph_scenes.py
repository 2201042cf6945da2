"""Morphs in scenes and on the command line: what each key says, what is written, said and refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from morph_cases import centroid, dots, psnr
from scenes import KEYS, write_pictures

import wfluid.cli.render
from wfluid.cli.main import main
from wfluid.domain.limits import MORPH_TOLERANCE, MORPH_VISCOSITY
from wfluid.keyframes.match import match_keyframes
from wfluid.morphing.morph import FLOW
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.scene.toml_file import read_scene
from wfluid.staging.build import stage_all

MOVES = {"move": [{"from": [20, 20], "to": [26, 16]}]}
TALL = {"to": "tall.png"}
"""The other picture is 40 x 60 pixels where the first is 60 x 40."""

QUICK = ("--cells", "16", "--duration", "0.25", "--fps", "12", "--quiet")
POINTS = ((20, 16, 24, 13), (42, 24, 38, 27))
"""x, y of A and of B [px]."""


def add_pictures(folder):
    write_pictures(folder)
    tall = np.random.default_rng(1).random((60, 40, 3)).astype(np.float32)
    write_picture(folder / "tall.png", Picture(tall, dtype="uint8"))
    for name, columns in (("from.png", (0, 1)), ("to.png", (2, 3))):
        places = [tuple(row[column] / 60 for column in columns) for row in POINTS]
        write_picture(folder / name, Picture(dots(places, 3.0, 60, 40).pixels, dtype="uint16"))
    (folder / "points.csv").write_text(
        "x,y,to x,to y\n" + "".join(f"{a},{b},{c},{d}\n" for a, b, c, d in POINTS)
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with pictures of 60 x 40 pixels, and one of 40 x 60."""
    add_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def staged(folder, morph, keyframes=MOVES, note=lambda text: None, **more):
    scene = {"wfluid": 1, "picture": {"file": "small.png"}, "time": {"duration": 2, "fps": 5}, **more}
    return stage_all(
        Scene({**scene, "morph": {"to": "other.png", **morph}, "keyframes": keyframes}, folder), None, note
    )


def place_of(morph):
    return morph.aims.keyframes[0].destination


def curve(name):
    return lambda morph: getattr(morph.settings, name).at(np.array([0.25, 0.5]))


KEYED = [[0.5, 0.2], [1.0, 0.9]]

CASES = {
    "to": ({"to": "to.png"}, lambda m: m.pair.b.pixels.mean() < 0.1, True),
    "size": ({"size": [120, 80]}, place_of, (13 / 60, 8 / 60)),
    "fit": (
        {**TALL, "fit": "stretch"},
        lambda m: (*place_of(m), m.pair.window.x, m.pair.window.height),
        (26 / 40, 16 / 60 * 40 / 60, 0, 60),
    ),
    "warp_curve": ({"warp_curve": KEYED}, curve("warp_curve"), (0.2, 0.9)),
    "blend_curve": ({"blend_curve": "linear"}, curve("blend_curve"), (0.25, 0.5)),
    "blend": ({"blend": "display"}, lambda m: m.settings.blend == "display", True),
    "timing": ({"timing": "left.png"}, lambda m: m.settings.mask.values[20, [10, 50]], (1, 0)),
    "delay": ({"timing": "left.png", "delay": 0.25}, lambda m: m.settings.delay, 0.25),
    "reverse": ({"reverse": True}, lambda m: m.settings.order[:2], (10, 9)),
    "pingpong": ({"pingpong": True}, lambda m: len(m.settings.order), 20),
}
"""By key: the values, what is looked at, what is seen."""


def test_every_key_has_its_case():
    assert set(CASES) == {name for heading, name in KEYS if heading == "[morph]"}


@pytest.mark.parametrize("key", CASES)
def test_a_key_does_what_it_says(folder, key):
    """With it the scene is what is worked out from its documentation, without it not."""
    values, look, seen = CASES[key]
    np.testing.assert_allclose(look(staged(folder, values)), seen, rtol=1e-6)
    without = {name: value for name, value in values.items() if name != key}
    if key == "timing":
        assert staged(folder, without).settings.mask is None
    else:
        assert not np.array_equal(look(staged(folder, without)), seen)


def test_what_is_left_out_is_the_documented_default(folder):
    found = staged(folder, {"timing": "left.png"})
    course, parts = found.settings, np.linspace(0, 1, 9)
    for its in (course.warp_curve, course.blend_curve):
        np.testing.assert_allclose(its.at(parts), 3 * parts**2 - 2 * parts**3)
    assert (course.blend, course.delay, course.reverse, course.pingpong) == ("linear", 0.5, False, False)
    assert found.aims.tolerance == MORPH_TOLERANCE and found.animation.fluid.viscosity == MORPH_VISCOSITY
    assert found.animation.timeline == FLOW and found.aims.keyframes[0].time == FLOW.end
    assert (course.timeline.duration, course.timeline.fps) == (2, 5)
    assert staged(folder, {}, viscosity={"value": 0.01}).animation.fluid.viscosity == 0.01


def test_pixels_of_each_point_are_those_of_its_own_picture(folder):
    """A's by A's frame size; B's by B's, where its picture is seen: filled, the middle 27 rows of 60."""
    keyframes = {"move": [{"from": [120, 40], "to": [10, 30]}]}
    found = staged(folder, TALL, keyframes, picture={"file": "small.png", "size": [240, 160]})
    window, keyframe = found.pair.window, found.aims.keyframes[0]
    assert (window.x, window.y, window.width, window.height) == (0, 16, 40, 27)
    np.testing.assert_allclose(keyframe.point, (0.5, 40 / 240))
    np.testing.assert_allclose(keyframe.destination, (10 / 40, (30 - 16) / 27 * 40 / 60))


def test_what_was_done_to_the_pictures_is_said(folder):
    said = []
    staged(folder, {"to": "left.png"}, note=said.append)
    assert said == ["the second picture is grey, the other has colours: it is shown as colours"]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"keyframes": {}}, "keyframes: a morph needs points of both pictures"),
        ({"keyframes": {"pins": [[1, 1]]}}, "keyframes: a morph needs points of both pictures"),
        ({"force": [{"kind": "wind", "by": [1, 0]}]}, "force: not allowed in a morph"),
        ({"layer": [{"name": "a", "file": "left.png"}]}, "layer: not allowed in a morph"),
        ({"density": [{"name": "ink"}]}, "density: not allowed in a morph"),
        ({"tracks": {"points": [[1, 1]]}}, "tracks: not allowed in a morph"),
        ({"effect": {"mask": "left.png"}}, "effect: not allowed in a morph"),
        ({"time": {"substeps": 3}}, "time.substeps: not allowed in a morph"),
        ({"time": {"loop": "pingpong"}}, "time.loop: not allowed in a morph: set pingpong"),
        ({"keyframes": {**MOVES, "time": 1}}, "keyframes.time: not allowed in a morph"),
        (
            {"keyframes": {"move": [{**MOVES["move"][0], "time": 1}]}},
            "keyframes.move.0.time: not allowed in a morph",
        ),
        ({"morph": {"fit": "stretch"}}, "to is missing: file of the second picture"),
        (
            {"morph": {"to": "other.png", "size": [40, 60]}},
            "morph.size: 40 x 60 has another aspect than the picture",
        ),
        ({"morph": {"to": "other.png", "size": [0, 60]}}, "expected positive numbers"),
        ({"morph": {"to": "other.png", "delay": 0.5}}, "morph: delay needs a timing mask"),
        ({"morph": {"to": "other.png", "warp_curve": [[3, 0.5]]}}, "times within the morph"),
        (
            {"morph": {"to": "other.png", "warp_curve": [[1, 0.5], [1, 0.6]]}},
            "morph.warp_curve: two keys have one time",
        ),
        ({"morph": {"to": "other.png", "waltz": 1}}, "morph.waltz: no such key"),
    ],
)
def test_a_scene_that_makes_no_sense_is_refused_by_its_key(folder, tables, says):
    scene = {"wfluid": 1, "picture": {"file": "small.png"}, "morph": {"to": "other.png"}, "keyframes": MOVES}
    with pytest.raises(SceneError) as error:
        stage_all(Scene({name: table for name, table in {**scene, **tables}.items() if table}, folder))
    assert says in str(error.value), error.value


# The command line, end to end


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """A folder where a morph was made, and what the command line left with."""
    folder = tmp_path_factory.mktemp("shot")
    add_pictures(folder)
    files = {"-o": "f.####.png", "--report": "r.json", "--save-scene": "s.toml", "--plot": "a.png"}
    written = [word for flag, name in files.items() for word in (flag, str(folder / name))]
    size = (
        "--cells",
        "32",
        "--duration",
        "0.5",
        "--fps",
        "12",
        "--quiet",
        "--blend-curve",
        "0.2:0.3,0.4:0.9",
    )
    pictures = [str(folder / name) for name in ("from.png", "to.png")]
    code = main(["morph", *pictures, "--points", str(folder / "points.csv"), *size, *written])
    return folder, code


def frames_of(folder, name="f"):
    return [read_picture(path).pixels for path in sorted(folder.glob(f"{name}.*.png"))]


def test_the_files_of_both_ends_are_the_pictures(shot):
    folder, code = shot
    frames = frames_of(folder)
    assert code == 0 and len(frames) == 7
    for frame, name in ((frames[0], "from.png"), (frames[-1], "to.png")):
        assert psnr(frame, read_picture(folder / name).pixels) > 60
    assert read_picture(folder / "a.png").width > 1000


def test_a_dot_moves_from_its_point_to_the_others(shot):
    """In every frame there is one dot for each pair of points, between the two, on its way."""
    folder, _ = shot
    for x, y, to_x, to_y in POINTS:
        ways = []
        for frame in frames_of(folder):
            there = centroid(Picture(frame), ((x + to_x) / 120, (y + to_y) / 120), reach=10)
            ways.append(np.dot(there - (x, y), (to_x - x, to_y - y)) / 25)
        assert abs(ways[0]) < 0.05 and abs(ways[-1] - 1) < 0.05 and np.all(np.diff(ways) > 0), ways


def test_the_report_says_how_well_both_pictures_meet(shot):
    folder, _ = shot
    report = json.loads((folder / "r.json").read_text())
    said = report["morph"]
    assert report["status"] == "reached" and report["frames"] == 7 and report["fps"] == 12
    assert report["steps"] == FLOW.steps and report["settings"]["viscosity"] == MORPH_VISCOSITY
    assert said["to"] == [60, 40] and said["window"] == [0, 0, 60, 40]
    assert report["tolerance_px"] == pytest.approx(0.5 * 60 / 512)
    for which in ("first", "second"):
        assert len(said["residual_px"][which]) == 2
        assert said["residual_max_px"][which] == max(said["residual_px"][which]) <= report["tolerance_px"]
        assert 0 < said["jacobian"][which][0] <= 1 <= said["jacobian"][which][1] < 2
    assert said["residual_px"]["first"] == report["residual_px"]
    assert 0 < said["inconsistency_px"]["mean"] <= said["inconsistency_px"]["max"] < 0.1
    assert said["blend"] == "linear" and said["notes"] == []


def test_a_saved_scene_has_the_forces_and_needs_no_search(shot, tmp_path):
    """The same frames, bit for bit, with 0 evaluations; it says what its pixels refer to."""
    folder, _ = shot
    tables = read_scene(folder / "s.toml").tables
    assert tables["morph"]["size"] == tables["picture"]["size"] == [60, 40]
    assert len(tables["keyframes"]["force"]) >= 5
    assert tables["morph"]["blend_curve"] == [[0.2, 0.3], [0.4, 0.9]]
    report = tmp_path / "r.json"
    output = ["-o", str(tmp_path / "g.####.png"), "--report", str(report), "--quiet"]
    assert main(["render", str(folder / "s.toml"), *output]) == 0
    assert json.loads(report.read_text())["evaluations"] == 0
    for one in folder.glob("f.*.png"):
        assert one.read_bytes() == (tmp_path / one.name.replace("f.", "g.")).read_bytes()
    output[1] = str(tmp_path / "h.####.png")
    assert main(["render", str(folder / "s.toml"), *output, "--set", "morph.reverse=true"]) == 0
    for one, other in zip(frames_of(folder), frames_of(tmp_path, "h")[::-1], strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_dry_run_says_what_would_be_done_and_does_nothing(folder, capsys):
    before = sorted(folder.iterdir())
    arguments = ["morph", "from.png", "to.png", "--points", "points.csv", "-o", "a.gif", *QUICK]
    assert main([*arguments, "--dry-run", "--pingpong"]) == 0
    said = capsys.readouterr().out
    assert (
        "60 x 40 pixels" in said and "16 x 11 cells" in said and "frames    6 of 60 x 40 pixels at 12" in said
    )
    assert f"steps     {FLOW.steps} of" in said and "2 keyframes" in said
    assert sorted(folder.iterdir()) == before


def test_the_preview_shows_the_arrows(folder):
    arguments = ["morph", "from.png", "to.png", "--points", "points.csv", *QUICK]
    assert main([*arguments, "--preview", "p.png"]) == 0
    pictures = [read_picture(folder / name).pixels for name in ("p.png", "from.png")]
    changed = np.any(np.abs(pictures[0] - pictures[1]) > 0.01, axis=2)
    assert changed.any()
    rows, columns = np.argwhere(changed).T
    assert columns.min() >= 12 and columns.max() <= 48 and rows.min() >= 8 and rows.max() <= 32
    for x, y, to_x, to_y in POINTS:
        assert changed[y, x] and changed[to_y, to_x]


def test_a_mask_that_would_fold_is_softened_and_the_report_says_so(shot, tmp_path):
    """Rendered from the saved forces."""
    folder, _ = shot
    white = np.zeros((40, 60, 1), np.float32)
    white[:, 22:] = 1
    write_picture(tmp_path / "mask.png", Picture(white, dtype="uint8"))
    report, mask = tmp_path / "r.json", tmp_path / "mask.png"
    settings = ["--set", f'morph.timing="{mask}"', "--set", "morph.delay=0.9", "--report", str(report)]
    arguments = ["render", str(folder / "s.toml"), "-o", str(tmp_path / "g.####.png"), "--quiet", *settings]
    assert main(arguments) == 0
    found = json.loads(report.read_text())
    assert any("the timing mask is softened" in note for note in found["morph"]["notes"])
    assert min(found["morph"]["jacobian"][which][0] for which in ("first", "second")) >= 0.1


@pytest.mark.parametrize("shade", [0, 1])
def test_a_timing_mask_of_one_shade_is_late_or_early_all_over(shot, tmp_path, shade):
    """Black: the first half of the time nothing happens. White: the second half nothing more."""
    folder, _ = shot
    write_picture(tmp_path / "mask.png", Picture(np.full((4, 6, 1), shade, np.float32), dtype="uint8"))
    settings = ["--set", f'morph.timing="{tmp_path / "mask.png"}"', "--quiet"]
    assert main(["render", str(folder / "s.toml"), "-o", str(tmp_path / "g.####.png"), *settings]) == 0
    frames = frames_of(tmp_path, "g")
    still = frames[3:] if shade else frames[:4]
    for frame in still:
        np.testing.assert_allclose(frame, still[0], rtol=0, atol=1e-4)


CSV = {
    "three.csv": "20,20,26,16\n1,2,3\n",
    "far.csv": "90,20,26,16\n",
    "beyond.csv": "20,20,26,90\n",
    "empty.csv": "",
    "titles.csv": "x,y,to x,to y\n",
    "timed.csv": "20,20,26,16,0.5\n",
    "words.csv": "20,20,26,sixteen\n",
    "above.csv": "20,20,26,3\n",
}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no points to move: give at least one --move X0,Y0:X1,Y1, or --points FILE.csv"),
        (("--points", "three.csv"), "three.csv:2: 3 columns; expected from x, from y, to x, to y"),
        (("--points", "far.csv"), "90,20: outside the picture of 60 x 40 pixels"),
        (("--points", "beyond.csv"), "the point 26,90 of the second picture lies outside it, 60 x 40"),
        (("--points", "above.csv", "B=tall.png"), "the point 26,3 of the second picture is cut off"),
        (("--points", "empty.csv"), "empty.csv: has no points"),
        (("--points", "titles.csv"), "titles.csv: has no points"),
        (("--points", "timed.csv"), "not allowed in a morph: its points arrive at its end"),
        (("--points", "words.csv"), "words.csv:1: to y 'sixteen': expected a number"),
        (("--points", "no.csv"), "no.csv: no such file of points"),
        (("--points", "small.png"), "small.png"),
        (("--move", "20,20:26,16", "B=no.png"), "no.png: no such picture"),
        (("--move", "20,20:26,16", "B=points.csv"), "points.csv: not a picture that can be read"),
        (("--move", "20,20:26,16@0.2"), "not allowed in a morph: its points arrive at its end"),
        (("--move", "20,20:26"), "move '20,20:26': a point X,Y is '26': expected two numbers"),
        (("--move", "20,20:26,16", "--pin", "20,20"), "pinned and moved"),
        (("--move", "20,20:26,16", "--pin", "70,20"), "70,20: outside the picture"),
        (("--move", "20,20:26,16", "--warp-curve", "fast"), "--warp-curve 'fast': expected"),
        (
            ("--move", "20,20:26,16", "--blend-curve", "0.1:2"),
            "a curve's keys: expected times within the morph",
        ),
        (
            ("--move", "20,20:26,16", "--blend-curve", "9:0.5"),
            "a curve's keys: expected times within the morph",
        ),
        (
            ("--move", "20,20:26,16", "--blend-curve", "0.1:x"),
            "--blend-curve '0.1:x': a key: 'x' is not a number",
        ),
        (("--move", "20,20:26,16", "--blend-curve", "0.1:1:2"), "'0.1:1:2': expected SECONDS:PART"),
        (("--move", "20,20:26,16", "--fit", "cover"), "--fit 'cover': expected"),
        (("--move", "20,20:26,16", "--blend", "gamma"), "--blend 'gamma': expected"),
        (("--move", "20,20:26,16", "--timing", "left.png:0.95"), "--timing MASK:DELAY: 0.95: expected"),
        (("--move", "20,20:26,16", "--timing", "left.png:nan"), "--timing MASK:DELAY: nan: expected"),
        (("--move", "20,20:26,16", "--timing", "no.png"), "no.png: no such picture"),
        (("--move", "20,20:26,16", "--timing", "points.csv"), "points.csv: not a picture that can be read"),
        (("--move", "20,20:26,16", "--push", "20,20:3,0"), "there is no flag --push"),
        (("--move", "20,20:26,16", "--loop", "pingpong"), "there is no flag --loop"),
        (("--move", "20,20:26,16", "--waltz"), "there is no flag --waltz"),
        (("--move", "20,20:26,16", "--tolerance", "0"), "--tolerance 0"),
        (("--move", "20,20:26,16", "--plot", "a.txt"), "a.txt: plots are written as"),
        (("--move", "20,20:26,16", "--save-scene", "to.png"), "to.png"),
    ],
)
def test_bad_input_is_one_clear_line(folder, capsys, arguments, message):
    """Exit code 2, nothing is written."""
    for name, text in CSV.items():
        (folder / name).write_text(text)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    other = next((word[2:] for word in arguments if word.startswith("B=")), "other.png")
    words = [word for word in arguments if not word.startswith("B=")]
    try:
        code = main(["morph", "small.png", other, "-o", "a.####.png", *words, *QUICK])
    except SystemExit as stopped:
        code = stopped.code
    said = capsys.readouterr().err
    assert code == 2 and said.startswith("wfluid morph: "), said
    assert message in said and said.count("\n") == 1 and "Traceback" not in said, said
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_the_other_picture_is_not_written_over(folder, capsys):
    before = (folder / "other.png").read_bytes()
    arguments = ["morph", "small.png", "other.png", "--move", "20,20:26,16", *QUICK]
    assert main([*arguments, "-o", "a.gif", "--preview", "other.png"]) == 2
    assert "other.png is an input of the scene" in capsys.readouterr().err
    assert (folder / "other.png").read_bytes() == before


@pytest.mark.parametrize(
    ("sizes", "move", "fit"),
    [
        (((1, 1), (300, 200)), "0.5,0.5:150,100", "fill"),
        (((2, 3), (300, 200)), "1,1.5:150,100", "fill"),
        (((2, 3), (300, 200)), "1,1.5:150,100", "fit"),
        (((300, 200), (1, 1)), "150,100:0.5,0.5", "stretch"),
        (((3000, 2000), (2, 3)), "1500,1000:1,1.5", "stretch"),
        (((2, 3), (1200, 800)), "1,1.5:600,400", "fill"),
    ],
)
def test_tiny_and_huge_pictures_become_one_another(folder, capsys, sizes, move, fit):
    """Flat ones, so that every pixel of the ends is known, to what shrinking to two pixels loses."""
    for name, (width, height), shade in zip("ab", sizes, (0.25, 0.75), strict=True):
        write_picture(
            folder / f"{name}.png", Picture(np.full((height, width, 3), shade, np.float32), dtype="uint8")
        )
    words = ["--fit", fit, "--move", move, "--cells", "8", "--duration", "0.2", "--fps", "10", "--quiet"]
    words += ["--width", "40"] if sizes[0][0] > 1000 else []
    code = main(["morph", "a.png", "b.png", "-o", "f.####.png", *words])
    said = capsys.readouterr().err
    assert code == 0 and said == "", said
    frames = frames_of(folder)
    assert len(frames) == 3
    np.testing.assert_allclose(frames[0], 0.25, atol=0.01)
    row = frames[-1][len(frames[-1]) // 2]
    np.testing.assert_allclose(row[row.shape[0] // 2] if fit == "fit" else frames[-1], 0.75, atol=0.03)


def test_a_picture_that_folds_is_written_and_said(folder, capsys, monkeypatch):
    """Though its points are where they should be: exit code 1."""

    def folded(*arguments, **settings):
        match = match_keyframes(*arguments, **settings)
        assert match.status == "reached" and match.jacobian[0] > 0
        return replace(match, jacobian=(-0.5, 3.0))

    words = [
        "morph",
        "from.png",
        "to.png",
        "--points",
        "points.csv",
        "-o",
        "f.gif",
        *QUICK,
        "--tolerance",
        "2",
    ]
    assert main(words) == 0
    monkeypatch.setattr(wfluid.cli.render, "match_keyframes", folded)
    assert main(words) == 1
    assert "the picture folds, its smallest det J is -0.5" in capsys.readouterr().err
    assert (folder / "f.gif").exists()
