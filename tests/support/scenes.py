"""Random valid scenes for tests, and pictures for their files."""

import datetime
import math

import numpy as np
from hypothesis import strategies as st

from wfluid.cli.main import main
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import write_picture
from wfluid.scene.format import SCENE
from wfluid.scene.names import SHOWN
from wfluid.scene.reference import tables
from wfluid.scene.schema import ArrayOf, Key, MapOf, Table, Union

VALUES = (
    *(0, 1, 2, 30, 1001, 2**32 - 1, -1, 0.25, 1 / 3, 7.5, -2.5, 1e-5, 1.5e300, True, False),
    *("a.png", "sub/b.exr", "../c d.png", "/abs/d.png", "o.####.png", "self", "#1A2b3c"),
    *('"quoted" \\ [x] = {y} # z', "Größe ∂ 長さ", "two\nlines\tand a tab", "'", " spaces ", "a.b.c"),
    *([1, 2.5], [640, 480], [[1, 2], [3.5, 4]], [[0, 1, 2], [1.5, 3, 4]], [0.0, 0.5, 1e-3], ["one", "a.b"]),
)
"""Values that some key accepts."""

WRONG = (
    *(math.nan, math.inf, -1e9, 2.5, 2**33, "", "  ", "no such word", True, datetime.date(1979, 5, 27)),
    *([], {}, [1], [1, "2"], [1, math.nan], [[1, 2, 3, 4]], [True, False], ["a", 1], {"a": 1}, [{}]),
)
"""Values that some key refuses, according to its check."""

KEYS = [
    (heading, name)
    for heading, _, table in tables()
    for name, key in table.keys.items()
    if isinstance(key, Key)
]
"""All keys of a scene, each with the heading of its table."""


def taken(key):
    """Accepted values of a key, as stored."""
    return [key.check(value) for value in (*VALUES, *key.type.split(" or ")) if takes(key, value)]


def takes(key, value):
    """Whether a key accepts a value."""
    try:
        key.check(value)
    except ValueError:
        return False
    return True


def valid(what):
    """A strategy of valid values of a part of the schema; names refer to one another by chance only."""
    if isinstance(what, Key):
        found = st.sampled_from(taken(what))
        if what.type == "a text" and not what.file:
            return found | st.text(min_size=1).filter(lambda text: takes(what, text))
        return found | st.floats(0.1, 0.9) if takes(what, 0.1) and takes(what, 0.9) else found
    if isinstance(what, ArrayOf):
        return st.lists(valid(what.each), max_size=2)
    if isinstance(what, MapOf):
        return st.dictionaries(st.text(min_size=1), valid(what.each), max_size=2)
    if isinstance(what, Union):
        return st.one_of(valid_variant(what, kind) for kind in what.tables)
    must = {name for name, key in what.keys.items() if isinstance(key, Key) and key.required}
    return st.fixed_dictionaries(
        {name: valid(what.keys[name]) for name in sorted(must)},
        optional={name: valid(key) for name, key in what.keys.items() if name not in must},
    )


def valid_variant(what, kind):
    """A strategy of tables of one kind."""
    return valid(what.tables[kind]).map(lambda table: {"kind": kind, **table})


SCENES = valid(SCENE)


@st.composite
def scenes(draw):
    """A strategy of tables of valid scenes, with consistent names."""
    found = draw(SCENES)
    found.setdefault("picture", {"file": "a.png"})
    found = of_morph(found) if "morph" in found else found
    found = {name: found[name] for name in draw(st.permutations(sorted(found)))}
    return named(found, lambda names: draw(st.sampled_from(names)))


def of_morph(scene):
    """The tables that apply to a morph, with a point of both pictures."""
    found = less(scene, "force", "group", "density", "layer", "tracks", "effect")
    keyframes = less(found.get("keyframes", {}), "time")
    moves = keyframes.get("move") or [{"from": [1, 2], "to": [3, 4]}]
    found["keyframes"] = {**keyframes, "move": [less(move, "time") for move in moves]}
    if "time" in found:
        found["time"] = less(found["time"], "substeps", "loop")
    return found


