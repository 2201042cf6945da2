"""Each table of a scene is an object, and a field of its class defines everything about a key."""

import argparse
from contextlib import redirect_stdout
from dataclasses import fields
from io import StringIO

import pytest

from wfluid.animation.animation import Animation
from wfluid.cli.flags import add_key_flags
from wfluid.cli.options import given_keys, scene_of_options
from wfluid.cli.parser import build_parser
from wfluid.domain.limits import SCENE_FPS
from wfluid.model.fluid import Fluid
from wfluid.model.painted import Freeze
from wfluid.morphing.settings import MorphSettings
from wfluid.scene.checking import checked, made
from wfluid.scene.forces import PushTable, VortexTable
from wfluid.scene.format import SCENE, FluidTable, FramesTable, FreezeTable
from wfluid.scene.keyframes import MorphTable
from wfluid.scene.reference import reference, tables
from wfluid.scene.scene import Scene
from wfluid.scene.schema import Key, SceneError, SceneTable, SchemaError, key, table_of
from wfluid.scene.toml_file import read_scene, write_scene
from wfluid.scene.types import number, whole

TABLES = {
    "wfluid": 1,
    "picture": {"file": "a.png"},
    "fluid": {"cells": 32},
    "time": {"loop": "pingpong"},
    "force": [
        {"kind": "push", "center": [3, 4], "by": [1, 0], "name": "nose"},
        {"kind": "vortex", "path": [[0, 1, 2], [1, 3, 4]], "turn": 20, "envelope": "beat"},
    ],
    "envelopes": {"beat": {"kind": "constant", "end": 1}},
    "keyframes": {"move": [{"from": [1, 2], "to": [3, 4]}]},
}


def test_the_tables_of_a_scene_are_its_attributes():
    """With what is given, and the defaults of the rest."""
    scene = Scene(TABLES)
    assert (scene.picture.file, scene.picture.size, scene.picture.colorspace) == ("a.png", None, "auto")
    assert (scene.fluid.cells, scene.fluid.scheme, scene.fluid.given) == (32, "standard", {"cells"})
    assert (scene.time.loop, scene.time.fps, scene.time.duration) == ("pingpong", SCENE_FPS, None)
    push, vortex = scene.forces
    assert isinstance(push, PushTable) and isinstance(vortex, VortexTable)
    assert (push.center, push.by, push.name, push.start) == ((3, 4), (1, 0), "nose", 0)
    assert (vortex.path, vortex.envelope) == (((0, 1, 2), (1, 3, 4)), ("beat",))
    assert scene.envelopes["beat"].end == 1
    (move,) = scene.keyframes.moves
    assert (move.start, move.to, move.weight) == ((1, 2), (3, 4), 1)
    assert (scene.morph, scene.freeze, scene.outputs) == (None, None, ())
    assert scene.tables == {
        **TABLES,
        "force": [TABLES["force"][0], {**TABLES["force"][1], "envelope": ["beat"]}],
    }


def test_what_is_given_is_known_from_what_has_its_default():
    assert Scene({**TABLES, "fluid": {"cells": 256}}).fluid.gives("cells")
    assert not Scene({**TABLES, "fluid": {}}).fluid.gives("cells")


def test_a_table_cannot_be_changed_nor_made_of_what_it_does_not_have():
    with pytest.raises(AttributeError, match=r"FluidTable\.cells cannot be set"):
        Scene(TABLES).fluid.cells = 3
    with pytest.raises(TypeError, match="FluidTable: unknown or missing: cell"):
        FluidTable(cell=3)
    with pytest.raises(TypeError, match="PushTable: unknown or missing: by"):
        PushTable(center=(1, 2))


def test_defaults_are_those_of_the_engine():
    """Which are stated once, so that the reference, the flags and the classes agree."""
    usual = {field.name: field.default for field in fields(Animation)}
    assert FluidTable().cells == usual["cells"]
    assert [FramesTable().filter, FramesTable().edge] == [usual["filter"], usual["edge"]]
    fluid = Fluid()
    assert (FluidTable().scheme, FluidTable().pressure_cycles) == (fluid.scheme, fluid.pressure_cycles)
    assert FreezeTable(mask="a").strength == next(f.default for f in fields(Freeze) if f.name == "strength")
    morph = {field.name: field.default for field in fields(MorphSettings)}
    for name in ("warp_curve", "blend_curve", "blend", "delay", "reverse", "pingpong"):
        assert getattr(MorphTable(to="b"), name) == morph[name], name


class Grain(SceneTable):
    """A table that no scene has."""

    size: float = key("how large it is", number(0, 9), unit="px", default=2.5, flag="--grain-size")
    seed: int | None = key("which one", whole(0, 9), otherwise="any", flag="--grain-seed")


