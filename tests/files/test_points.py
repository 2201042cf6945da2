"""Tables of points are read with any separator; invalid lines are refused with their number."""

from pathlib import Path

import pytest

from wfluid.files.points import PointRow, read_points
from wfluid.system.errors import FileError

HEADER, PLACES = (
    "x_cat,y_cat,x_raccoon,y_raccoon\n",
    [((172.0, 115.5), (155.0, -2.0)), ((1.0, 2.0), (3.0, 4.0))],
)
ROWS = "172,115.5,155,-2e0\n1,2,3,4\n"


@pytest.fixture
def read(tmp_path):
    """Reads points from a text, written to points.csv."""

    def read(content):
        path = tmp_path / "points.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_points(path)

    return read


def places(rows):
    return [(row.source, row.target) for row in rows]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("header", ["", HEADER])
@pytest.mark.parametrize("start", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_table_is_read_with_any_separator(read, separator, header, start, end):
    rows = read(start + (header + ROWS).replace(",", separator).replace("\n", end))
    assert places(rows) == PLACES
    first = 2 if header else 1
    assert [(row.line, row.time) for row in rows] == [(first, None), (first + 1, None)]


def test_a_row_has_its_line_its_places_and_its_time(read):
    assert read("\n1,2,3,4,0.25") == [PointRow(2, (1.0, 2.0), (3.0, 4.0), 0.25)]


def test_a_time_may_be_left_out_in_some_rows(read):
    rows = read("x,y,u,v,when\n1,2,3,4,0.5\n5,6,7,8,\n9,10,11,12\n")
    assert [row.time for row in rows] == [0.5, None, None]


def test_blank_lines_comments_and_empty_cells_are_skipped_but_counted(read):
    rows = read(f"\n  \n# the cat's \"eye, and\n,,,\n{HEADER}  # nose\n1,2,3,4\n\n5,6,7,8")
    assert [(row.line, row.source) for row in rows] == [(7, (1.0, 2.0)), (9, (5.0, 6.0))]


def test_fields_may_be_quoted_and_surrounded_by_spaces(read):
    rows = read('"left, x" ; "y" ;u;v\n "1" ; " 2 ";3  ;\t4')
    assert places(rows) == [((1.0, 2.0), (3.0, 4.0))]


def test_names_of_columns_may_contain_other_separators(read):
    """The separator is the one that gives four or five columns."""
    rows = read("x, from;y, from;x, to;y, to\n1;2;3;4")
    assert places(rows) == [((1.0, 2.0), (3.0, 4.0))]


def test_the_example_is_read():
    rows = read_points(Path(__file__).parents[2] / "examples/images/cat_to_raccoon.csv")
    assert len(rows) == 6
    assert rows[0] == PointRow(2, (172.0, 115.0), (155.0, 155.0), None)
    assert rows[-1] == PointRow(7, (350.0, 190.0), (350.0, 200.0), None)


WRONG = {
    "": " has no points",
    HEADER: " has no points",
    "# nothing\n\n,,,\n": " has no points",
    "1,2,3": "1: 3 columns; expected from x, from y, to x, to y and perhaps time",
    "x,y": "1: 2 columns; expected from x",
    "1 2 3 4": "1: 1 column; expected from x",
    f"{HEADER}1,2,3,4\n\n1,2,3,4,5,6": "4: 6 columns; expected from x",
    "1,2,3,4\na,b,c,d": "2: from x 'a': expected a number",
    f"1,2,3,4\n{HEADER}": "2: from x 'x_cat': expected a number",
    f"{HEADER}1,two,3,4": "2: y_cat 'two': expected a number",
    "x,y,,v\n1,2,three,4": "2: to x 'three': expected a number",
    "1,2,3,4_0": "1: to y '4_0': expected a number",
    "x;y;u;v\n1;2;3,5;4": "2: u '3,5': expected a number",
    f"{HEADER}1,2,,4": "2: x_raccoon is missing",
    '"x" , y ,"u" ,v\n1,2, ,4': "2: u is missing",
    "1,nan,3,4": "1: from y nan: expected a finite number",
    "1,2,3,-1e999": "1: to y -1e999: expected a finite number",
    "1,2,3,4,later": "1: time 'later': expected a number",
    "x,y,u,v,when\n1,2,3,4,0": "2: when 0: expected a positive number of seconds",
    "1,2,3,4,-0.5": "1: time -0.5: expected a positive number of seconds",
    '1,2,3,4\n5,6,7,"8': "2: a quote is not closed",
    "1,2,3," + 99 * "x": f"1: to y '{30 * 'x'}…': expected a number",
    "1,2,3," + 200_000 * "x": "1: field larger than field limit",
    b"\x89PNG\r\n\x1a\n\xff": " cannot be read (no UTF-8 text)",
    "1,2,3,4".encode("utf-16"): " cannot be read (no UTF-8 text)",
}
"""Contents of invalid files, and the message after the file's name."""


@pytest.mark.parametrize("content", WRONG, ids=lambda content: repr(content[:24]))
def test_an_invalid_line_is_refused_with_its_number(read, tmp_path, content):
    with pytest.raises(FileError) as refusal:
        read(content)
    message = str(refusal.value)
    assert message.startswith(f"{tmp_path / 'points.csv'}:{WRONG[content]}")
    assert "\n" not in message and len(message) < len(str(tmp_path)) + 200


def test_a_missing_file_or_a_folder_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"none\.csv: no such file of points$"):
        read_points(tmp_path / "none.csv")
    with pytest.raises(FileError, match=r": cannot be read \(Is a directory\)$"):
        read_points(str(tmp_path))
