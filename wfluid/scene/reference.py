"""The reference of a scene's keys, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator

from wfluid.scene.format import SCENE
from wfluid.scene.schema import ArrayOf, Key, MapOf, Part, Table, Union


def tables(what: Part = SCENE, path: str = "") -> Iterator[tuple[str, str, Table]]:
    """Every table below `what`: its heading in TOML, its meaning, and the table."""
    if isinstance(what, ArrayOf | MapOf):
        yield from tables(what.each, f"[{path}]" if isinstance(what, ArrayOf) else f"{path}.NAME")
    elif isinstance(what, Union):
        for kind, table in what.tables.items():
            yield f'[{path}] kind = "{kind}"', table.meaning, table
    elif isinstance(what, Table):
        yield f"[{path}]" if path else "at the top", what.meaning, what
        inner = path.strip("[]")
        for name, key in what.keys.items():
            yield from tables(key, f"{inner}.{name}" if inner else name)


def reference() -> str:
    """All keys as Markdown: a section for each table, a row for each key."""
    lines = []
    for heading, meaning, table in tables():
        lines += ["", f"### `{heading}`", "", f"{meaning}.", ""]
        rows = [(name, key) for name, key in table.keys.items() if isinstance(key, Key)]
        if rows:
            lines += ["| key | meaning | type | default |", "| --- | --- | --- | --- |"]
        for name, key in rows:
            unit = f" [{key.unit}]" if key.unit else ""
            default = "required" if key.required else key.shown_default
            lines.append(f"| `{name}` | {key.meaning}{unit} | {key.type} | {default} |")
    return "\n".join(lines).strip() + "\n"