def test_a_field_is_check_default_reference_and_flag():
    """An option is one line."""
    grain = table_of(Grain)
    made_of = made(grain, checked(grain, {"seed": 3}))
    assert (made_of.size, made_of.seed) == (2.5, 3)
    with pytest.raises(SchemaError, match="size: 10: expected a number from 0 to 9"):
        checked(grain, {"size": 10})
    with pytest.raises(SchemaError, match="sise: no such key; did you mean size"):
        checked(grain, {"sise": 1})
    ((heading, meaning, found),) = tables(grain, "grain")
    assert (heading, meaning, list(found.keys)) == ("[grain]", "A table that no scene has", ["size", "seed"])
    parser = argparse.ArgumentParser()
    add_key_flags(parser, "grain", grain.meaning, grain.keys)
    said = " ".join(parser.format_help().split())
    assert "--grain-size GRAIN_SIZE how large it is [px] (2.5)" in said
    assert "which one (any)" in said
    assert given_keys(parser.parse_args(["--grain-size", "3"]), grain) == {"size": 3.0}
    assert given_keys(parser.parse_args([]), grain) == {}


class StickyFluid(FluidTable):
    """The fluid with one more key."""

    stickiness: float = key("stickiness of walls", number(0, 9), unit="1/s", default=2.5, flag="--stickiness")


def test_one_more_line_in_a_table_is_a_new_option_everywhere(monkeypatch, tmp_path):
    """In the flags, the reference, the reader with its errors, --set, saved scenes and the object."""
    monkeypatch.setitem(SCENE.keys, "fluid", table_of(StickyFluid))
    parser = build_parser("animate")
    with pytest.raises(SystemExit), redirect_stdout(StringIO()) as out:
        parser.parse_args(["animate", "--help"])
    assert "stickiness of walls [1/s] (2.5)" in " ".join(out.getvalue().split())
    row = "| `stickiness` | stickiness of walls [1/s] | a number from 0 to 9 | 2.5 |"
    assert row in reference().splitlines()

    flags = ["animate", "a.png", "--push", "3,4:1,0", "-o", "a.gif", "--stickiness"]
    assert scene_of_options(parser.parse_args([*flags, "3"])).fluid.stickiness == 3
    with pytest.raises(SceneError, match=r"--stickiness 10\.0: expected a number from 0 to 9"):
        scene_of_options(parser.parse_args([*flags, "10"]))

    path = tmp_path / "a.toml"
    path.write_text('wfluid = 1\n[picture]\nfile = "a.png"\n[fluid]\nstickiness = 4\n')
    scene = read_scene(path)
    assert isinstance(scene.fluid, StickyFluid) and scene.fluid.stickiness == 4
    assert scene.with_values(["fluid.stickiness=5"]).fluid.stickiness == 5
    assert scene.with_values(["fluid={}"]).fluid.stickiness == 2.5
    write_scene(tmp_path / "b.toml", scene)
    assert read_scene(tmp_path / "b.toml").fluid.stickiness == 4
    path.write_text(path.read_text().replace("stickiness", "stickyness"))
    with pytest.raises(SceneError, match=r"a\.toml:5: fluid\.stickyness: .* did you mean stickiness\?"):
        read_scene(path)


@pytest.mark.parametrize("verb", ["animate", "keyframes", "morph"])
def test_the_help_of_a_flag_has_its_keys_meaning_and_default(verb):
    (verbs,) = [action for action in build_parser()._actions if action.dest == "verb"]
    actions = {flag: action for action in verbs.choices[verb]._actions for flag in action.option_strings}
    seen = 0
    for _, _, table in tables():
        for one in table.keys.values():
            if isinstance(one, Key) and one.flag in actions:
                said = actions[one.flag].help
                assert said.startswith(one.meaning), one.flag
                assert one.kind.read is bool or one.shown_default in said, one.flag
                seen += 1
    assert seen > 20


def test_a_morph_has_no_flags_that_it_has_no_use_for():
    """Nor values of them among its options."""
    options = build_parser().parse_args(["morph", "a.png", "b.png", "--move", "1,2:3,4"])
    forces = {"push", "vortex", "grow", "stroke", "wind", "noise", "force_image", "ink", "smoke"}
    others = {"layer", "track", "tracks", "effect_mask", "time", "loop", "substeps"}
    assert not (forces | others) & vars(options).keys()
    reasons = [reason for _, _, table in tables() for reason in table.not_in_morph.values()]
    assert set(SCENE.not_in_morph) == {"effect", "force", "group", "density", "layer", "tracks"}
    assert len(reasons) == 10 and all(reason.startswith("not allowed in a morph: ") for reason in reasons)
