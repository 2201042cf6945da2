"""Pairs of points and destinations, read from a table of comma-separated values."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from wfluid.system.errors import FileError

COLUMNS = ("from x", "from y", "to x", "to y", "time")
"""Meaning of the columns, the last of which is optional; a file may use other names."""

_SEPARATORS = "\t;,"
_LONGEST = 30  # characters of a file that a message quotes


@dataclass(frozen=True)
class PointRow:
    """A point and its destination."""

    line: int
    """Line of the file, from 1."""
    source: tuple[float, float]
    """The point, x and y [px]."""
    target: tuple[float, float]
    """Its destination, x and y [px]."""
    time: float | None
    """Time of arrival [s], after 0; None if the row has none."""


def read_points(path: str | os.PathLike) -> list[PointRow]:
    """The rows of a table with the columns from x, from y, to x, to y [px] and, optionally, time [s].

    Columns are separated by commas, semicolons or tabs. The first row may name them. Blank lines and lines
    that begin with # are skipped. Points are not compared with the size of a picture.

    Raises:
        FileError: a file that is missing, is no text or has no points; or an invalid line, with its number.
    """
    path, found = Path(path), []
    names: Sequence[str] | None = None
    separator = ""
    for number, line in _lines(path):
        try:
            separator = separator or _separator_of(line)
            row = _fields(line, separator)
            if not any(row):
                continue  # a spreadsheet's empty cells
            if names is None and all(_number(text) is None for text in row):
                names = [own or known for own, known in zip_longest(row, COLUMNS)]
                continue
            names = names or COLUMNS
            found.append(_row_of(number, row, names))
        except (csv.Error, ValueError) as error:
            raise FileError(f"{path}:{number}: {error}") from None
    if not found:
        raise FileError(f"{path}: has no points")
    return found


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines that hold data, with their numbers."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise FileError(f"{path}: no such file of points") from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "no UTF-8 text"
        raise FileError(f"{path}: cannot be read ({reason})") from None
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def _separator_of(line: str) -> str:
    """The separator of a line's fields: the one with 4 or 5 fields, else the one with most fields."""
    counts = {separator: len(_split(line, separator)) for separator in _SEPARATORS}
    return next((one for one in counts if counts[one] in (4, 5)), max(counts, key=counts.get))


def _fields(line: str, separator: str) -> list[str]:
    """The fields of a line, stripped of spaces: 4 or 5, unless all are empty.

    Raises:
        ValueError: another number of fields, or a quote that is not closed.
    """
    if line.count('"') % 2:
        raise ValueError("a quote is not closed")
    row = _split(line, separator)
    if len(row) not in (4, 5) and any(row):
        columns = "1 column" if len(row) == 1 else f"{len(row)} columns"
        raise ValueError(
            f"{columns}; expected {', '.join(COLUMNS[:4])} and perhaps {COLUMNS[4]}, "
            "separated by commas, semicolons or tabs"
        )
    return row


def _split(line: str, separator: str) -> list[str]:
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _row_of(number: int, row: Sequence[str], names: Sequence[str]) -> PointRow:
    """The row of a line's fields.

    Raises:
        ValueError: a field that is missing or not a number, with the name of its column.
    """
    from_x, from_y, to_x, to_y = (_value(text, name) for name, text in zip(names, row[:4], strict=False))
    time = _value(row[4], names[4]) if len(row) == 5 and row[4] else None
    if time is not None and time <= 0:
        raise ValueError(f"{names[4]} {time:g}: expected a positive number of seconds")
    return PointRow(number, (from_x, from_y), (to_x, to_y), time)


def _value(text: str, name: str) -> float:
    if not text:
        raise ValueError(f"{name} is missing")
    value = _number(text)
    shown = text if len(text) <= _LONGEST else text[:_LONGEST] + "…"
    if value is None:
        raise ValueError(f"{name} {shown!r}: expected a number")
    if not math.isfinite(value):
        raise ValueError(f"{name} {shown}: expected a finite number")
    return value


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)  # Python's own 1_000 is a name elsewhere
    except ValueError:
        return None
