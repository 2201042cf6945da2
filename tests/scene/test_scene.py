"""What is wrong in a scene, or beside it, is said in one line with its place, and nothing is written."""

import re
import time

import pytest
from scenes import SHOT, render, write_shot

from wfluid.cli.main import main


@pytest.fixture
def shots(tmp_path, monkeypatch):
    """A folder with pictures and the scene; the current folder is the one above."""
    monkeypatch.chdir(tmp_path)
    return write_shot(tmp_path / "shots")


def edited(folder, old, new):
    """The scene with a part replaced; the number of the line that then says "# here"."""
    assert SHOT.count(old) == 1
    text = SHOT.replace(old, new)
    (folder / "shot.toml").write_text(text)
    return next((n for n, line in enumerate(text.splitlines(), 1) if "# here" in line), None)


def refused(capsys, folder, *options):
    """What is said in the one line of a render that writes nothing, after the verb."""
    before = sorted(folder.parent.rglob("*"))
    code, said = render("shots/shot.toml", *options), capsys.readouterr()
    assert (code, said.out, said.err.count("\n")) == (2, "", 1), said.err
    assert sorted(folder.parent.rglob("*")) == before
    verb, _, reason = said.err.partition(": ")
    assert verb == "wfluid render"
    return reason


PUSH = '[[force]]\nkind = "push"\ncenter = [30, 20]\n'
EYE = 'kind = "vortex"\nname = "eye"\ncenter = [10, 10]\nturn = 20'
HERE = "[[force]]  # here\n"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        # kinds and keys that do not exist
        ('"push"', '"psuh"  # here', "force.0.kind: 'psuh': expected one of push, vortex"),
        ('"push"', '"psuh"  # here', "did you mean push?\n"),
        ('"fade"', '"fate"  # here', "envelopes.swell.kind: 'fate': expected one of constant, fade"),
        ("[fluid]", "[fluids]  # here", "fluids: no such key; did you mean fluid?\n"),
        ("[[layer]]", "[[layers]]  # here", "layers: no such key; did you mean layer?\n"),
        ("duration =", "duratoin = 1 # here\n#", "time.duratoin: no such key; did you mean duration?\n"),
        ("turn = 20", "turn = 20\nraduis = 3  # here", "force.1.raduis: no such key; did you mean radius?\n"),
        ("turn = 20", "turn = 20\nby = [1, 2]  # here", "force.1.by: no such key"),
        ("center = [20, 20]", "centre = [9, 9]  # here", "density.0.source.0.centre: no such key; did you"),
        ("[[layer]]", '[keyframes]\nfile = "a.csv"  # here\n[[layer]]', "keyframes.file: no such key"),
        ("wfluid = 1", "wfluid = 1\nmotion = 3  # here", "motion: no such key"),
        # keys that are missing: the table's line
        ('[[force]]\nkind = "push"', "[[force]]  # here", "force.0: kind is missing: expected one of push"),
        (PUSH + "by", HERE + 'kind = "push"\nat', "force.0: by is missing: displacement of the centre"),
        (
            '[picture]\nfile = "small.png"',
            "[picture]  # here",
            "picture: file is missing: file of the picture",
        ),
        ('[[layer]]\nname = "matte"', "[[layer]]  # here", "layer.0: name is missing: name of the layer"),
        # values of a wrong type or range
        ("duration = 0.2", 'duration = "long"  # here', "time.duration: 'long': expected a number above 0\n"),
        ("fps = 10", "fps = true  # here", "time.fps: True: expected a number from 0.01 to 1000"),
        ("fps = 10", "fps = nan  # here", "time.fps: nan: expected a number from 0.01 to 1000"),
        ("by = [5, 0]", "by = [5]  # here", "force.0.by: [5]: expected two numbers, [x, y]"),
        ("cells = 16", "cells = 3  # here", "fluid.cells: 3: expected a whole number from 4 to 8192"),
        ("cells = 16", "cells = 16.5  # here", "fluid.cells: 16.5: expected a whole number from 4"),
        ('"ink"', '"ink"\ncolor = "red"  # here', "density.0.color: 'red': expected a colour such as"),
        ("[fluid]", '[fluid]\nwalls = "soft"  # here', "fluid.walls: 'soft': expected free-slip, no-slip"),
        ("wfluid = 1", "wfluid = 1\neffect = 3  # here", "effect: expected a table, [effect]\n"),
        ("[fluid]", "[[fluid]]  # here", "fluid: expected a table, [fluid]\n"),
        ('[[group]]\nname = "nose"', '[group]  # here\nname = "nose"', "group: expected a list of tables, "),
        ("wfluid = 1", "wfluid = 2  # here", "wfluid: 2: a scene of a newer version; this wfluid reads up"),
        # names that do not fit together
        (
            'name = "nose"',
            'name = "nose"\n[[group]]\nname = "nose"  # here',
            "group.1.name: 'nose' is the na",
        ),
        (
            'group = "nose"',
            'group = "nos"  # here',
            "force.0.group: 'nos': no such group; expected one of nose; did",
        ),
        (
            '= "swell"',
            '= "swel"  # here',
            "force.0.envelope: 'swel': no such envelope; expected one of swell; did",
        ),
        (
            '"matte"\nfile',
            '"ink"\nfile',
            "density.0.name: 'ink' is taken: give layers and densities different names",
        ),
        (
            'of = "matte"',
            'of = "mate"  # here',
            "output.1.of: 'mate': no such of; expected one of picture, tracks",
        ),
        (
            EYE,
            'kind = "buoyancy"\nby = [0, 9]\ndensity = "oil"  # here',
            "'oil': no such density; expected one of ink",
        ),
        # values that contradict, or lie outside: their table
        (PUSH, HERE + 'kind = "push"\n', "force.0: push: expected either center or path"),
        (PUSH, HERE + PUSH[10:] + "path = [[0, 1, 2], [1, 3, 4]]\n", "force.0: push: expected either"),
        (PUSH, HERE + 'kind = "push"\ncenter = [61, 20]\n', "61,20: outside the picture of 60 x 40 pixels"),
        (PUSH, HERE + PUSH[10:] + "at = 0.1\nend = 0.2\n", "force.0: push: at= is an impulse: leave out"),
        (PUSH, HERE + PUSH[10:] + "start = 0.2\n", "force.0: push start=0.2: the animation lasts 0.2 s"),
        (PUSH, HERE + PUSH[10:] + "start = 0.1\nend = 0.1\n", "force.0: push: end 0.1 is not after start"),
        (PUSH, HERE + PUSH[10:] + "phase = 0.1\n", "force.0: push: phase= needs period="),
        (
            "[envelopes.swell]",
            "[envelopes.swell]  # here\nfall = 1",
            "envelopes.swell: Fade: a rise of 0.1 and",
        ),
        ("[[density]]", "[[density]]  # here\nimage = 'none.png'", "density.0: shots/none.png: no such"),
        (PUSH, HERE + PUSH[10:] + "mask = 'none.png'\n", "force.0: shots/none.png: no such picture"),
        ("size = [60, 40]", "size = [0, 40]  # here", "picture.size: 0 x 40: expected positive numbers"),
        (
            "[[layer]]",
            "[frames]  # here\nwidth = 9\nscale = 2\n[[layer]]",
            "frames: width and scale both set",
        ),
        (
            "[[layer]]",
            "[viscosity]  # here\ninvert = true\n[[layer]]",
            "viscosity: viscosity: invert needs an",
        ),
        (
            "[[layer]]",
            "[tracks]\npoints = [[3, 41]]  # here\n[[layer]]",
            "tracks.points: a point at 3,41: outs",
        ),
        (
            "fps = 10",
            'loop = "oscillate"  # here\nfps = 10',
            "time.loop: loop oscillate: no force oscillates",
        ),
    ],
)
def test_what_is_wrong_in_a_scene_is_said_with_its_line(shots, capsys, old, new, says):
    line = edited(shots, old, new)
    reason = refused(capsys, shots)
    assert says in reason, reason
    assert line is None or reason.startswith(f"shots/shot.toml:{line}: "), (line, reason)


