"""The schema of scenes: what it allows is kept and written, what it does not is refused by its key."""

import math
import re
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scenes import KEYS, VALUES, WRONG, changed, full, less, named, of_morph, scenes, takes

from wfluid.domain.limits import CURVES
from wfluid.scene.checking import checked, keys_of, parts
from wfluid.scene.format import SCENE
from wfluid.scene.reference import reference, tables
from wfluid.scene.scene import Scene
from wfluid.scene.schema import ArrayOf, Key, MapOf, SceneError, SchemaError, Table, Union
from wfluid.scene.toml_file import read_scene, write_scene

EVERYTHING = named(less(full(), "morph"), lambda names: names[-1])
"""A scene with every key of every table, and a table of every kind, but for a morph's."""

MORPH = named(of_morph(full()), lambda names: names[-1])
"""A scene with every key that goes with a morph."""

ANY = settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.too_slow])


def refused(scene):
    """The error that a scene's tables are refused with."""
    with pytest.raises(SchemaError) as error:
        checked(SCENE, scene)
    return error.value


def test_the_scene_with_everything_has_every_key():
    """What the other tests walk over leaves nothing out."""
    headings = {id(table): heading for heading, _, table in tables()}
    found = set()
    for _, what, value in [*parts(SCENE, EVERYTHING), *parts(SCENE, MORPH)]:
        table = what.tables[value["kind"]] if isinstance(what, Union) else what
        if isinstance(table, Table):
            names = [name for name in value if isinstance(table.keys.get(name), Key)]
            found |= {(headings[id(table)], name) for name in names}
    assert found == set(KEYS) and len(found) > 180


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_what_the_schema_allows_is_kept_as_it_is(scene):
    assert checked(SCENE, scene) == scene
    assert Scene(scene).tables == scene


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_a_scene_that_is_written_reads_back_the_same(scene):
    """Its values and their types, its names, and the files that it means."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.toml"
        write_scene(path, Scene(scene, path.parent))
        back = read_scene(path)
        assert back.tables == scene and repr(back.tables) == repr(scene_in_order(scene, back.tables))
        assert [file.name for file in path.parent.iterdir()] == ["a.toml"]


def scene_in_order(value, like):
    """The tables, with keys in the order of others: TOML puts values before tables."""
    if isinstance(value, dict):
        return {name: scene_in_order(value[name], like[name]) for name in like}
    if isinstance(value, list):
        return [scene_in_order(item, other) for item, other in zip(value, like, strict=True)]
    return value


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_a_scene_written_to_another_folder_means_the_same_files(scene):
    """Only names of files change: they lead from where the scene is now to where they led before."""
    with tempfile.TemporaryDirectory() as folder:
        home, away = Path(folder) / "home", Path(folder) / "far" / "away"
        home.mkdir(), away.mkdir(parents=True)
        before = Scene(scene, home)
        write_scene(away / "a.toml", before)
        after = read_scene(away / "a.toml")
        assert sorted(resolved(after.files())) == sorted(resolved(before.files()))
        assert written(after) == written(before)
        assert after.tables_in(home) == scene


def resolved(paths):
    return [path.resolve() for path in paths]


def written(scene):
    return resolved(scene.folder / table["file"] for table in scene.tables.get("output", []))


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_a_required_key_that_is_missing_is_named(scene):
    """With what it is for, and the path of its table."""
    for path, what, value in parts(SCENE, scene):
        for name, key in keys_of(what, value).items() if isinstance(what, Table | Union) else ():
            if isinstance(key, Key) and key.required:
                error = refused(changed(scene, path, lambda table, name=name: less(table, name)))
                assert (error.path, error.reason) == (path, f"{name} is missing: {key.meaning}")


@ANY
@given(scenes(), st.sampled_from(["no_such_key", "Start", "fiel", "kinds", "é", ""]))
@example(EVERYTHING, "xyzzy")
@example(MORPH, "xyzzy")
def test_a_key_that_does_not_exist_is_named(scene, name):
    for path, what, _ in parts(SCENE, scene):
        if isinstance(what, Table | Union):
            error = refused(changed(scene, path, lambda table: {name: 1, **table}))
            assert error.path == (*path, name) and error.reason.startswith("no such key")


@ANY
@given(scenes(), st.integers(0, len(WRONG)))
@example(EVERYTHING, 0)
@example(MORPH, 0)
def test_a_value_of_a_wrong_type_or_range_is_named(scene, turn):
    """The message has the value and what was expected."""
    for n, (path, key, _) in enumerate(parts(SCENE, scene)):
        if isinstance(key, Key):
            wrong = [value for value in WRONG if not takes(key, value)]
            value = wrong[(turn + n) % len(wrong)]
            error = refused(changed(scene, path, lambda _, value=value: value))
            assert error.path == path and error.about_value
            assert error.reason.startswith(f"{value!r}: ") and re.search("expected|newer", error.reason)


ROWS = {"[x, y]": 2, "[width, height]": 2, "[seconds, x, y]": 3, "[[x, y], …]": 2}
"""Numbers a row, by the end of what a type says."""


def fits(kind, value):
    """Whether a value is what a type's words say, read apart from the check."""
    if kind == "true or false":
        return isinstance(value, bool)
    if kind == "a text":
        return isinstance(value, str) and value.strip() != "" and value.isprintable()
    if kind == "a name or a list of names":
        items = value if isinstance(value, list) else [value]
        return items != [] and all(isinstance(item, str) and item for item in items)
    if kind == "a word or keys":
        return value in CURVES or (
            isinstance(value, list) and value != [] and all(of_count(r, 2) for r in value)
        )
    if kind.startswith("a colour"):
        return isinstance(value, str) and re.fullmatch("#[0-9a-fA-F]{6}", value) is not None
    if of_numbers := re.fullmatch("a (whole )?number(?: from (.*?))?(?: above (.*?))?(?: to (.*?))?", kind):
        whole, least, above, most = of_numbers.groups()
        right = type(value) is int or (type(value) is float and not whole and math.isfinite(value))
        right = right and (least is None or value >= float(least)) and (most is None or value <= float(most))
        return right and (above is None or value > float(above)) and (kind != VERSION or value > 0)
    for end, count in ROWS.items():
        if kind.endswith(end):
            if kind.startswith("two numbers, "):
                return of_count(value, count)
            least = 1 if kind.startswith("a list") else 2
            return isinstance(value, list) and len(value) >= least and all(of_count(r, count) for r in value)
    if kind == "two numbers or more":
        return isinstance(value, list) and len(value) > 1 and of_count(value, len(value))
    return value in kind.split(" or ")


