"""Keyframes in scenes and on the command line: what each key says, what is written, said and refused."""

import json
import os
import signal
import time

import numpy as np
import pytest
from scenes import KEYS, write_pictures

import wfluid.animation.animation
import wfluid.cli.render
from wfluid.cli.main import main
from wfluid.cli.progress import SearchProgress
from wfluid.domain.limits import TOLERANCE
from wfluid.domain.timeline import substeps_for
from wfluid.pictures.stills import read_picture
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.scene.toml_file import read_scene, write_scene
from wfluid.staging.build import stage_all

MOVE = {"from": [20, 20], "to": [26, 16]}
FOUND = {"center": [21, 19], "vector": [90, -60], "radius": 6, "start": 0, "end": 0.25}
QUICK = ("--cells", "16", "--time", "0.25", "--fps", "12", "--quiet")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with pictures of 60 x 40 pixels."""
    write_pictures(tmp_path)
    (tmp_path / "points.csv").write_text("x,y,to x,to y,s\n10,20,12,22,0.5\n50,30,48,30,\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def staged(folder, keyframes, **more):
    scene = {"wfluid": 1, "picture": {"file": "small.png"}, "keyframes": keyframes, **more}
    staged = stage_all(Scene(scene, folder))
    return staged.animation, staged.aims


CASES = {
    "[[keyframes.move]]": {
        "from": ({"from": [30, 15]}, lambda a: a.keyframes[0].point, (0.5, 0.25)),
        "to": ({"to": [30, 15]}, lambda a: a.keyframes[0].destination, (0.5, 0.25)),
        "time": ({"time": 0.4}, lambda a: a.keyframes[0].time, 0.4),
        "weight": ({"weight": 3}, lambda a: a.keyframes[0].weight, 3),
    },
    "[keyframes]": {
        "points": (
            {"points": "points.csv", "time": 1.0},
            lambda a: [(one.point[0], one.destination[1], one.time) for one in a.keyframes],
            [(1 / 6, 22 / 60, 0.5), (5 / 6, 0.5, 1.0)],
        ),
        "time": ({"move": [MOVE], "time": 0.6}, lambda a: a.keyframes[0].time, 0.6),
        "pins": ({"move": [MOVE], "pins": [[30, 30]]}, lambda a: a.pins, [(0.5, 0.5)]),
        "tolerance": ({"move": [MOVE], "tolerance": 6}, lambda a: a.tolerance, 0.1),
    },
    "[[keyframes.force]]": {
        "center": ({"center": [30, 15]}, lambda a: a.found[0].center, (0.5, 0.25)),
        "vector": ({"vector": [90, -60]}, lambda a: a.found[0].vector, (1.5, -1)),
        "radius": ({"radius": 12}, lambda a: a.found[0].radius, 0.2),
        "start": ({"start": 0.1}, lambda a: a.found[0].envelope.start, 0.1),
        "end": ({"end": 0.2}, lambda a: a.found[0].envelope.end, 0.2),
    },
}
"""By heading and key: the values, what is looked at, what is seen."""


def test_every_key_has_its_case():
    known = {(heading, key) for heading, keys in CASES.items() for key in keys}
    assert known == {key for key in KEYS if "keyframes" in key[0]}


@pytest.mark.parametrize(("heading", "key"), [(heading, key) for heading in CASES for key in CASES[heading]])
def test_a_key_does_what_it_says(folder, heading, key):
    """Pixels of the scene are lengths in parts of the longer side, times fall on steps."""
    values, look, seen = CASES[heading][key]
    table = {
        "[keyframes]": values,
        "[[keyframes.move]]": {"move": [{**MOVE, **values}]},
        "[[keyframes.force]]": {"move": [MOVE], "force": [{**FOUND, **values}]},
    }[heading]
    _, aims = staged(folder, table)
    np.testing.assert_allclose(look(aims), seen, rtol=1e-6)


def test_what_is_left_out_is_the_documented_default(folder):
    """A tolerance of a quarter pixel of 512; moves arrive at the end; the length is the last keyframe's."""
    animation, aims = staged(folder, {"move": [MOVE]}, time={"duration": 0.5})
    assert aims.tolerance == TOLERANCE and aims.keyframes[0].time == 0.5 and aims.keyframes[0].weight == 1
    animation, _ = staged(folder, {"move": [{**MOVE, "time": 0.4}, {**MOVE, "time": 0.8}]})
    assert animation.timeline.end == pytest.approx(0.8)
    assert staged(folder, {"move": [MOVE]})[0].timeline.end == 2.0
    animation, _ = staged(folder, {"move": [{**MOVE, "time": 0.33}]}, time={"fps": 7})
    assert 0.33 <= animation.timeline.end < 0.33 + 1 / 7