def test_what_is_wrong_after_an_array_of_several_lines_is_said_with_its_line(shots, capsys):
    """Rows of numbers are no headings."""
    stroke = 'kind = "stroke"\npoints = [\n  [10, 10],\n  [40, 20],\n]\nraduis = 3  # here'
    line = edited(shots, EYE, stroke)
    assert refused(capsys, shots).startswith(f"shots/shot.toml:{line}: force.1.raduis: no such key; did you")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("by = [5, 0]", "by = [5, 0", 1),
        ("by = [5, 0]", "by = [5, 0]]", 0),
        ("by = [5, 0]", "by =", 0),
        ("by = [5, 0]", 'by = "5, 0', 0),
        ("[time]", "[time", 0),
        ("[time]", "time", 0),
        ("fps = 10", "fps = 10 12", 0),
        ("fps = 10", "fps = 1979-13-45", 0),
        ("fps = 10", "fps = 10\nfps = 12", 1),
    ],
)
def test_what_is_no_toml_is_said_with_line_and_column(shots, capsys, old, new, line):
    """An array that is not closed is noticed in the line after, what is there twice where it is again."""
    edited(shots, old, new)
    number = SHOT[: SHOT.index(old)].count("\n") + 1 + line
    assert re.match(rf"shots/shot\.toml:{number}:\d+: no TOML: \S", refused(capsys, shots))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("duration = 0.2", "duration = 0.001  # here", "0.001 s at 10 fps is 0.01 frames"),
        (
            "[[layer]]",
            "[frames]\nscale = 10000  # here\n[[layer]]",
            "width 600000: expected 1 … 32768 pixels",
        ),
        (
            'file = "o.####.png"',
            'file = "o.####.exr"\ncompression = "best"  # here',
            "compression 'best': exp",
        ),
    ],
)
def test_what_makes_no_sense_together_is_said_with_its_key_and_line(shots, capsys, old, new, says):
    """The key's own, or its table's."""
    line = edited(shots, old, new)
    reason = refused(capsys, shots)
    lines = [line - back for back in range(3)]
    assert says in reason and any(reason.startswith(f"shots/shot.toml:{n}: ") for n in lines), reason


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('file = "small.png"', 'file = "none.png"', "shots/none.png: no such picture"),
        ('file = "right.png"', 'file = "sub/none.png"', "shots/sub/none.png: no such picture"),
        (EYE, 'kind = "image"\nfile = "none.exr"', "force.1: shots/none.exr: no such picture"),
        ("[time]", '[freeze]\nmask = "none.png"\n[time]', "freeze: shots/none.png: no such picture"),
        ("[time]", '[effect]\nmask = "none.png"\n[time]', "effect.mask: shots/none.png: no such picture"),
        ("[time]", '[viscosity]\nimage = "none.png"\n[time]', "viscosity: shots/none.png: no such picture"),
        ("center = [20, 20]", 'image = "none.png"', "density.0: shots/none.png: no such picture"),
        ("o.####.png", "small.png", "shots/small.png is the picture itself: write to another name"),
        ("o.####.png", "right.png", "shots/right.png is an input of the scene: write to another name"),
        ("o.####.png", "m.1002.png", "is the output of 'picture': write to another name"),
        ("o.####.png", "shot.####.toml", "unknown picture format '.toml'"),
        ("o.####.png", "none/o.####.png", "shots/none: no such folder; make it first"),
        ("o.####.png", "o.png", "shots/o.png: cannot tell the output's kind; name it x.gif"),
        ('"o.####.png"', '"o.####.png"\ncompression = "zip"', "compression 'zip' is not for .png"),
        ('"o.####.png"', '"shot.toml"\nof = "report"', "write to another name"),
        (
            '"o.####.png"',
            '"where.txt"\nof = "tracks"\n[tracks]\npoints = [[1, 1]]',
            "shots/where.txt: tracks are written as .csv",
        ),
        ('"o.####.png"', '"where.csv"\nof = "tracks"', "no points to follow"),
    ],
)
def test_files_that_cannot_be_are_refused(shots, capsys, old, new, says):
    """Names begin in the scene's folder; nothing is written over what is read, the scene included."""
    edited(shots, old, new)
    assert says in refused(capsys, shots)
    assert (shots / "shot.toml").read_text() == SHOT.replace(old, new)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--set", "time.duration"), "--set 'time.duration': expected key=value, such as time.duration=3\n"),
        (("--set", "=3"), "--set '=3': expected key=value"),
        (("--set", "time.duratoin=3"), "time.duratoin: no such key; did you mean duration?\n"),
        (("--set", "tiem.duration=3"), "tiem: no such key; did you mean time?\n"),
        (("--set", "time.duration=-3"), "time.duration: -3: expected a number above 0\n"),
        (("--set", "time.duration=long"), "time.duration: 'long': expected a number above 0\n"),
        (("--set", "time.fps.x=3"), "--set 'time.fps.x=3': time.fps is a value: expected a table\n"),
        (("--set", "time=3"), "time: expected a table, [time]\n"),
        (("--set", "force.2.turn=3"), "--set 'force.2.turn=3': no item '2' of 2\n"),
        (("--set", "force.eyes.turn=3"), "no item 'eyes' of 2; did you mean eye?\n"),
        (("--set", "force.-1.turn=3"), "no item '-1' of 2\n"),
        (("--set", "force.eye.kind=push"), "force.1.turn: no such key"),
        (("--set", "picture.file=none.png"), "shots/none.png: no such picture\n"),
        (("--set", "wfluid=2"), "wfluid: 2: a scene of a newer version"),
        (("--set", "output.0.file=small.png"), "is the picture itself"),
        (("-o", "shots/small.png"), "is the picture itself"),
        (("-o", "a.xyz"), "cannot tell the output's kind"),
        (("-o", "a.gif", "-o", "a.gif"), "a.gif is the output of 'picture'"),
        (("--report", "shots/shot.toml"), "shots/shot.toml is "),
        (("--report", "none/r.json"), "none: no such folder"),
        (("--preview", "shots/right.png"), "is an input of the scene"),
    ],
)
def test_mistakes_beside_the_scene_are_refused(shots, capsys, options, says):
    assert says in refused(capsys, shots, *options)
    assert (shots / "shot.toml").read_text() == SHOT


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("shots/none.toml", "shots/none.toml: no such scene\n"),
        ("shots/small.png", "shots/small.png: cannot be read (no UTF-8)\n"),
        ("shots", "shots: cannot be read (Is a directory)\n"),
    ],
)
def test_a_scene_that_is_not_there_or_no_text_is_refused(shots, capsys, name, says):
    assert main(["render", name]) == 2
    assert capsys.readouterr().err == f"wfluid render: {says}"


