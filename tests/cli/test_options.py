"""What a command line draws is a scene: short forms are tables, and flags are keys."""

import pytest
from scenes import write_pictures

import wfluid.scene.scene
from wfluid.cli.main import main
from wfluid.cli.options import scene_of_options
from wfluid.cli.parser import build_parser
from wfluid.scene.forces import FORCES
from wfluid.scene.short_forms import parse_density, parse_force

SHORT = {
    "push": ("30,20:5,-2.5", {"center": [30.0, 20.0], "by": [5.0, -2.5]}),
    "vortex": ("30,20.5:-90", {"center": [30.0, 20.5], "turn": -90.0}),
    "grow": ("1e1,20:0.5", {"center": [10.0, 20.0], "factor": 0.5}),
    "stroke": ("1,2/3,4/5.5,6", {"points": [[1.0, 2.0], [3.0, 4.0], [5.5, 6.0]]}),
    "wind": ("-3,0", {"by": [-3.0, 0.0]}),
    "noise": ("4.5", {"amount": 4.5}),
    "image": ("a, b=c.png", {"file": "a, b=c.png"}),
}
"""By kind: a text, and the table that it means."""

SHORT_PUSH = {"kind": "push", "center": [30.0, 20.0], "by": [5.0, 0.0]}

UNWRITTEN = {"path", "points", "envelope", "name", "group"}
"""Keys that only a scene file can say."""

OPTIONS = {
    "a number": ("0.75", 0.75),
    "a whole number": ("7", 7),
    "a text": ("left.png", "left.png"),
    "gradient or contour": ("contour", "contour"),
}
"""By how a key's type begins: an option's value as it is written, and as it is meant."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with pictures, made the current one."""
    write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", SHORT)
def test_a_short_form_is_the_table_it_means(kind):
    text, table = SHORT[kind]
    found = parse_force(kind, text)
    assert found == {"kind": kind, **table} and next(iter(found)) == "kind"
    assert set(SHORT) == set(FORCES.tables) - {"buoyancy"}


@pytest.mark.parametrize(("kind", "key"), [(kind, key) for kind in SHORT for key in FORCES.tables[kind].keys])
def test_an_option_of_a_short_form_is_the_key_of_its_name(kind, key):
    """But for what has no short form, or was said before."""
    text, table = SHORT[kind]
    if key in UNWRITTEN | set(table):
        with pytest.raises(ValueError, match=f"'{key}=1' is not key=value with a key of "):
            parse_force(kind, f"{text}:{key}=1")
        return
    written, meant = next(
        OPTIONS[type_] for type_ in OPTIONS if FORCES.tables[kind].keys[key].type.startswith(type_)
    )
    found = parse_force(kind, f"{text}:{key}={written}")
    assert found == {"kind": kind, **table, key: meant} and type(found[key]) is type(meant)


def test_options_are_taken_together_with_spaces_around():
    found = parse_force("push", "30, 20: 5,0: radius = 8 ,period=0.5,phase=0")
    assert found == {**SHORT_PUSH, "radius": 8.0, "period": 0.5, "phase": 0.0}


def test_a_file_of_an_image_force_may_have_colons():
    """What follows the last colon is options where it has an equals sign."""
    assert parse_force("image", "C:/a.png")["file"] == "C:/a.png"
    found = parse_force("image", "C:/a.png:along=contour,amount=3")
    assert found == {"kind": "image", "file": "C:/a.png", "along": "contour", "amount": 3.0}


@pytest.mark.parametrize("look", ["ink", "smoke"])
def test_a_poured_density_is_a_density_with_a_source_and_a_lift(look):
    source = {"center": [30.0, 20.0], "radius": 8.0, "amount": 2.0, "start": 0.5, "end": 1.0, "rise": 0.1}
    text = "30,20:#AAbb00:radius=8,amount=2,diffusion=0.01,lift=40,start=0.5,end=1,rise=0.1"
    density, buoyancy = parse_density(look, text, "one")
    named = {"name": "one", "color": "#AAbb00", "look": look}
    assert density == {**named, "diffusion": 0.01, "source": [source]}
    assert buoyancy == {"kind": "buoyancy", "density": "one", "by": [0.0, -40.0]}
    plain, nothing = parse_density(look, "3,4:#AAbb00", "one")
    assert plain == {**named, "source": [{"center": [3.0, 4.0]}]} and nothing is None