def of_count(row, count):
    return isinstance(row, list) and len(row) == count and all(fits("a number", item) for item in row)


VERSION = "a whole number to 1"


@pytest.mark.parametrize(("heading", "name"), KEYS)
def test_a_key_takes_what_its_type_says_and_nothing_else(heading, name):
    """Up to both ends of its range; a number is no text and no flag, a list no number."""
    key = next(table for other, _, table in tables() if other == heading).keys[name]
    ends = [float(end) for end in re.findall(r"(?:from|above|to) (\S+)", key.type) if end[-1].isdigit()]
    near = [step(int(end)) for end in ends for step in (lambda n: n, lambda n: n - 1, lambda n: n + 1)]
    near += [end * part for end in ends for part in (1 - 1e-6, 1.0, 1 + 1e-6)]
    for value in (*VALUES, *WRONG, *near, *key.type.split(" or "), [[1, 2]], [[0, 1, 2]], [0.5], "#12345g"):
        assert takes(key, value) == fits(key.type, value), value


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_a_table_that_is_none_is_named(scene):
    """A value where a table belongs, one table where a list belongs, a list where one table belongs."""
    for path, what, _ in parts(SCENE, scene):
        if path and not isinstance(what, Key):
            for wrong in (3, "text", {"a": 1} if isinstance(what, ArrayOf) else [{}]):
                error = refused(changed(scene, path, lambda _, wrong=wrong: wrong))
                assert error.path == path
                assert (
                    "expected a list of tables" if isinstance(what, ArrayOf) else "a table"
                ) in error.reason


@ANY
@given(scenes())
@example(EVERYTHING)
@example(MORPH)
def test_two_of_one_name_are_refused(scene):
    """Where each has its name, whatever else it says."""
    for path, what, value in parts(SCENE, scene):
        twins = [table for table in value if what.unique in table] if many_named(what) else []
        if twins:
            error = refused(changed(scene, path, lambda items, twin=twins[0]: [*items, twin]))
            assert error.path == (*path, len(value), what.unique)
            assert f"is the name of {path[0]}.{value.index(twins[0])} too" in error.reason


def many_named(what):
    return isinstance(what, ArrayOf) and what.unique is not None


