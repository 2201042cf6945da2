"""Short representations of objects: one line, without arrays and without what has its default value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

MANY = 3
"""Longest list that is shown item by item."""


def short_repr(thing: Any) -> str:
    """The name of a dataclass with those fields that differ from their defaults.

    >>> from wfluid import Density, Fluid
    >>> Fluid(viscosity=0.005, densities=[Density("smoke")])
    Fluid(viscosity=0.005, densities=(Density(name='smoke'),), solver='multigrid')
    """
    shown = []
    for field in fields(thing):
        value = getattr(thing, field.name)
        if field.repr and not _is_default(field, value):
            shown.append(f"{field.name}={_short(value)}")
    return f"{type(thing).__name__}({', '.join(shown)})"


def _is_default(field: Any, value: Any) -> bool:
    """Whether a field has its default value."""
    default = field.default if field.default_factory is MISSING else field.default_factory()
    if default is MISSING:
        return False
    return value is default or (type(value) is type(default) and bool(np.all(value == default)))


def _short(value: Any) -> str:
    """An array by its shape, long lists and tables by their lengths."""
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, Mapping):
        return f"{{{', '.join(map(repr, value))}}}"
    if isinstance(value, list | tuple) and len(value) > MANY:
        return f"{len(value)} items"
    return repr(value)
