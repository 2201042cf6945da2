"""Tables of a scene as classes, whose fields say all there is to say of a key.

A field made by `key` has type, range, unit, default and words for people; `table`, `array`, `mapping` and
`optional` hold further tables. From the fields come the check of nested dictionaries as TOML gives them,
the objects made from them, the reference and the flags of the command line. What is wrong is refused with
the key's path, such as `force.2.radius`, and the nearest key or word there is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, NamedTuple, dataclass_transform

from wfluid.scene.types import Type, text
from wfluid.system.errors import FileError


class SchemaError(ValueError):
    """A key that is unknown, missing, or has a wrong value, with which the reason then begins.

    `path` leads to it.
    """

    def __init__(self, path: Sequence[str | int], reason: str, about_value: bool = False):
        self.path, self.reason, self.about_value = tuple(path), reason, about_value
        super().__init__(f"{dotted(path)}: {reason}")


class SceneError(ValueError):
    """A scene that cannot be read or makes no sense; the message names file, line where known, and key."""


def dotted(path: Sequence[str | int]) -> str:
    """A path as a person writes it."""
    return ".".join(map(str, path)) or "the file"


@contextmanager
def blame(*path: str | int, file: str = "") -> Iterator[None]:
    """Name a key, or a file, in what is refused within.

    A file that cannot be read has its name already; a key with a `file` has both.

    Raises:
        SchemaError: instead of what is refused, where a path is given; else a ValueError with the file.
    """
    try:
        yield
    except SchemaError:
        raise
    except (ValueError, TypeError) as error:
        if isinstance(error, FileError) and path:
            raise
        reason = str(error)
        reason = reason if file in reason else f"{file}: {reason}"
        raise (SchemaError(path, reason) if path else ValueError(reason)) from error


# What a scene may say


class Key(NamedTuple):
    """One value."""

    meaning: str
    """What it is for, in a few words."""
    kind: Type
    """What it may be."""
    unit: str = ""
    """Unit."""
    default: Any = None
    """What it is when left out; None where that is no one value."""
    otherwise: str = ""
    """What it is when left out, in words, where that is no one value."""
    required: bool = False
    """Whether it must be there."""
    file: str = ""
    """"file" where it names one, relative to the scene's folder; "painting" where `self` is none."""
    flag: str = ""
    """The flag of the command line that sets it and nothing else."""
    metavar: str | None = None
    """What stands for the value in the flag's help."""
    form: str = ""
    """What of a command line says it, where that says more than this key."""

    @property
    def check(self):
        """Gives the value as it is kept; raises ValueError with what was expected."""
        return self.kind.check

    @property
    def type(self) -> str:
        """What is expected, for people."""
        return self.kind.text

    @property
    def shown_default(self) -> str:
        """What it is when left out, for people."""
        if self.default in (None, ()):
            return self.otherwise
        if isinstance(self.default, bool):
            return str(self.default).lower()
        return self.default if isinstance(self.default, str) else f"{self.default:g}"


class Table(NamedTuple):
    """Keys and tables by name."""

    meaning: str
    """What it is for."""
    keys: Mapping[str, Key | Table | ArrayOf | MapOf | Union]
    """What may be in it."""
    make: type[SceneTable]
    """The class of its objects."""
    attributes: Mapping[str, str]
    """The attribute of the object, by key."""
    not_in_morph: Mapping[str, str]
    """Why a morph has no use for a key, by key."""


class ArrayOf(NamedTuple):
    """An array of tables."""

    each: Table | Union
    """What each is."""
    unique: str | None = None
    """A key whose values must differ."""


class MapOf(NamedTuple):
    """Tables under names of the user's choice."""

    each: Table | Union
    """What each is."""


class Union(NamedTuple):
    """A table whose key `kind` says which."""

    meaning: str
    """What it is for."""
    tables: Mapping[str, Table]
    """By kind."""


Part = Key | Table | ArrayOf | MapOf | Union


# Tables as classes


class Field(NamedTuple):
    """What a class of tables says of one of its attributes."""

    what: Part
    """What may be there."""
    name: str = ""
    """The key, where it is not called as the attribute."""
    default: Callable[[], Any] = lambda: None
    """Makes what it is when left out."""
    not_in_morph: str = ""
    """Why a morph has no use for it, if it has none."""


