"""Nested dictionaries, as TOML has them, checked against the tables of a scene and made into objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from wfluid.scene.schema import ArrayOf, Key, MapOf, Part, SchemaError, Table, Union, dotted
from wfluid.scene.types import nearest


def checked(what: Part, value: Any, path: tuple = ()) -> Any:
    """The value as plain dictionaries and lists, each value of a key in its stored form.

    `path` leads to the value.

    Raises:
        SchemaError: the first wrong key.
    """
    if isinstance(what, Key):
        try:
            return what.check(value)
        except ValueError as error:
            shown = repr(value) if len(repr(value)) <= 60 else repr(value)[:57] + "…"
            raise SchemaError(path, f"{shown}: {error}", about_value=True) from None
    if isinstance(what, ArrayOf):
        if not isinstance(value, list):
            raise SchemaError(path, f"expected a list of tables, [[{dotted(path)}]]")
        found = [checked(what.each, item, (*path, n)) for n, item in enumerate(value)]
        if what.unique:
            _refuse_twins(what.unique, found, path)
        return found
    if not isinstance(value, Mapping):
        raise SchemaError(path, f"expected a table, [{dotted(path)}]")
    if isinstance(what, MapOf):
        return {name: checked(what.each, item, (*path, name)) for name, item in value.items()}
    if isinstance(what, Union):
        return _checked_kind(what, value, path)
    return _checked_keys(what, value, path)


def _checked_kind(what: Union, value: Mapping, path: tuple) -> dict:
    kind = value.get("kind")
    if kind is None:
        raise SchemaError(path, f"kind is missing: expected one of {', '.join(what.tables)}")
    if not isinstance(kind, str) or kind not in what.tables:
        reason = f"{kind!r}: expected one of {', '.join(what.tables)}{nearest(kind, list(what.tables))}"
        raise SchemaError((*path, "kind"), reason)
    return {"kind": str(kind), **_checked_keys(what.tables[str(kind)], _without_kind(value), path)}


def _without_kind(value: Mapping) -> dict:
    return {name: item for name, item in value.items() if name != "kind"}


def _checked_keys(what: Table, value: Mapping, path: tuple) -> dict:
    for name in value:
        if name not in what.keys:
            known = f"; expected one of {', '.join(what.keys)}" if what.keys else ""
            raise SchemaError((*path, name), f"no such key{nearest(name, list(what.keys)) or known}")
    for name, one in what.keys.items():
        if isinstance(one, Key) and one.required and name not in value:
            raise SchemaError(path, f"{name} is missing: {one.meaning}")
    return {str(name): checked(what.keys[name], item, (*path, str(name))) for name, item in value.items()}


def _refuse_twins(name: str, found: Sequence[Mapping], path: tuple) -> None:
    seen: dict[Any, int] = {}
    for n, item in enumerate(found):
        value = item.get(name)
        if value is None:
            continue
        if value in seen:
            raise SchemaError(
                (*path, n, name), f"{value!r} is the name of {dotted((*path, seen[value]))} too"
            )
        seen[value] = n


def made(what: Part, value: Any) -> Any:
    """The objects of a checked value: tables become their classes, arrays become tuples."""
    if isinstance(what, Key):
        return _as_tuples(value)
    if isinstance(what, ArrayOf):
        return tuple(made(what.each, item) for item in value)
    if isinstance(what, MapOf):
        return {name: made(what.each, item) for name, item in value.items()}
    if isinstance(what, Union):
        return made(what.tables[value["kind"]], _without_kind(value))
    return what.make(**attributes_of(what, value))


def attributes_of(what: Table, value: Mapping) -> dict[str, Any]:
    """The attributes of a checked table's object."""
    return {what.attributes[name]: made(what.keys[name], item) for name, item in value.items()}


def _as_tuples(value: Any) -> Any:
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value


def parts(what: Part, value: Any, path: tuple = ()) -> Iterator[tuple[tuple, Part, Any]]:
    """Every part of a checked value: its path, its definition and its value."""
    yield path, what, value
    if isinstance(what, ArrayOf | MapOf):
        items = enumerate(value) if isinstance(what, ArrayOf) else value.items()
        for name, item in items:
            yield from parts(what.each, item, (*path, name))
    elif isinstance(what, Table | Union):
        keys = keys_of(what, value)
        for name in keys:
            if name in value:
                yield from parts(keys[name], value[name], (*path, name))


def replaced(what: Part, value: Any, change: Callable[[Key, Any], Any]) -> Any:
    """The checked value, with `change` applied to the value of every key."""
    if isinstance(what, Key):
        return change(what, value)
    if isinstance(what, ArrayOf):
        return [replaced(what.each, item, change) for item in value]
    if isinstance(what, MapOf):
        return {name: replaced(what.each, item, change) for name, item in value.items()}
    keys = keys_of(what, value)
    return {
        name: replaced(keys[name], item, change) if name in keys else item for name, item in value.items()
    }


def keys_of(what: Table | Union, value: Mapping) -> Mapping[str, Part]:
    """The keys of a table, except for `kind`."""
    return (what.tables[value["kind"]] if isinstance(what, Union) else what).keys