@pytest.mark.parametrize("path", [("force", 0), ("envelopes", "constant")])
@pytest.mark.parametrize("kind", ["psuh", "", 3, True, ["push"], {"push": 1}, None])
def test_a_kind_that_does_not_exist_is_refused_whatever_it_is(path, kind):
    error = refused(changed(EVERYTHING, path, lambda table: {**table, "kind": kind}))
    if kind is not None:
        assert error.path == (*path, "kind")
        assert error.reason.startswith(f"{kind!r}: expected one of ")
    else:
        assert error.path == path and error.reason.startswith("kind is missing: expected one of ")


@pytest.mark.parametrize(("heading", "name"), [("[time]", "duration"), ("[fluid]", "cells")])
def test_a_number_too_large_for_a_float_is_refused(heading, name):
    """TOML's whole numbers have no limit."""
    error = refused(changed(EVERYTHING, (heading[1:-1], name), lambda _: 10**400))
    assert error.path == (heading[1:-1], name) and "expected" in error.reason


@pytest.mark.parametrize(
    ("path", "given", "kept"),
    [
        (("force", 0, "envelope"), "one", ["one"]),
        (("density", 0, "color"), "#FFaa01", "#ffaa01"),
    ],
)
def test_what_may_be_written_in_two_ways_is_kept_in_one(path, given, kept):
    part = checked(SCENE, changed(EVERYTHING, path, lambda _: given))
    for step in path:
        part = part[step]
    assert part == kept


@pytest.mark.parametrize(
    ("path", "wrong", "right"),
    [
        ((), "forse", "force"),
        (("force", 0), "raduis", "radius"),
        (("fluid",), "pressure_cycle", "pressure_cycles"),
        (("density", 0, "source", 0), "centre", "center"),
    ],
)
def test_the_nearest_key_is_asked_for(path, wrong, right):
    error = refused(changed(EVERYTHING, path, lambda table: {wrong: 1, **table}))
    assert error.reason == f"no such key; did you mean {right}?"


@pytest.mark.parametrize(
    ("scene", "says"),
    [
        ({"force": [{"kind": "push", "center": [1, 1], "by": [1, 0], "group": "a"}]}, "force.0.group: 'a'"),
        ({"force": [{"kind": "buoyancy", "density": "ik", "by": [0, 1]}]}, "'ik': no such density"),
        ({"group": [{"name": "a", "envelope": ["e"]}]}, "group.0.envelope: 'e': no such envelope"),
        ({"density": [{"name": "a", "source": [{"envelope": "e"}]}]}, "density.0.source.0.envelope: 'e'"),
        ({"output": [{"file": "a.gif", "of": "lairy"}], "layer": [{"name": "layer", "file": "a"}]}, "layer?"),
        ({"layer": [{"name": "tracks", "file": "a.png"}]}, "layer.0.name: 'tracks' is taken"),
        ({"density": [{"name": "a"}], "layer": [{"name": "a", "file": "b"}]}, "density.0.name: 'a' is taken"),
        ({"picture": None}, "[picture] is missing: give the file"),
    ],
)
def test_names_that_do_not_fit_together_are_refused(scene, says):
    with pytest.raises(SceneError) as error:
        whole = {"wfluid": 1, "picture": {"file": "a.png"}, **scene}
        Scene({name: table for name, table in whole.items() if table is not None})
    assert says in str(error.value) and str(error.value).startswith("scene: ")


def test_the_reference_has_a_section_for_each_table_and_a_row_for_each_key():
    sections = dict(part.split("`", 1) for part in reference()[len("### `") :].split("\n### `"))
    assert list(sections) == [heading for heading, _, _ in tables()]
    for heading, meaning, table in tables():
        rows = [line.split("`")[1] for line in sections[heading].splitlines() if line.startswith("| `")]
        assert rows == [name for name, key in table.keys.items() if isinstance(key, Key)]
        assert f"\n{meaning}.\n" in sections[heading]
        for name in rows:
            key = table.keys[name]
            line = next(line for line in sections[heading].splitlines() if line.startswith(f"| `{name}`"))
            assert key.meaning in line and key.type in line and (not key.required or "| required |" in line)
            assert key.type and key.meaning and (not key.unit or f"[{key.unit}]" in line)


def test_no_table_lies_within_two_lists_unseen():
    """Every part that the schema has is reached by its headings."""
    seen = {id(table) for _, _, table in tables()}

    def all_of(what):
        if isinstance(what, ArrayOf | MapOf):
            return all_of(what.each)
        if isinstance(what, Union):
            return [table for inner in what.tables.values() for table in all_of(inner)]
        below = [] if isinstance(what, Key) else [t for key in what.keys.values() for t in all_of(key)]
        return [what, *below] if isinstance(what, Table) else below

    assert {id(table) for table in all_of(SCENE)} == seen
