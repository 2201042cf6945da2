"""Checks of names within a scene, and of keys that a morph does not allow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from wfluid.scene.checking import parts
from wfluid.scene.forces import BuoyancyTable
from wfluid.scene.format import SCENE, SceneTables
from wfluid.scene.schema import SchemaError, Table
from wfluid.scene.types import nearest

SHOWN = ("picture", "tracks", "report")
"""Contents of an output, besides layers and densities."""


def check_names(scene: SceneTables) -> None:
    """Refuse unknown names of groups, envelopes, densities and layers, and ambiguous ones.

    Raises:
        SchemaError: with the path of the key.
    """
    if scene.picture is None:
        raise SchemaError((), "[picture] is missing: give the file of the animated picture")
    groups, layers, densities = (
        [one.name for one in tables] for tables in (scene.groups, scene.layers, scene.densities)
    )
    for n, force in enumerate(scene.forces):
        _check_known(("force", n, "group"), force.group, groups)
        if isinstance(force, BuoyancyTable):
            _check_known(("force", n, "density"), force.density, densities)
    for path, names in _uses_of_envelopes(scene):
        for name in names:
            _check_known(path, name, list(scene.envelopes))
    for n, name in enumerate([*layers, *densities]):
        kind, index = ("layer", n) if n < len(layers) else ("density", n - len(layers))
        if name in SHOWN or name in [*layers, *densities][:n]:
            raise SchemaError(
                (kind, index, "name"),
                f"{name!r} is taken: give layers and densities different names, as outputs use them",
            )
    for n, output in enumerate(scene.outputs):
        _check_known(("output", n, "of"), output.of, [*SHOWN, *layers, *densities])
        if output.of == "tracks" and not scene.tracks.points:
            raise SchemaError(("output", n, "of"), "there are no points to follow: give [tracks] points")


def check_morph(tables: Mapping[str, Any]) -> None:
    """Refuse keys that a morph does not allow, and a morph without points.

    Raises:
        SchemaError: with the path of the key.
    """
    keyframes = tables.get("keyframes", {})
    if not (keyframes.get("move") or "points" in keyframes):
        raise SchemaError(("keyframes",), "a morph needs points of both pictures: give move or points")
    for path, what, value in parts(SCENE, tables):
        for name, reason in what.not_in_morph.items() if isinstance(what, Table) else ():
            if value.get(name):
                raise SchemaError((*path, name), reason)


def _check_known(path: tuple, name: str | None, known: Sequence[str]) -> None:
    if name is not None and name not in known:
        expected = f"expected one of {', '.join(known)}" if known else "the scene has none"
        raise SchemaError(path, f"{name!r}: no such {path[-1]}; {expected}{nearest(name, known)}")


def _uses_of_envelopes(scene: SceneTables) -> Iterator[tuple[tuple, Sequence[str]]]:
    """The path and the names of every key that names envelopes."""
    for kind, tables in (("force", scene.forces), ("group", scene.groups)):
        for n, one in enumerate(tables):
            yield (kind, n, "envelope"), one.envelope
    for n, density in enumerate(scene.densities):
        for m, source in enumerate(density.sources):
            yield ("density", n, "source", m, "envelope"), source.envelope