def key(meaning: str, kind: Type, *, name: str = "", not_in_morph: str = "", **more: Any) -> Any:
    """An attribute with a value; `more` is of `Key`."""
    what = Key(meaning, kind, **more)
    return Field(what, name, lambda: what.default, not_in_morph)


def file_key(meaning: str, *, painting: bool = True, **more: Any) -> Any:
    """An attribute with the name of a file; of a painting, `self` is the picture that is animated."""
    return key(meaning, text(), file="painting" if painting else "file", **more)


def table(of: type[SceneTable], not_in_morph: str = "") -> Any:
    """An attribute with a table, which has its defaults where it is left out."""
    return Field(table_of(of), "", of, not_in_morph)


def optional(of: type[SceneTable], not_in_morph: str = "") -> Any:
    """An attribute with a table, None where it is left out."""
    return Field(table_of(of), not_in_morph=not_in_morph)


def array(
    of: type[SceneTable] | Union, *, name: str, unique: str | None = None, not_in_morph: str = ""
) -> Any:
    """An attribute with an array of tables, a tuple."""
    each = of if isinstance(of, Union) else table_of(of)
    return Field(ArrayOf(each, unique), name, tuple, not_in_morph)


def mapping(of: Union) -> Any:
    """An attribute with tables by names of the user's choice."""
    return Field(MapOf(of), default=dict)


@dataclass_transform(
    kw_only_default=True,
    frozen_default=True,
    field_specifiers=(key, file_key, table, optional, array, mapping),
)
class SceneTable:
    """Base of a scene's tables: what `key` and the like say of a class is an attribute of its objects.

    Attributes are keywords; what is left out has its default. The docstring is what the table is for.
    """

    fields: ClassVar[Mapping[str, Field]] = {}
    """By attribute, those of bases first."""
    kind: ClassVar[str] = ""
    """What its key `kind` says, of one of some kinds."""
    trailing: ClassVar[bool] = False
    """Whether the keys of a base are listed after those of the tables made from it."""
    given: frozenset[str]
    """Attributes that were given."""

    def __init_subclass__(cls) -> None:
        """Collect the fields."""
        cls.fields = {
            name: one
            for base in reversed(cls.__mro__)
            for name, one in vars(base).items()
            if isinstance(one, Field)
        }

    def __init__(self, **given: Any):
        """Take what is given.

        Raises:
            TypeError: an attribute that there is not, or a required one that is missing.
        """
        required = {
            name for name, one in self.fields.items() if isinstance(one.what, Key) and one.what.required
        }
        if wrong := (given.keys() - self.fields.keys()) | (required - given.keys()):
            raise TypeError(f"{type(self).__name__}: unknown or missing: {', '.join(sorted(wrong))}")
        vars(self)["given"] = frozenset(given)
        for name, one in self.fields.items():
            vars(self)[name] = given[name] if name in given else one.default()

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__}.{name} cannot be set")

    def __repr__(self) -> str:
        shown = (f"{name}={getattr(self, name)!r}" for name in self.fields if name in self.given)
        return f"{type(self).__name__}({', '.join(shown)})"

    def gives(self, *attributes: str) -> bool:
        """Whether one of these was given."""
        return not self.given.isdisjoint(attributes)


def union(meaning: str, *classes: type[SceneTable]) -> Union:
    """A table of one of some kinds, each called as its class says."""
    return Union(meaning, {one.kind: table_of(one) for one in classes})


def table_of(of: type[SceneTable]) -> Table:
    """What the fields of a class say."""
    bases = [base for base in of.__mro__[1:] if issubclass(base, SceneTable)]
    late = {attribute for base in bases if vars(base).get("trailing") for attribute in base.fields}
    fields = dict(sorted(of.fields.items(), key=lambda item: item[0] in late))
    names = {attribute: one.name or attribute for attribute, one in fields.items()}
    return Table(
        (of.__doc__ or "").partition("\n")[0].rstrip("."),
        {names[attribute]: one.what for attribute, one in fields.items()},
        of,
        {name: attribute for attribute, name in names.items()},
        {names[attribute]: one.not_in_morph for attribute, one in fields.items() if one.not_in_morph},
    )
