"""Scenes as they are staged and run: what fits together, what is refused, what is never written over."""

import numpy as np
import pytest

from wfluid.cli.main import main
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture
from wfluid.scene.scene import Scene
from wfluid.scene.schema import SceneError
from wfluid.staging.build import stage

PUSH = {"kind": "push", "center": [30, 20], "by": [5, 0], "radius": 8}
STROKE = {"kind": "stroke", "radius": 8}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a 60 x 40 picture and masks, made the current one."""
    rng = np.random.default_rng(0)
    right = (np.arange(60) >= 30)[None, :, None] * np.ones((40, 60, 1), dtype=np.float32)
    for name, pixels in (("p.png", rng.random((40, 60, 3))), ("right.png", right)):
        write_picture(tmp_path / name, Picture(pixels.astype(np.float32), dtype="uint8"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def scene(**tables):
    return Scene({"wfluid": 1, "picture": {"file": "p.png"}, **tables})


def poured(source, duration=0.4):
    """The rate and envelope of a staged source."""
    density = {"name": "ink", "source": [{"center": [30, 20], **source}]}
    return stage(scene(time={"duration": duration}, density=[density])).fluid.densities[0].sources[0]


def test_a_source_pours_its_amount_over_its_window(folder):
    for keys, share in (({}, 1), ({"start": 0.1, "end": 0.3}, 1), ({"at": 0.2}, 1), ({"strength": 3.0}, 3)):
        source = poured({"amount": 2.0, **keys})
        whole = source.rate * source.envelope.integral(0.0, 0.4)
        assert whole == pytest.approx(2.0 * share), keys
    assert poured({"rise": 0.2, "amount": 2.0}).envelope.value(0.05) < 0.2


def test_growth_spares_what_is_frozen(folder):
    grow = {"kind": "grow", "center": [30, 20], "factor": 2.0}
    (free,) = stage(scene(force=[grow])).forces
    assert free.weight is None
    (spared,) = stage(scene(force=[grow], freeze={"mask": "right.png"})).forces
    np.testing.assert_allclose(spared.weight.values[0, [5, 50]], (1, 0), atol=1e-6)
    (masked,) = stage(scene(force=[grow], freeze={"mask": "right.png"}, effect={"mask": "right.png"})).forces
    assert masked.weight.values.max() < 1e-6


def test_noises_without_a_seed_differ(folder):
    noise = {"kind": "noise", "amount": 3}
    forces = stage(scene(seed=4, force=[noise, noise, {**noise, "seed": 9}])).forces
    assert [force.seed for force in forces] == [4, 5, 9]


def test_what_is_smaller_than_a_cell_is_noted(folder):
    notes = []
    stage(scene(force=[PUSH, {**PUSH, "radius": 0.5}], fluid={"cells": 60}), note=notes.append)
    assert len(notes) == 1 and "force.1: its radius of 0.5 px is less than a cell" in notes[0]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"picture": {"file": "p.png", "size": [60, 60]}}, "another aspect"),
        ({"force": [{"kind": ["push"]}]}, "expected one of push, vortex"),
        ({"force": [{**PUSH, "radius": 10**400}]}, "force.0.radius: "),
        ({"force": [{**PUSH, "radius": 1e-40}]}, "force.0: GaussianForce.radius"),
        ({"force": [{"kind": "grow", "center": [3, 3], "factor": 2, "at": 0.1}]}, "force.0.at: no such key"),
        (
            {"force": [{"kind": "stroke", "path": [[0, 1, 1], [1, 9, 9]], "end": 1}]},
            "leave out start and end",
        ),
        (
            {"force": [{"kind": "stroke", "path": [[5, 1, 1], [6, 9, 9]]}]},
            "begins at 5 s, after the animation",
        ),
        ({"density": [{"name": "ink", "amount": 2}]}, "amount belongs to an image"),
        ({"density": [{"name": "ink", "source": [{"amount": 1e39}]}]}, "amount: 1e\\+39"),
        ({"density": [{"name": "ink", "source": [{"period": 1}]}]}, "period: no such key"),
        (
            {"viscosity": {"key": [{"time": 1, "value": 1}, {"time": 1, "value": 2}]}},
            "two keys have one time",
        ),
        ({"output": [{"file": "o.csv", "of": "tracks"}]}, "no points to follow"),
        ({"layer": [{"name": "a\nb", "file": "p.png"}]}, "expected a text on one line"),
        ({"time": {"duration": 1e9}}, "time: .* frames: expected 1"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_key(folder, tables, says):
    with pytest.raises(SceneError, match=says):
        stage(scene(**{"force": [PUSH], **tables}))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("-o", "o.gif", "--report", "s.toml"), "is the scene itself"),
        (("-o", "o.gif", "--report", "r.gif"), "a report is written as .json"),
        (("-o", "o.gif", "--preview", "s.toml"), "is the scene itself"),
    ],
)
def test_a_scene_is_not_written_over(folder, capsys, options, says):
    (folder / "s.toml").write_text(
        'wfluid = 1\nforce = []\n[picture]\nfile = "p.png"\n[[density]]\nname = "a"\n'
    )
    text = (folder / "s.toml").read_text().replace("force = []\n", "")
    (folder / "s.toml").write_text(text)
    before = sorted(path.name for path in folder.iterdir())
    assert main(["render", "s.toml", *options]) == 2
    assert says in capsys.readouterr().err
    assert (folder / "s.toml").read_text() == text
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_scene_is_saved_as_toml_only(folder, capsys):
    flags = ("animate", "p.png", "--push", "30,20:5,0")
    assert main([*flags, "--save-scene", "right.png"]) == 2
    assert "a scene is written as .toml" in capsys.readouterr().err
    assert main([*flags, "--save-scene", "s.toml", "--dry-run", "--quiet"]) == 0
    assert (folder / "s.toml").exists()


def test_a_byte_order_mark_is_no_key(folder):
    from wfluid.scene.toml_file import read_scene

    (folder / "s.toml").write_bytes(b"\xef\xbb\xbfwfluid = 1\n[picture]\nfile = 'p.png'\n")
    assert read_scene("s.toml").tables["wfluid"] == 1


def test_tracks_and_points_go_together(folder, capsys):
    for flags in (("--track", "3,3"), ("--tracks", "t.csv")):
        assert main(["animate", "p.png", "-o", "o.gif", "--push", "30,20:5,0", *flags]) == 2
        assert "go together" in capsys.readouterr().err