def less(table, *names):
    """A table without some of its keys."""
    return {name: value for name, value in table.items() if name not in names}


def named(scene, choose):
    """The tables with unique names and valid references."""
    if any(force["kind"] == "buoyancy" for force in scene.get("force", [])) and not scene.get("density"):
        scene["density"] = [{"name": "ink"}]
    for kind in ("force", "group", "layer", "density"):
        for n, table in enumerate(scene.get(kind, [])):
            if "name" in table:
                table["name"] = f"{table['name']} {kind} {n}"
    groups, layers, densities = (
        [table["name"] for table in scene.get(kind, [])] for kind in ("group", "layer", "density")
    )
    users = [*scene.get("force", []), *scene.get("group", [])]
    users += [source for density in scene.get("density", []) for source in density.get("source", [])]
    envelopes = [[name] for name in scene.get("envelopes", {})]
    shown = [name for name in SHOWN if name != "tracks" or "morph" not in scene]
    for tables_, key, known in (
        (users, "envelope", envelopes),
        (scene.get("force", []), "group", groups),
        (scene.get("force", []), "density", densities),
        (scene.get("output", []), "of", [*shown, *layers, *densities]),
    ):
        for table in tables_:
            if key in table and known:
                table[key] = choose(known)
            else:
                table.pop(key, None)
    if any(output.get("of") == "tracks" for output in scene.get("output", [])):
        scene["tracks"] = {"points": [[1, 2]]}
    return scene


def full(what=SCENE):
    """Tables with all keys, one table of each kind, each key with its first valid value."""
    if isinstance(what, Key):
        return taken(what)[0]
    if isinstance(what, Table):
        return {name: full(key) for name, key in what.keys.items()}
    each = what.each if isinstance(what, ArrayOf | MapOf) else what
    kinds = each.tables if isinstance(each, Union) else {None: each}
    found = [{"kind": kind, **full(table)} if kind else full(table) for kind, table in kinds.items()]
    return {table["kind"]: table for table in found} if isinstance(what, MapOf) else found


def changed(value, path, change):
    """A copy in which the part at a path is replaced by a changed copy."""
    if not path:
        copy = dict(value) if isinstance(value, dict) else value
        return change(copy)
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[path[0]] = changed(value[path[0]], path[1:], change)
    return copy


def write_pictures(folder):
    """small.png and other.png, 60 x 40 in colours; right.png and left.png, white on that side."""
    rng = np.random.default_rng(0)
    right = np.ones((40, 1, 1), dtype=np.float32) * (np.arange(60) >= 30)[None, :, None]
    for name, pixels, dtype in (
        ("small.png", rng.random((40, 60, 3)).astype(np.float32), "uint8"),
        ("other.png", rng.random((40, 60, 3)).astype(np.float32), "uint8"),
        ("right.png", right, "uint8"),
        ("left.png", 1 - right, "uint8"),
    ):
        write_picture(folder / name, Picture(pixels.astype(np.float32), dtype=dtype))


SHOT = """\
# A shot for tests

wfluid = 1

[picture]
file = "small.png"
size = [60, 40]

[time]
duration = 0.2
fps = 10

[fluid]
cells = 16

[envelopes.swell]
kind = "fade"
rise = 0.1

[[group]]
name = "nose"

[[force]]
kind = "push"
center = [30, 20]
by = [5, 0]
group = "nose"
envelope = "swell"

[[force]]
kind = "vortex"
name = "eye"
center = [10, 10]
turn = 20

[[density]]
name = "ink"

[[density.source]]
center = [20, 20]

[[layer]]
name = "matte"
file = "right.png"

[[output]]
file = "o.####.png"

[[output]]
file = "m.####.png"
of = "matte"
"""
"""A scene of a push in a group and under an envelope, a vortex, ink and a layer."""


def write_shot(folder):
    """Make the folder, with pictures and shot.toml in it."""
    folder.mkdir()
    write_pictures(folder)
    (folder / "shot.toml").write_text(SHOT)
    return folder


def render(*options):
    """The exit code of a render."""
    try:
        return main(["render", *map(str, options)])
    except SystemExit as stopped:
        return stopped.code
