"""Format of a delimited text: encoding, delimiter, decimal mark, and its header, or its columns without one."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, pairwise, repeat
from operator import itemgetter
from pathlib import Path

import pyarrow as pa

from analyzer.history import stamps
from analyzer.history.clock import SINCE_START, time_scale_of
from analyzer.history.files import detect_encoding
from analyzer.history.rewritten import rewritten
from analyzer.history.sheet import Sheet, types_of
from analyzer.history.table import WORDS, ReadOptions
from analyzer.history.time_columns import is_stamp, without_unit
from identification.errors import InputError

NUMBERS_SHARE = 0.8
"""Share of a column's cells that are numbers where it holds numbers: the rest is a historian's words."""
HEAD_BYTES = 1000000  # Part of a text from which its format is detected [bytes]
HEAD_LINES = 200  # The same in lines [lines]
PREAMBLE_LINES = 30  # Lines of a preamble at most under which a header is looked for [lines]

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}
NO_DATA_LINE = re.compile(r"^(?:#.*|\[\w+\]|sep=.?|)$", re.IGNORECASE)
COMMA_NUMBER = re.compile(r"^[+-]?\d+,\d+(?:[eE][+-]?\d+)?$")
POINT_NUMBER = re.compile(r"^[+-]?\d*\.\d+(?:[eE][+-]?\d+)?$")
NUMBER = re.compile(r"^[+-]?(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?$")
GROUP = re.compile(r"^[+-]?[1-9]\d{0,2}[.,]\d{3}$")
"""A number whose mark may be a decimal mark or a thousands separator."""
DATA_MARK = re.compile(r"^\s*\[data\]\s*$", re.IGNORECASE)
JSON = re.compile(r"^(?:\{\s*[\"}]|\[\s*[\[{\"])")
STAMP = re.compile(r"^\d{1,4}[-/.]\w{1,9}[-/.]\d{1,4}\b|^\d{1,2}:\d\d\b")
UNNAMED = "column {}"
"""Name of a column without a name, by its position, from 1."""
QUALITIES = frozenset(WORDS["quality"]["unnamed"])


def open_sheet(path: Path, options: ReadOptions) -> Sheet:
    """Determine the format of a delimited text.

    Raises
    ------
    InputError
        The file is empty, binary, has no header, or no table of at least two columns.
    """
    encoding, first = _lines_of_head(path, options.encoding)
    if options.delimiter is None:
        plain = rewritten(path, encoding, first[:HEAD_LINES], options.place)
        if plain is not None:
            return open_sheet(plain, replace(options, delimiter="\t", encoding="utf-8"))
    lines, above = _after_data_mark(first)
    delimiter = options.delimiter or _delimiter(path, lines)
    guessed = _taken_as(lines, delimiter)
    place, header = (-1, list(guessed)) if guessed is not None else _header(path, lines, delimiter)
    rows = _split(_data_lines(lines[place + 1 :]), delimiter)
    if not rows:
        raise InputError(f"{path}: a header and no rows", "at least one sample", "export a period with data")
    width = Counter(len(row) for row in rows).most_common(1)[0][0]  # rows may end with a delimiter
    names = (*(name.strip() for name in header), *[""] * (width - len(header)))
    decimal, doubt = (options.decimal, "") if options.decimal else detect_decimal(rows, delimiter)
    between, mark = DELIMITERS.get(delimiter, repr(delimiter)), "comma" if decimal == "," else "point"
    notes = [
        f"delimited text: {between} between columns, decimal {mark}, encoding {encoding}",
        "" if guessed is None else f"no header: columns are taken as {', '.join(guessed)}",
        doubt,
    ]
    sheet = Sheet(
        path,
        names,
        found=tuple(filter(None, notes)),
        decimal=decimal,
        first_row=place + above + 2,
        changed_ns=path.stat().st_mtime_ns,
        bytes=path.stat().st_size,
        encoding=encoding,
        delimiter=delimiter,
        as_written=options.date_format is not None,
    )
    return replace(sheet, types=types_of(sheet))


def detect_decimal(rows: Sequence[Sequence[str]], delimiter: str) -> tuple[str, str]:
    """Decimal mark of most numbers with a fraction, a point without any; and a word if it may be another.

    A mark before three digits in all numbers may be a thousands separator: it is one if another mark separates
    fractions, and if it is the comma of a comma-separated file.
    """
    cells = [cell.strip() for row in rows for cell in row]
    marked = {",": list(filter(COMMA_NUMBER.match, cells)), ".": list(filter(POINT_NUMBER.match, cells))}
    mark = "," if len(marked[","]) > len(marked["."]) else "."
    other = "." if mark == "," else ","
    if not marked[mark] or not all(GROUP.match(cell) for cell in marked[mark]):
        return mark, ""
    if any(not GROUP.match(cell) for cell in marked[other]):
        return other, ""
    name, seen = {",": "comma", ".": "point"}[mark], f"numbers such as {marked[mark][0]} are taken"
    if mark == delimiter:
        return other, f"{seen} as whole; state --decimal '{mark}' if their {name} is decimal"
    if delimiter == ",":
        return mark, ""
    return mark, f"{seen} with a decimal {name}; state --decimal '{other}' if it groups thousands"


def _lines_of_head(path: Path, stated: str | None) -> tuple[str, list[str]]:
    """Encoding of a text, and its first lines."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if not head.strip(b"\r\n\t \x00\xef\xbb\xbf\xff\xfe"):
        raise InputError(f"{path}: empty file", "a table with a header and samples", "export it again")
    encoding = stated or detect_encoding(head)
    try:
        text = codecs.getincrementaldecoder(encoding)().decode(head)
    except (LookupError, UnicodeError) as error:
        seen = f"{path}: not readable as {encoding}"
        raise InputError(seen, "text in the stated encoding", "state another encoding") from error
    other = "binary content" if "\x00" in text else "a JSON document" if JSON.match(text.lstrip()) else ""
    if other:
        raise InputError(f"{path}: {other}", "delimited text or Parquet", "export as CSV or Parquet")
    lines = re.split(r"\r\n|\n|\r", text)
    return encoding, lines if len(head) < HEAD_BYTES else lines[:-1]


