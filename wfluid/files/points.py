"""Pairs of points and destinations, read from a table of comma-separated values."""

from __future__ import annotations

import codecs
import csv
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from wfluid.system.errors import FileError

COLUMNS = ("from x", "from y", "to x", "to y", "time")
"""Meaning of the columns, the last of which is optional; a file may use other names."""

_SEPARATORS = "\t;,"
_LONGEST = 30  # characters of a file that a message quotes

_HINT = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)
"""A first line that names the separator, as some spreadsheets write it."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(e[+-]?\d+)?", re.IGNORECASE)
_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?\d")
_SPREADSHEET_ERROR = re.compile(r"#(N/A|DIV/0!|REF!|VALUE!|NAME\?|NUM!|NULL!)")


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

    Columns are separated by commas, semicolons or tabs, or by what a first line `sep=…` names. The first row
    may name the columns. Numbers have decimal points, or decimal commas where no comma separates. Blank lines
    and lines that begin with # are skipped. The text is UTF-8 or UTF-16. Points are not compared with the
    size of a picture.

    Raises:
        FileError: a file that is missing, is no text or has no points; an invalid line, or one that repeats
            another, with its number.
    """
    path, found = Path(path), []
    names: Sequence[str] | None = None
    separator, lines = "", {}
    for number, line in _lines(path):
        try:
            if number == 1 and (hint := _HINT.fullmatch(line)):
                separator = hint[1]
                continue
            separator = separator or _separator_of(line)
            row = _fields(line, separator)
            if not any(row):
                continue  # a spreadsheet's empty cells
            if names is None and _are_names(row, separator):
                names = [own or known for own, known in zip_longest(row, COLUMNS)]
                continue
            names = names or COLUMNS
            found.append(_row_of(number, row, names, separator))
            _check_new(found[-1], lines)
        except (csv.Error, ValueError) as error:
            raise FileError(f"{path}:{number}: {error}") from None
    if not found:
        raise FileError(f"{path}: has no points")
    return found


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines that hold data, with their numbers."""
    try:
        data = path.read_bytes()
        text = data.decode(_encoding(data))
    except FileNotFoundError:
        raise FileError(f"{path}: no such file of points") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise FileError(f"{path}: cannot be read (no UTF-8 text); save it as UTF-8") from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines, start=1):
        line = line.replace("\N{MINUS SIGN}", "-")
        comment = line.lstrip().startswith("#") and not _SPREADSHEET_ERROR.match(line.lstrip())
        if line.strip() and not comment:
            yield number, line


def _encoding(data: bytes) -> str:
    """The encoding of a text: UTF-16 if it begins with its mark or with half of a character, else UTF-8."""
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16"
    return {(False, True): "utf-16-le", (True, False): "utf-16-be"}.get(
        tuple(byte == 0 for byte in data[:2]), "utf-8-sig"
    )


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
        decimal = separator == "," and len(row) in range(6, 11) and not _are_names(row, separator)
        raise ValueError(
            f"{columns}; expected {', '.join(COLUMNS[:4])} and perhaps {COLUMNS[4]}, "
            "separated by commas, semicolons or tabs"
            + ("; numbers with decimal commas are separated by semicolons" if decimal else "")
        )
    return row


def _split(line: str, separator: str) -> list[str]:
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _are_names(row: Sequence[str], separator: str) -> bool:
    """Whether a row names columns: every field has a letter or is empty, and none is like a number."""
    return all(
        not text
        or (
            any(map(str.isalpha, text))
            and _number(text, separator) is None
            and not _BEGINS_AS_NUMBER.match(text)
            and not _SPREADSHEET_ERROR.match(text)
        )
        for text in row
    )


def _row_of(number: int, row: Sequence[str], names: Sequence[str], separator: str) -> PointRow:
    """The row of a line's fields.

    Raises:
        ValueError: a field that is missing or not a number, with the name of its column.
    """
    from_x, from_y, to_x, to_y = (
        _value(text, name, separator) for name, text in zip(names, row[:4], strict=False)
    )
    time = _value(row[4], names[4], separator) if len(row) == 5 and row[4] else None
    if time is not None and time <= 0:
        raise ValueError(f"{names[4]} {time:g}: expected a positive number of seconds")
    return PointRow(number, (from_x, from_y), (to_x, to_y), time)


def _check_new(row: PointRow, lines: dict[tuple, int]) -> None:
    """Check that no other row of the same time has the same point or destination, and add the row to `lines`.

    Raises:
        ValueError: another row has; the message names its line.
    """
    for what, place in (("point", row.source), ("destination", row.target)):
        line = lines.setdefault((what, place, row.time), row.line)
        if line != row.line:
            at = ",".join(f"{value:g}" for value in place)
            raise ValueError(f"the {what} {at} stands in line {line} already; keep one of them")


def _value(text: str, name: str, separator: str) -> float:
    if not text:
        raise ValueError(f"{name} is missing")
    value = _number(text, separator)
    shown = text if len(text) <= _LONGEST else text[:_LONGEST] + "…"
    if value is None:
        hint = "; numbers with decimal commas are separated by semicolons" if "," in text else ""
        raise ValueError(f"{name} {shown!r}: expected a number{hint if separator == ',' else ''}")
    if not math.isfinite(value):
        raise ValueError(f"{name} {shown}: expected a finite number")
    return value


def _number(text: str, separator: str) -> float | None:
    """The number that a field is; with a decimal comma too, where commas do not separate."""
    if separator != "," and _DECIMAL_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    try:
        return None if "_" in text else float(text)  # Python's own 1_000 is a name elsewhere
    except ValueError:
        return None
