"""Painted controls on the command line: what they do, what is said of them, what is refused."""

import json

import numpy as np
import pytest

from wfluid.cli.main import main
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture

PUSH = ("--push", "30,20:5,0:radius=8")
QUICK = ("--cells", "24", "--fps", "10")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a 60 x 40 picture and paintings, made the current one."""
    rng = np.random.default_rng(0)
    white = np.ones((40, 60, 1), dtype=np.float32)
    right = white * (np.arange(60) >= 30)[None, :, None]
    spoiled, minus = white.copy(), white.copy()
    spoiled[3, 4], minus[5, 6] = np.nan, -1.0
    for name, pixels, dtype in (
        ("small.png", rng.random((40, 60, 3)).astype(np.float32), "uint8"),
        ("white.png", white, "uint8"),
        ("black.png", 0 * white, "uint8"),
        ("right.png", right, "uint8"),
        ("square.png", right[:, 20:], "uint8"),
        ("nan.exr", spoiled, "float"),
        ("minus.exr", minus, "float"),
    ):
        write_picture(tmp_path / name, Picture(pixels, dtype=dtype))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *options, seconds="0.4"):
    """Exit code of an animation, and its stderr without the summary."""
    command = ["animate", "small.png", "-o", "o.####.exr", *PUSH, *QUICK, *options, "--report", "r.json"]
    try:
        code = main([*command, "--duration", seconds])
    except SystemExit as stopped:
        code = stopped.code
    said = capsys.readouterr().err.splitlines(keepends=True)
    return code, "".join(line for line in said if not line.startswith("wfluid: longest displacement"))


def sharp(name):
    return read_picture(name).pixels


def test_a_frozen_half_stays_and_the_other_moves(folder, capsys):
    """Pushed in the middle: the frozen right side keeps its pixels, the left one does not."""
    assert run(capsys, "--freeze", "right.png") == (0, "")
    before, after = sharp("o.1001.exr"), sharp("o.1005.exr")
    assert np.abs(after - before)[:, 36:].max() < 0.03 < 0.2 < np.abs(after - before)[:, 12:28].max()
    assert json.loads((folder / "r.json").read_text())["settings"]["freeze"] == 10000


def test_a_weaker_freeze_lets_more_through(folder, capsys):
    moved = []
    for strength in ("1", "30", "1000"):
        assert run(capsys, "--freeze", f"right.png:{strength}") == (0, "")
        moved.append(np.abs(sharp("o.1005.exr") - sharp("o.1001.exr"))[:, 36:56].mean())
    assert moved[0] > 1.5 * moved[1] > 1.5 * 1.5 * moved[2], moved


def test_a_viscosity_image_stiffens_its_bright_side(folder, capsys):
    """The report has its range, and the other way round it is the other side that moves more."""
    moved = {}
    for options in ((), ("--invert-viscosity",)):
        flags = ("--viscosity-image", "right.png", "--viscosity", "5", "--viscosity-floor", "0.001", *options)
        assert run(capsys, *flags) == (0, "")
        change = np.abs(sharp("o.1005.exr") - sharp("o.1001.exr")).mean(axis=(0, 2))
        moved[options] = change[5:25].mean() / change[35:55].mean()
        report = json.loads((folder / "r.json").read_text())
        assert report["settings"]["viscosity"] == pytest.approx([0.001, 5.0])
        assert report["solves"]["diffusion"]["methods"] == ["conjugate gradients"]
    assert moved[()] > 1.5 > 1 / 1.5 > moved["--invert-viscosity",], moved


def test_a_viscosity_that_moves_is_another_motion(folder, capsys):
    """Carried with the picture, a stiff side ends elsewhere than one that stays."""
    flags = ("--viscosity-image", "right.png", "--viscosity", "1", "--viscosity-floor", "0.001")
    ends = []
    for moves in ((), ("--viscosity-moves",)):
        assert run(capsys, *flags, *moves) == (0, "")
        ends.append(sharp("o.1005.exr"))
    assert np.abs(ends[1] - ends[0]).max() > 0.01
    assert json.loads((folder / "r.json").read_text())["settings"]["viscosity_moves"] is True


def test_an_effect_mask_keeps_forces_to_its_white(folder, capsys):
    """Painted forces everywhere, then only on the white side: the far black side moves much less."""
    moved = []
    for mask in ((), ("--effect-mask", "right.png")):
        assert run(capsys, "--force-image", "small.png:along=contour,amount=4", *mask) == (0, "")
        moved.append(np.abs(sharp("o.1005.exr") - sharp("o.1001.exr"))[:, 2:18].mean())
    assert moved[1] < 0.5 * moved[0], moved


@pytest.mark.parametrize(
    ("options", "notes"),
    [
        (("--viscosity-image", "black.png"), ["black everywhere", "viscosity is 0 everywhere"]),
        (("--viscosity-image", "white.png", "--invert-viscosity"), ["white everywhere", "viscosity is 0"]),
        (("--freeze", "black.png"), ["black.png: black everywhere, so nothing is frozen"]),
        (("--freeze", "square.png"), ["square.png: 40 x 40 pixels stretched over the picture's 60 x 40"]),
        (("--force-image", "self"), ["pressure cancels the force of a gradient", "along=contour", "mask"]),
        (("--force-image", "self:along=contour"), []),
        (("--force-image", "self", "--effect-mask", "right.png"), []),
    ],
)
def test_what_a_user_should_know_is_said_in_one_line(folder, capsys, options, notes):
    code, said = run(capsys, *options)
    assert code == 0 and said.count("\n") == bool(notes)
    assert all(note in said for note in notes) and (not notes or said.startswith("wfluid: note: "))
    assert run(capsys, *options, "--quiet") == (0, "")


def test_the_preview_tints_what_is_stiff_and_frozen(folder, capsys):
    plain = ("animate", "small.png", *PUSH, "--preview", "p.png")
    for flags, side in ((("--freeze", "right.png"), 2), (("--viscosity-image", "right.png"), 0)):
        assert main([*plain]) == 0
        without = sharp("p.png")
        assert main([*plain, *flags]) == 0
        change = sharp("p.png") - without
        assert np.abs(change[:, :28]).max() < 0.02
        assert change[:10, 34:, side].mean() > 0.02 + change[:10, 34:, 2 - side].mean()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--viscosity-image", "none.png"), "none.png: no such picture"),
        (("--viscosity-image", "nan.exr"), "nan.exr: 1 values are not finite"),
        (("--viscosity-image", "minus.exr"), "minus.exr: a picture with the value -1.0 has no intensity"),
        (
            ("--viscosity-image", "self", "--viscosity", "-2"),
            "--viscosity -2.0: expected a number",
        ),
        (
            ("--viscosity-image", "self", "--viscosity", "5000"),
            "--viscosity 5000.0: expected",
        ),
        (("--viscosity-image", "self", "--viscosity-floor", "1"), "floor 1 is above scale 0.1"),
        (("--viscosity-image", "self", "--viscosity-floor", "nan"), "--viscosity-floor nan: expected"),
        (("--invert-viscosity",), "--invert-viscosity needs a --viscosity-image"),
        (("--viscosity-moves",), "--viscosity-moves needs a --viscosity-image"),
        (("--viscosity-floor", "0.1"), "--viscosity-floor needs a --viscosity-image"),
        (("--viscosity-floor", "0"), "--viscosity-floor needs a --viscosity-image"),
        (("--freeze", "white.png"), "white.png: the freeze mask is painted all over"),
        (("--freeze", "black.png:-5"), "--freeze MASK:strength: -5.0: expected"),
        (("--freeze", "black.png:nan"), "nan: expected a number from 0 to 1e+06"),
        (("--freeze", "black.png:1e9"), "1000000000.0: expected a number from 0"),
        (("--freeze", "none.png:100"), "none.png: no such picture"),
        (("--freeze", "nan.exr"), "nan.exr: 1 values are not finite"),
        (("--effect-mask", "black.png"), "black.png: black everywhere, so no force acts"),
        (("--force-image", "none.png"), "none.png: no such picture"),
        (("--force-image", "black.png"), "black.png: ImageForce: the picture is the same everywhere"),
        (("--force-image", "self:along=swirl"), "along: 'swirl': expected one of gradient, contour, vectors"),
        (("--force-image", "self:along=contour,speed=3"), "'speed=3' is not key=value with a key of along"),
        (("--force-image", "self:strength=strong"), "'strong' is not a number"),
        (("--force-image", "self:at=9"), "at=9: the animation lasts 0.4 s"),
        (("--force-image", "self:along=contour,amount=1e9"), "expected at most 10000"),
        (("--force-image", "self:radius=-1"), "radius: -1.0: expected a number from 0"),
        (("--force-image", "black.png:along=vectors"), "needs two channels"),
        (("-o", "x.####.png", "--freeze", "x.1005.png"), "is an input of the scene"),
    ],
)
def test_mistakes_are_one_line_with_the_remedy_and_nothing_is_written(folder, capsys, options, says):
    before = sorted(path.name for path in folder.iterdir())
    code, said = run(capsys, *options)
    assert (code, said.count("\n")) == (2, 1) and says in said, said
    assert sorted(path.name for path in folder.iterdir()) == before