def _after_data_mark(lines: list[str]) -> tuple[list[str], int]:
    """The first lines after a mark such as [Data], if there is one, and the number of lines above them."""
    marks = [k for k, line in enumerate(lines) if DATA_MARK.match(line)]
    above = marks[-1] + 1 if marks else 0
    return lines[above : above + HEAD_LINES], above


def _split(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO("\n".join(lines)), delimiter=delimiter))


def _cells(line: str, delimiter: str) -> list[str]:
    return next(iter(_split([line], delimiter)), [])


def _data_lines(lines: Sequence[str]) -> list[str]:
    """Lines that may be data: no comments, section marks or blanks."""
    return [line for line in lines if not NO_DATA_LINE.match(line.strip())]


def _shape(body: Sequence[str], delimiter: str) -> tuple[int, int]:
    """Number of lines that a delimiter splits into the same number of columns, and this number; 0 and 0 if none."""
    widths = Counter(len(row) for row in _split(body, delimiter) if len(row) > 1)
    width, lines = (widths.most_common(1) or [(0, 0)])[0]
    return lines, width


def _delimiter(path: Path, lines: Sequence[str]) -> str:
    """The delimiter that splits most lines into the same number of columns, including the header."""
    body = _data_lines(lines)
    shape, best = max(((_shape(body, mark), mark) for mark in DELIMITERS), key=itemgetter(0))
    if shape == (0, 0):
        seen = f"{path}: no columns; the first line is '{body[0][:60] if body else ''}'"
        raise InputError(seen, "columns separated by comma, semicolon, tab or bar", "state the delimiter")
    return best


def _header(path: Path, lines: Sequence[str], delimiter: str) -> tuple[int, list[str]]:
    """Line number (from 0) and cells of the header: of the lines above the data with the table's width, the first
    with a name of a time column; else such a line over a row of data, below a preamble that looks like data; else the
    first of them; else one after a comment sign. A table without a header has none."""
    width = _shape(_data_lines(lines), delimiter)[1]
    split = ((k, _cells(line, delimiter)) for k, line in enumerate(lines) if _data_lines([line]))
    rows = [(k, cells) for k, cells in split if len(cells) >= max(2, width - 1)]
    data = next((i for i, (_, cells) in enumerate(rows) if _is_data(cells)), len(rows))
    below = pairwise(rows[data + 1 : data + 1 + PREAMBLE_LINES])
    header = next(
        chain(
            (row for row in rows[:data] if data < len(rows) and _names_all(row[1])),
            (a for a, b in below if not _is_data(a[1]) and _is_data(b[1]) and _names_time(a[1])),
            rows[:data],
        ),
        None,
    )
    if header is not None:
        return header
    if data < len(rows):
        return _commented(path, lines, rows[data][0], delimiter)
    raise InputError(f"{path}: no header", f"a line of {width} names above the samples", "add a header line")