@pytest.mark.parametrize(
    ("kind", "text", "says"),
    [
        ("push", "", "expected X,Y:DX,DY or X,Y:DX,DY:key=value,…"),
        ("push", "30,20", "expected X,Y:DX,DY or"),
        ("push", "30,20:5,0:radius=8:start=1", "expected X,Y:DX,DY or"),
        ("push", "30:5,0", "the point X,Y is '30': expected two numbers"),
        ("push", "30,20:5", "the arrow DX,DY is '5': expected two numbers"),
        ("push", "30,20:5,0,1", "the arrow DX,DY is '5,0,1': expected two numbers"),
        ("push", "30,up:5,0", "the point X,Y: 'up' is not a number"),
        ("push", "30,nan:5,0", "the point X,Y: nan is not finite"),
        ("push", "30,20:5,1e999", "the arrow DX,DY: 1e999 is not finite"),
        ("push", "30,20:5,0:", "'' is not key=value with a key of radius, start, end"),
        ("push", "30,20:5,0:radius", "'radius' is not key=value"),
        ("push", "30,20:5,0:raduis=3", "'raduis=3' is not key=value with a key of radius"),
        ("push", "30,20:5,0:radius=3,radius=4", "radius is given twice"),
        ("push", "30,20:5,0:radius=wide", "radius: 'wide' is not a number"),
        ("push", "30,20:5,0:radius=0", "radius: 0.0: expected a number above 0"),
        ("push", "30,20:5,0:start=-1", "start: -1.0: expected a number from 0"),
        ("push", "30,20:5,0:period=0", "period: 0.0: expected a number from 0.001"),
        ("push", "30,20:5,0:name=nose", "'name=nose' is not key=value"),
        ("vortex", "30,20:left", "turn: 'left' is not a number"),
        ("vortex", "30,20:5,0", "turn: '5,0' is not a number"),
        ("grow", "30,20:0", "factor: 0.0: expected a number from 0.05 to 20"),
        ("stroke", "30,20", "points: [[30.0, 20.0]]: expected two points or more"),
        ("stroke", "30,20/4", "a point X,Y is '4': expected two numbers"),
        ("stroke", "30,20/40,20:at=1", "'at=1' is not key=value with a key of radius, start, end"),
        ("wind", "3", "the arrow DX,DY is '3': expected two numbers"),
        ("noise", "lots", "amount: 'lots' is not a number"),
        ("noise", "3:seed=-1", "seed: -1.0: expected a whole number from 0 to 4294967295"),
        ("noise", "3:seed=1.5", "seed: 1.5: expected a whole number"),
        ("image", "", "file: '': expected a text"),
        ("image", "a.png:along=up", "along: 'up': expected one of gradient, contour, vectors"),
        ("image", "a.png:speed=3", "'speed=3' is not key=value with a key of along, amount, radius"),
    ],
)
def test_a_wrong_short_form_is_refused_by_its_part(kind, text, says):
    """The message begins with what was written."""
    with pytest.raises(ValueError) as error:
        parse_force(kind, text)
    assert str(error.value).startswith(f"{kind} {text!r}: ") and says in str(error.value), str(error.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("30,20", "ink '30,20': expected X,Y:#RRGGBB or"),
        ("30:#aabbcc", "the point X,Y is '30': expected two numbers"),
        ("30,20:#aabbcc:phase", "'phase' is not key=value with a key of radius, amount, start"),
        ("30,20:#aabbcc:rate=3", "'rate=3' is not key=value"),
        ("30,20:#aabbcc:lift=high", "lift: 'high' is not a number"),
        ("30,20:aabbcc", "--ink 30,20:aabbcc: color: 'aabbcc': expected a colour such as"),
        ("30,20:#aabbcc:radius=0", "--ink 30,20:#aabbcc:radius=0: source.0.radius: 0.0: expected a number"),
        ("30,20:#aabbcc:diffusion=-1", "diffusion: -1.0: expected a number from 0"),
        ("61,20:#aabbcc", "at 61,20: outside the picture of 60 x 40 pixels"),
        ("30,20:#aabbcc:at=3", "at=3: the animation lasts 2 s"),
    ],
)
def test_a_wrong_pour_is_refused_by_its_part(folder, capsys, text, says):
    assert main(["animate", "small.png", "--ink", text, "-o", "a.gif"]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1 and not (folder / "a.gif").exists()


# Flags


FLAGS = {
    "--push": ("30,20:5,0", {"force": [SHORT_PUSH]}),
    "--vortex": (SHORT["vortex"][0], {"force": [{"kind": "vortex", **SHORT["vortex"][1]}]}),
    "--grow": (SHORT["grow"][0], {"force": [{"kind": "grow", **SHORT["grow"][1]}]}),
    "--stroke": (SHORT["stroke"][0], {"force": [{"kind": "stroke", **SHORT["stroke"][1]}]}),
    "--wind": ("3,-1", {"force": [{"kind": "wind", "by": [3.0, -1.0]}]}),
    "--noise": ("4.5", {"force": [{"kind": "noise", "amount": 4.5}]}),
    "--force-image": (
        "self:along=contour",
        {"force": [{"kind": "image", "file": "self", "along": "contour"}]},
    ),
    "--ink": (
        "3,4:#FF0000",
        {
            "density": [
                {"name": "ink 1", "color": "#ff0000", "look": "ink", "source": [{"center": [3.0, 4.0]}]}
            ]
        },
    ),
    "--smoke": (
        "3,4:#ff0000:lift=9",
        {
            "density": [
                {"name": "smoke 1", "color": "#ff0000", "look": "smoke", "source": [{"center": [3.0, 4.0]}]}
            ],
            "force": [{"kind": "buoyancy", "density": "smoke 1", "by": [0.0, -9.0]}],
        },
    ),
    "--viscosity": ("0.5", {"viscosity": {"value": 0.5}}),
    "--viscosity-image": ("a.png", {"viscosity": {"image": "a.png"}}),
    "--viscosity-floor": ("0.1 --viscosity-image self", {"viscosity": {"image": "self", "floor": 0.1}}),
    "--invert-viscosity": ("--viscosity-image self", {"viscosity": {"image": "self", "invert": True}}),
    "--viscosity-moves": ("--viscosity-image self", {"viscosity": {"image": "self", "moves": True}}),
    "--freeze": ("a.png:50", {"freeze": {"mask": "a.png", "strength": 50.0}}),
    "--effect-mask": ("a.png", {"effect": {"mask": "a.png"}}),
    "--track": (
        "1,2 --track 3,4 --tracks a.csv",
        {"tracks": {"points": [[1.0, 2.0], [3.0, 4.0]]}, "output": [{"file": "a.csv", "of": "tracks"}]},
    ),
    "--layer": ("b/a.png", {"layer": [{"name": "a", "file": "b/a.png"}]}),
    "--cells": ("32", {"fluid": {"cells": 32}}),
    "--walls": ("periodic,no-slip", {"fluid": {"walls": "periodic,no-slip"}}),
    "--scheme": ("paper", {"fluid": {"scheme": "paper"}}),
    "--solver": ("jacobi", {"fluid": {"solver": "jacobi"}}),
    "--creeping": ("", {"fluid": {"creeping": True}}),
    "--no-creeping": ("", {"fluid": {"creeping": False}}),
    "--pressure-cycles": ("4", {"fluid": {"pressure_cycles": 4}}),
    "--diffusion-tolerance": ("1e-3", {"fluid": {"diffusion_tolerance": 1e-3}}),
    "--diffusion-loss": ("0.5", {"fluid": {"diffusion_loss": 0.5}}),
    "--fps": ("12.5", {"time": {"fps": 12.5}}),
    "--duration": ("3", {"time": {"duration": 3.0}}),
    "--substeps": ("5", {"time": {"substeps": 5}}),
    "--loop": ("pingpong", {"time": {"loop": "pingpong"}}),
    "--seed": ("7", {"seed": 7}),
    "--width": ("30", {"frames": {"width": 30}}),
    "--scale": ("0.5", {"frames": {"scale": 0.5}}),
    "--filter": ("lanczos", {"frames": {"filter": "lanczos"}}),
    "--edge": ("mirror", {"frames": {"edge": "mirror"}}),
    "--allow-folds": ("", {"frames": {"allow_folds": True}}),
    "--background": ("#3060c0", {"frames": {"background": "#3060c0"}}),
    "--colorspace": ("linear", {"picture": {"file": "p.png", "colorspace": "linear"}}),
    "--start": ("7 -o a.gif", {"output": [{"file": "a.gif", "start": 7}]}),
    "--type": ("half -o a.gif", {"output": [{"file": "a.gif", "type": "half"}]}),
    "--compression": ("zip -o a.gif", {"output": [{"file": "a.gif", "compression": "zip"}]}),
    "--quality": ("50 -o a.gif", {"output": [{"file": "a.gif", "quality": 50}]}),
    "--output": ("a.gif -o b.gif", {"output": [{"file": "a.gif"}, {"file": "b.gif"}]}),
    "--report": ("a.json", {"output": [{"file": "a.json", "of": "report"}]}),
    "--tracks": (
        "a.csv --track 1,2",
        {"tracks": {"points": [[1.0, 2.0]]}, "output": [{"file": "a.csv", "of": "tracks"}]},
    ),
}
"""By flag: what follows it, and the tables that it makes."""

OF_A_RUN = {"--help", "--save-scene", "--preview", "--dry-run", "--device", "--quiet", "--verbose"}
"""Flags that no scene has."""


def flags_of(verb):
    """The long flags of a verb."""
    verbs = next(action for action in build_parser()._actions if action.choices)
    return {flag for flag in verbs.choices[verb]._option_string_actions if flag.startswith("--")}


def tables_of(*options):
    """What a command line says."""
    return scene_of_options(build_parser().parse_args(["animate", "p.png", *options])).tables


def test_every_flag_has_its_case():
    assert set(FLAGS) | OF_A_RUN == flags_of("animate")


@pytest.mark.parametrize("flag", FLAGS)
def test_a_flag_is_the_key_it_means(flag):
    """And nothing else is said."""
    text, tables = FLAGS[flag]
    assert tables_of(flag, *text.split()) == {"wfluid": 1, "picture": {"file": "p.png"}, **tables}


@pytest.mark.parametrize(("flag", "value"), [("--wind", "-3,0"), ("--noise", "-3"), ("--wind", "-3,0:at=1")])
def test_a_value_may_begin_with_a_minus(flag, value):
    """A wind may blow to the left."""
    assert tables_of(flag, value) == tables_of(f"{flag}={value}")


def test_flags_are_said_together_in_the_order_of_their_kinds():
    tables = tables_of(
        "--noise", "3", "--push", "30,20:5,0", "--ink", "3,4:#000000:lift=1", "--push", "1,2:3,4"
    )
    assert [force["kind"] for force in tables["force"]] == ["push", "push", "noise", "buoyancy"]
    assert [force["center"] for force in tables["force"][:2]] == [[30.0, 20.0], [1.0, 2.0]]
    pours = ("--ink", "1,2:#000000", "--smoke", "1,2:#000000", "--ink", "1,2:#000000")
    assert [density["name"] for density in tables_of(*pours)["density"]] == ["ink 1", "ink 2", "smoke 3"]


@pytest.mark.parametrize(
    ("out", "beside"),
    [
        ("o/a.####.png", "o/a_b.####.png"),
        ("a_%04d.exr", "a_b_%04d.exr"),
        ("a.gif", "a_b.gif"),
        ("####.png", "_b####.png"),
    ],
)
def test_outputs_of_layers_lie_beside_the_pictures(out, beside):
    """With the layer's name before number and ending, and the stills written alike."""
    outputs = tables_of("-o", out, "--layer", "c/b.png", "--type", "half", "--start", "3")["output"]
    stills = {"start": 3, "type": "half"}
    assert outputs == [{"file": out, **stills}, {"file": beside, "of": "b", **stills}]


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("a.png", {"mask": "a.png"}),
        ("a.png:3", {"mask": "a.png", "strength": 3.0}),
        ("C:/a.png", {"mask": "C:/a.png"}),
        ("C:/a.png:1e3", {"mask": "C:/a.png", "strength": 1000.0}),
    ],
)
def test_a_mask_to_freeze_may_have_a_strength_and_colons(text, table):
    assert tables_of("--freeze", text)["freeze"] == table


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--save-scene", "none/x.toml"), "none: no such folder"),
        (("--save-scene", "small.png"), "small.png is the picture itself"),
        (("--save-scene", "a.gif", "-o", "a.gif"), "is the output of 'picture'"),
        (("--save-scene", "x.toml", "--width", "0"), "--width 0: expected a whole number from 1"),
        (("--tracks", "a.csv", "-o", "a.gif"), "--track"),
        (("--track", "1,2", "-o", "a.gif"), "--track X,Y and --tracks FILE.csv go together"),
        (("--layer", "right.png", "--layer", "b/right.png", "-o", "a.gif"), "'right'"),
        (("--push", "30,20:5,0:group=nose", "-o", "a.gif"), "'group=nose' is not key=value"),
    ],
)
def test_what_makes_no_scene_writes_nothing(folder, capsys, options, says):
    before = {path: path.read_bytes() for path in folder.iterdir()}
    assert main(["animate", "small.png", "--push", "30,20:5,0", "--duration", "0.2", *options]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("command", ["animate", "render"])
def test_a_scene_is_checked_once(folder, monkeypatch, command):
    """Where it is made, be it of flags or of a file."""
    checks, check = [], wfluid.scene.scene.checked

    def counted(*arguments):
        checks.append(arguments)
        return check(*arguments)

    monkeypatch.setattr("wfluid.scene.scene.checked", counted)
    monkeypatch.setattr("wfluid.scene.short_forms.checked", counted)
    (folder / "a.toml").write_text(
        'wfluid = 1\n[picture]\nfile = "small.png"\n[[force]]\nkind = "push"\ncenter = [3, 4]\nby = [1, 0]\n'
    )
    words = ["animate", "small.png", "--push", "30,20:5,0"] if command == "animate" else ["render", "a.toml"]
    assert main([*words, "--dry-run"]) == 0
    assert len(checks) == 1
