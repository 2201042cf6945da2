"""The tables of a scene as classes; a field defines everything about one key.

A field made by `key` has the type, range, unit, default and meaning of a value; fields made by `table`,
`array`, `mapping` and `optional` hold further tables. The check of a TOML file, the objects made from it, the
reference and the flags of the command line all follow from the fields. An error names the path of the key,
such as `force.2.radius`, and the nearest known key or word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, NamedTuple, dataclass_transform

from wfluid.scene.types import Type, text
from wfluid.system.errors import FileError


class SchemaError(ValueError):
    """A key that is unknown, missing, or has a wrong value.

    `path` leads to the key; `about_value` is true if `reason` begins with the wrong value.
    """

    def __init__(self, path: Sequence[str | int], reason: str, about_value: bool = False):
        self.path, self.reason, self.about_value = tuple(path), reason, about_value
        super().__init__(f"{dotted(path)}: {reason}")


class SceneError(ValueError):
    """A scene that cannot be read or has an error; the message names file, line where known, and key."""


def dotted(path: Sequence[str | int]) -> str:
    """A path with dots, as in TOML."""
    return ".".join(map(str, path)) or "the file"


@contextmanager
def blame(*path: str | int, file: str = "") -> Iterator[None]:
    """Name a key, or a file, in the errors raised inside the block.

    The error of a file that cannot be read names the file already, and passes through.

    Raises:
        SchemaError: the error with the path of the key.
        ValueError: the error with the name of the file, where no path is given.
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


# Keys and tables


class Key(NamedTuple):
    """A key with a value."""

    meaning: str
    """Meaning, in a few words."""
    kind: Type
    """Type and range of the value."""
    unit: str = ""
    """Unit of the value."""
    default: Any = None
    """Default value; None if it depends on other values."""
    otherwise: str = ""
    """Default in words, where it depends on other values."""
    required: bool = False
    """Whether the key must be given."""
    file: str = ""
    """"file" for the name of a file, relative to the scene; "painting" where `self` is allowed too."""
    flag: str = ""
    """Flag of the command line that sets only this key."""
    metavar: str | None = None
    """Placeholder of the value in the help of the flag."""
    form: str = ""
    """Flag or argument that sets this key together with others."""

    @property
    def check(self):
        """Returns the value in its stored form; raises ValueError with the expected type."""
        return self.kind.check

    @property
    def type(self) -> str:
        """The expected type, in words."""
        return self.kind.text

    @property
    def shown_default(self) -> str:
        """The default, in words."""
        if self.default in (None, ()):
            return self.otherwise
        if isinstance(self.default, bool):
            return str(self.default).lower()
        return self.default if isinstance(self.default, str) else f"{self.default:g}"


class Table(NamedTuple):
    """A table with known keys."""

    meaning: str
    """Meaning, in a few words."""
    keys: Mapping[str, Key | Table | ArrayOf | MapOf | Union]
    """Its keys and inner tables."""
    make: type[SceneTable]
    """The class of its objects."""
    attributes: Mapping[str, str]
    """Attribute of the object, by key."""
    not_in_morph: Mapping[str, str]
    """Reason why a morph does not allow a key, by key."""


class ArrayOf(NamedTuple):
    """An array of tables."""

    each: Table | Union
    """Type of its items."""
    unique: str | None = None
    """Key whose values must differ."""


class MapOf(NamedTuple):
    """A table of tables under names that the user chooses."""

    each: Table | Union
    """Type of its items."""


class Union(NamedTuple):
    """One of several tables, chosen by the key `kind`."""

    meaning: str
    """Meaning, in a few words."""
    tables: Mapping[str, Table]
    """The tables by kind."""


Part = Key | Table | ArrayOf | MapOf | Union


# Classes of tables


class Field(NamedTuple):
    """The definition of one attribute of a class of tables."""

    what: Part
    """Its key or table."""
    name: str = ""
    """Its key, if that differs from the attribute."""
    default: Callable[[], Any] = lambda: None
    """Makes the default value."""
    not_in_morph: str = ""
    """Reason why a morph does not allow it; empty if it does."""


def key(meaning: str, kind: Type, *, name: str = "", not_in_morph: str = "", **more: Any) -> Any:
    """Define an attribute with a value; `more` are further fields of `Key`."""
    what = Key(meaning, kind, **more)
    return Field(what, name, lambda: what.default, not_in_morph)


def file_key(meaning: str, *, painting: bool = True, **more: Any) -> Any:
    """Define an attribute with the name of a file; a painting may be `self`, the animated picture."""
    return key(meaning, text(), file="painting" if painting else "file", **more)


def table(of: type[SceneTable], not_in_morph: str = "") -> Any:
    """Define an attribute with a table; without it in a scene, all its keys have their defaults."""
    return Field(table_of(of), "", of, not_in_morph)


def optional(of: type[SceneTable], not_in_morph: str = "") -> Any:
    """Define an attribute with a table; None without it in a scene."""
    return Field(table_of(of), not_in_morph=not_in_morph)


def array(
    of: type[SceneTable] | Union, *, name: str, unique: str | None = None, not_in_morph: str = ""
) -> Any:
    """Define an attribute with an array of tables, a tuple."""
    each = of if isinstance(of, Union) else table_of(of)
    return Field(ArrayOf(each, unique), name, tuple, not_in_morph)


def mapping(of: Union) -> Any:
    """Define an attribute with named tables, a dictionary."""
    return Field(MapOf(of), default=dict)


@dataclass_transform(
    kw_only_default=True,
    frozen_default=True,
    field_specifiers=(key, file_key, table, optional, array, mapping),
)
class SceneTable:
    """Base class of a scene's tables; its fields are defined by `key`, `table` and the like.

    Attributes are given as keywords; others have their defaults. The first line of the docstring is the
    meaning of the table.
    """

    fields: ClassVar[Mapping[str, Field]] = {}
    """Fields by attribute, those of base classes first."""
    kind: ClassVar[str] = ""
    """Value of the key `kind`, for the tables of a `Union`."""
    trailing: ClassVar[bool] = False
    """Whether the keys of this base class are listed after those of derived classes."""
    given: frozenset[str]
    """Attributes that were given, not left at their defaults."""

    def __init_subclass__(cls) -> None:
        """Collect the fields."""
        cls.fields = {
            name: one
            for base in reversed(cls.__mro__)
            for name, one in vars(base).items()
            if isinstance(one, Field)
        }

    def __init__(self, **given: Any):
        """Set the given attributes, and the others to their defaults.

        Raises:
            TypeError: an unknown attribute, or a required one that is missing.
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
        """Whether at least one of these attributes was given."""
        return not self.given.isdisjoint(attributes)


def union(meaning: str, *classes: type[SceneTable]) -> Union:
    """One of several tables; a class has its kind in `kind`."""
    return Union(meaning, {one.kind: table_of(one) for one in classes})


def table_of(of: type[SceneTable]) -> Table:
    """The table that a class defines."""
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