def _names_all(cells: Sequence[str]) -> bool:
    """Whether cells are column names: all different, all but one filled, one of them a time."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    return len(filled) >= len(cells) - 1 and len({*filled}) == len(filled) and _names_time(cells)


def _names_time(cells: Sequence[str]) -> bool:
    """Whether one of the cells is the name of a time column; a unit alone is not."""
    return any(is_stamp(cell.strip()) and without_unit(cell.strip()) for cell in cells)


def _commented(path: Path, lines: Sequence[str], data: int, delimiter: str) -> tuple[int, list[str]]:
    """A header after the last comment sign above the data."""
    above = _cells(lines[data - 1].lstrip("# "), delimiter) if data else []
    if len(above) == len(_cells(lines[data], delimiter)) and not _is_data(above):
        return data - 1, above
    seen = f"{path}: no header; row {data + 1} is already data ('{lines[data][:60]}')"
    remedy = "add a header line such as timestamp,FIC101.SP,FIC101.PV,FIC101.OP"
    raise InputError(seen, "a line of column names above the samples", remedy)


def _is_data(cells: Sequence[str]) -> bool:
    filled = [cell.strip() for cell in cells if cell.strip()]
    numbers = sum(NUMBER.match(cell) is not None for cell in filled)
    return any(STAMP.match(cell) for cell in filled) or numbers * 2 > len(filled)


def _taken_as(lines: Sequence[str], delimiter: str) -> tuple[str, ...] | None:
    """Names for the columns of a table without a header, of tag, stamp, value and quality or of a stamp and numbers;
    None for any other.

    Each of the first rows must have the same shape: a stamp, a text unlike the rest, and a number; or a stamp first
    and then only numbers, which are named by their positions (loops.csv may assign them).
    """
    rows = [row for row in _split(lines[:HEAD_LINES], delimiter) if row]
    if len(rows) < 3 or len({len(row) for row in rows}) != 1 or len(rows[0]) < 3:
        return None
    columns = [[cell.strip() for cell in column] for column in zip(*rows, strict=True)]
    # for all columns at once, because the pattern is built each time
    first = stamps.fields(pa.array([column[0] for column in columns]))
    stamped = repeat(False) if first is None else first.readable.tolist()
    kinds = list(map(_kind_of_column, columns, stamped))
    if kinds[0] == "stamp" and set(kinds[1:]) == {"number"}:
        return ("timestamp", *(UNNAMED.format(i + 1) for i in range(1, len(columns))))
    if len(columns) > 8 or kinds.count("stamp") != 1 or "text" not in kinds or "number" not in kinds:
        return None
    tag, value = (
        max((i for i in range(len(columns)) if kinds[i] == kind), key=lambda i: (len(set(columns[i])), -i))
        for kind in ("text", "number")
    )
    names = [UNNAMED.format(i + 1) for i in range(len(columns))]
    names[tag], names[kinds.index("stamp")], names[value] = "tag", "timestamp", "value"
    free = [i for i in range(len(columns)) if names[i].startswith("column")]
    coded = [i for i in free if {cell.lower() for cell in columns[i]} <= QUALITIES]
    if coded:
        names[max(coded, key=lambda i: (kinds[i] == "quality", i))] = "quality"
    return tuple(names)


def _kind_of_column(cells: Sequence[str], stamped: bool) -> str:
    """'stamp', 'number', 'quality' or 'text' if all cells of a column are of that kind; otherwise ''.

    `stamped` : whether the first one can be read as a stamp.
    """
    numbers = [float(cell.replace(",", ".")) for cell in cells if NUMBER.match(cell)]
    if NUMBER.match(cells[0]) and len(numbers) >= NUMBERS_SHARE * len(cells):
        scale = time_scale_of(pa.array(numbers))
        return "number" if scale is None or scale in SINCE_START.values() else "stamp"
    if {cell.lower() for cell in cells} <= QUALITIES:
        return "quality"
    parts = stamps.fields(pa.array(cells)) if stamped else None
    if parts is not None and parts.readable.all():
        return "stamp"
    return "text" if all(cell and not NUMBER.match(cell) for cell in cells) else ""