@pytest.mark.parametrize(
    ("times", "fps", "least", "steps"),
    [
        ([1.0], 24, 48, 2),
        ([0.5, 1 / 3], 10, 48, 6),
        ([0.125], 15, 48, 8),
        ([0.731], 24, 48, 2),
        ([1], 96, 48, 1),
    ],
)
def test_steps_are_chosen_so_that_every_time_falls_on_one(times, fps, least, steps):
    """The fewest, 48 a second or more; where no few do it, the fewest."""
    assert substeps_for(times, fps, least) == steps


def test_a_time_between_all_steps_is_met_at_the_nearest_and_said(folder):
    said = []
    scene = {"wfluid": 1, "picture": {"file": "small.png"}, "keyframes": {"move": [{**MOVE, "time": 0.7313}]}}
    scene["time"] = {"duration": 1, "fps": 12}
    aims = stage_all(Scene(scene, folder), note=said.append).aims
    assert abs(aims.keyframes[0].time - 0.7313) < 0.5 / 48 + 1e-9
    assert said == [f"a keyframe at 0.7313 s is moved to {aims.keyframes[0].time:.6g} s, the end of a step"]


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """A folder where two points were sent to places and one was pinned, and what was said."""
    folder = tmp_path_factory.mktemp("shot")
    write_pictures(folder)
    moves = ("--move", "20,20:24,17", "--move", "42,20:42,24@0.5", "--pin", "30,30")
    size = ("--cells", "64", "--time", "0.5", "--fps", "12", "--quiet", "--track", "20,20")
    files = {"-o": "f.####.png", "--report": "r.json", "--save-scene": "s.toml", "--plot": "a.png"}
    files |= {"--tracks": "t.csv"}
    written = [word for flag, name in files.items() for word in (flag, str(folder / name))]
    code = main(["keyframes", str(folder / "small.png"), *moves, *size, *written])
    return folder, code


def test_points_arrive_and_the_report_says_how_near(shot):
    folder, code = shot
    report = json.loads((folder / "r.json").read_text())
    assert code == 0 and report["status"] == "reached"
    assert len(report["residual_px"]) == len(report["keyframes"]) == 3
    assert report["residual_max_px"] == max(report["residual_px"]) <= report["tolerance_px"]
    assert report["tolerance_px"] == pytest.approx(0.25 * 60 / 512)
    assert report["iterations"] == len(report["history"]) > 0
    assert report["evaluations"] >= report["iterations"]
    assert {"stage", "evaluations", "objective", "worst_px"} == set(report["history"][0])
    last = (folder / "t.csv").read_text().strip().splitlines()[-1].split(",")
    assert np.hypot(float(last[3]) - 24, float(last[4]) - 17) <= report["tolerance_px"]
    assert len(list(folder.glob("f.*.png"))) == 7
    assert read_picture(folder / "a.png").width > 1000


def test_a_plot_adds_nothing_to_the_times_in_the_report(folder, monkeypatch):
    """The frames run for the figure take an hour each by this clock, those that are written do not."""
    slow, hours, now = [], [], time.perf_counter
    measure, plot = wfluid.animation.animation.measure_map, wfluid.cli.render.plot_match

    def slowly(*arguments):
        hours.extend(slow)
        return measure(*arguments)

    def plotted(*arguments):
        slow.append(True)
        plot(*arguments)
        slow.clear()

    monkeypatch.setattr(time, "perf_counter", lambda: now() + 3600 * len(hours))

    monkeypatch.setattr("wfluid.animation.animation.measure_map", slowly)
    monkeypatch.setattr("wfluid.cli.render.plot_match", plotted)
    files = ("-o", "f.####.png", "--report", "r.json", "--plot", "a.png")
    main(["keyframes", "small.png", "--move", "20,20:22,19", "--tolerance", "1", *QUICK, *files])
    seconds = json.loads((folder / "r.json").read_text())["seconds"]
    assert hours and seconds["simulate"] < 3600, seconds
    assert {"compile", "simulate", "lookup", "write", "total"} == set(seconds)


def test_a_saved_scene_has_the_forces_and_needs_no_search(shot, tmp_path):
    """The same frames, bit for bit; with another arrow beside, the search goes on from them."""
    folder, _ = shot
    scene = read_scene(folder / "s.toml")
    assert len(scene.tables["keyframes"]["force"]) >= 5
    report = tmp_path / "r.json"
    again = ["render", str(folder / "s.toml"), "-o", str(tmp_path / "g.####.png"), "--quiet"]
    again += ["--report", str(report)]
    assert main(again) == 0
    assert json.loads(report.read_text())["evaluations"] == 0
    for one in folder.glob("f.*.png"):
        assert one.read_bytes() == (tmp_path / one.name.replace("f.", "g.")).read_bytes()
    keyframes = dict(scene.tables["keyframes"])
    keyframes["move"] = [*keyframes["move"], {"from": [12, 32], "to": [15, 32], "time": 0.5}]
    write_scene(tmp_path / "more.toml", Scene({**scene.tables, "keyframes": keyframes}, folder))
    again[1] = str(tmp_path / "more.toml")
    assert main(again) == 0
    said = json.loads(report.read_text())
    assert said["evaluations"] > 0 and len(said["residual_px"]) == 4