def test_a_scene_that_moves_nothing_or_writes_nothing_is_refused(shots, capsys):
    moves = SHOT[SHOT.index("[[force]]") : SHOT.index("[[layer]]")]
    (shots / "shot.toml").write_text(SHOT.replace(moves, ""))
    assert "nothing moves the picture" in refused(capsys, shots)
    (shots / "shot.toml").write_text(SHOT[: SHOT.index("[[output]]")])
    assert "no output: give -o OUT" in refused(capsys, shots)


def test_sizes_beyond_the_memory_are_refused(shots, capsys, monkeypatch):
    monkeypatch.setattr("wfluid.animation.estimate.free_memory", lambda: 2 * 10**9)
    reason = refused(capsys, shots, "--dry-run", "--set", "fluid.cells=8000", "--set", "frames.width=30000")
    assert "8000 x 5333 cells and 3 frames 30000 pixels wide need about " in reason
    assert "GB of memory, 2 GB are free" in reason


def test_a_key_given_twice_is_said_with_its_column_wherever_it_is(shots, capsys):
    """Reading a long scene takes no longer for it."""
    lines = [f"# line {n}" for n in range(3000)]
    (shots / "shot.toml").write_text("\n".join([*SHOT.splitlines(), *lines, "file = 1", "file = 2"]) + "\n")
    number = len(SHOT.splitlines()) + 3001
    began = time.perf_counter()
    assert refused(capsys, shots).startswith(f"shots/shot.toml:{number}:")
    assert time.perf_counter() - began < 5