def test_what_cannot_be_reached_is_finished_and_said(folder, capsys):
    """A corner stays a corner: frames are written, each point's distance is said, exit code 1."""
    code = main(
        ["keyframes", "small.png", "-o", "a.gif", "--move", "0,0:9,9", "--move", "30,20:31,20", *QUICK]
    )
    said = capsys.readouterr().err
    assert code == 1 and (folder / "a.gif").exists()
    assert "unreachable: the farthest point is " in said and "0,0 to 9,9 at 0.25 s: " in said
    assert "it lies in a corner" in said and "30,20 to" not in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no points to move: give at least one --move X0,Y0:X1,Y1[@T], or --points FILE.csv"),
        (("--move", "20,20"), "move '20,20': expected X0,Y0:X1,Y1 or X0,Y0:X1,Y1@SECONDS"),
        (("--move", "20,x:3,4"), "move '20,x:3,4': a point X,Y: 'x' is not a number"),
        (("--move", "20,20:3,4@soon"), "time: 'soon' is not a number"),
        (("--move", "20,20:3,4@0"), "--move 20,20:3,4@0"),
        (("--move", "20,20:70,4"), "to at 70,4: outside the picture of 60 x 40 pixels"),
        (("--move", "1,1:5,5", "--move", "1,1:6,6"), "the point 1,1 has two destinations at 0.25 s"),
        (("--move", "1,1:5,5", "--move", "2,2:5,5"), "the points 1,1 and 2,2 have one destination, 5,5,"),
        (("--move", "1,1:5,5", "--pin", "1,1"), "the point 1,1 is pinned and moved"),
        (("--move", "1,1:5,5", "--pin", "90,1"), "90,1: outside the picture"),
        (("--move", "1,1:5,5@2", "--duration", "1"), "a keyframe at 2 s: expected at most the duration"),
        (("--move", "1,1:5,5", "--tolerance", "0"), "--tolerance 0"),
        (
            ("--move", "1,1:5,5", "--loop", "pingpong"),
            "a loop (pingpong) ends as it begins, so no keyframe is reached",
        ),
        (("--move", "1,1:5,5", "--plot", "a.txt"), "a.txt: plots are written as"),
        (("--points", "no.csv"), "no.csv"),
        (("--points", "small.png"), "small.png"),
    ],
)
def test_bad_input_is_one_clear_line(folder, capsys, arguments, message):
    assert main(["keyframes", "small.png", "-o", "a.gif", *arguments, *QUICK]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1 and "Traceback" not in said, said
    assert not (folder / "a.gif").exists()


def test_a_wrong_key_is_named_with_its_line(folder):
    text = 'wfluid = 1\n[picture]\nfile = "small.png"\n[[keyframes.move]]\nfrom = [1, 1]\nto = [99, 1]\n'
    (folder / "s.toml").write_text(text)
    with pytest.raises(SceneError, match=r"s.toml:4: keyframes.move.0: to at 99,1: outside"):
        stage_all(read_scene(folder / "s.toml"))


def test_the_preview_shows_arrows_and_pins(folder):
    """Where there is neither arrow nor pin, the picture is as without."""
    arguments = ["keyframes", "small.png", "--move", "20,20:40,20", "--quiet", "--preview"]
    assert main([*arguments, "a.png"]) == 0
    assert main([*arguments, "b.png", "--pin", "30,35"]) == 0
    one, other = (read_picture(folder / name).pixels for name in ("a.png", "b.png"))
    changed = np.argwhere(np.any(one != other, axis=2))
    assert len(changed) and np.abs(changed - (35, 30)).max() <= 3


def test_an_interrupt_ends_the_search_with_the_best_so_far(folder, capsys, monkeypatch):
    """Ctrl-C in the middle: the frames are written whole, how far each point is is said, exit code 130."""

    def press(self, at):
        seen.append(at)
        if len(seen) == 3:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)  # the handler runs

    seen = []
    monkeypatch.setattr(SearchProgress, "_show", press)
    moves = ("--move", "8,8:13,12", "--move", "50,20:44,23")
    assert main(["keyframes", "small.png", "-o", "a.gif", *moves, *QUICK]) == 130
    said = capsys.readouterr().err
    assert "stopped: the farthest point is " in said and "8,8 to 13,12 at 0.25 s: " in said
    assert (folder / "a.gif").exists() and len(seen) == 3
