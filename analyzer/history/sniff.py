"""How a delimited text is written: encoding, delimiter, decimal mark, where its header stands."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from analyzer.history.encoding import detect_encoding
from analyzer.history.headerless import taken_as
from analyzer.history.names import is_stamp, without_unit
from analyzer.history.rewritten import rewritten
from analyzer.history.sheet import Sheet
from analyzer.history.table import ReadOptions
from identification.errors import InputError

HEAD_BYTES = 1_000_000
HEAD_LINES = 200
DELIMITERS = (",", ";", "\t", "|")
DELIMITER_NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}
NO_DATA_LINE = re.compile(r"^(?:#.*|\[\w+\]|sep=.?|)$", re.IGNORECASE)
COMMA_NUMBER = re.compile(r"^[+-]?\d+,\d+(?:[eE][+-]?\d+)?$")
POINT_NUMBER = re.compile(r"^[+-]?\d*\.\d+(?:[eE][+-]?\d+)?$")
NUMBER = re.compile(r"^[+-]?(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?$")
GROUP = re.compile(r"^[+-]?[1-9]\d{0,2}[.,]\d{3}$")
"""A number whose mark may be decimal or may group thousands."""
DATA_MARK = re.compile(r"^\s*\[data\]\s*$", re.IGNORECASE)
JSON = re.compile(r"^(?:\{\s*[\"}]|\[\s*[\[{\"])")
PREAMBLE = 30
"""Lines of a preamble at most under which a header is looked for; ours."""
STAMP = re.compile(r"^\d{1,4}[-/.]\w{1,9}[-/.]\d{1,4}\b|^\d{1,2}:\d\d\b")


def open_sheet(path: Path, options: ReadOptions) -> Sheet:
    """Find out how a delimited text is written.

    Raises
    ------
    InputError
        The file is empty, binary, has no header, or no table of at least two columns.
    """
    head = _head(path)
    encoding = options.encoding or detect_encoding(head)
    first = _lines(path, head, encoding)
    plain = (
        rewritten(path, encoding, first[:HEAD_LINES], options.scratch) if options.delimiter is None else None
    )
    if plain is not None:
        return open_sheet(plain, replace(options, delimiter="\t", encoding="utf-8"))
    lines, above = _after_data_mark(first)
    delimiter = options.delimiter or _delimiter(path, lines)
    guessed = taken_as(lines, delimiter)
    place, header = (-1, list(guessed)) if guessed is not None else _header(path, lines, delimiter)
    rows = _split([line for line in lines[place + 1 :] if not NO_DATA_LINE.match(line.strip())], delimiter)
    if not rows:
        raise InputError(f"{path}: a header and no rows", "at least one sample", "export a period with data")
    names = _padded(tuple(name.strip() for name in header), rows)
    decimal, doubt = (options.decimal, "") if options.decimal else detect_decimal(rows, delimiter)
    stat = path.stat()
    skipped = place + 1 + above
    sheet = Sheet(path, stat.st_mtime_ns, stat.st_size, encoding, delimiter, decimal, skipped, names)
    said = [] if guessed is None else [f"no header: columns are taken as {', '.join(guessed)}"]
    said += [doubt] if doubt else []
    return _described(replace(sheet, as_written=options.date_format is not None), tuple(said))


def detect_decimal(rows: Sequence[Sequence[str]], delimiter: str) -> tuple[str, str]:
    """Decimal mark of most numbers with a fraction, a point where there are none; and a word where it may be another.

    A mark before three digits in all numbers may group thousands: it does where another mark parts fractions, and
    where it is the comma of a file whose columns commas part.
    """
    cells = [cell.strip() for row in rows for cell in row]
    marked = {",": _all(COMMA_NUMBER, cells), ".": _all(POINT_NUMBER, cells)}
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


def _all(pattern: re.Pattern[str], cells: Sequence[str]) -> list[str]:
    return [cell for cell in cells if pattern.match(cell)]


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if not head.strip(b"\r\n\t \x00\xef\xbb\xbf\xff\xfe"):
        raise InputError(f"{path}: empty file", "a table with a header and samples", "export it again")
    return head


def _lines(path: Path, head: bytes, encoding: str) -> list[str]:
    try:
        text = codecs.getincrementaldecoder(encoding)().decode(head)
    except (LookupError, UnicodeError) as error:
        raise InputError(
            f"{path}: not readable as {encoding}", "text in the stated encoding", "state another encoding"
        ) from error
    if "\x00" in text:
        raise InputError(f"{path}: binary content", "delimited text or Parquet", "export as CSV or Parquet")
    lines = re.split(r"\r\n|\n|\r", text)
    whole = lines if len(head) < HEAD_BYTES else lines[:-1]
    if JSON.match(text.lstrip()):
        raise InputError(f"{path}: a JSON document", "delimited text or Parquet", "export as CSV or Parquet")
    return whole


def _after_data_mark(lines: list[str]) -> tuple[list[str], int]:
    """The first lines behind a mark such as [Data], where there is one, and how many lines stand above them."""
    marks = [k for k, line in enumerate(lines) if DATA_MARK.match(line)]
    above = marks[-1] + 1 if marks else 0
    return lines[above : above + HEAD_LINES], above


def _split(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO("\n".join(lines)), delimiter=delimiter))


def _widths(lines: Sequence[str], delimiter: str) -> Counter[int]:
    return Counter(len(row) for row in _split(lines, delimiter) if len(row) > 1)


def _delimiter(path: Path, lines: Sequence[str]) -> str:
    """The delimiter that splits most lines into the same number of columns, the header among them."""
    body = [line for line in lines if not NO_DATA_LINE.match(line.strip())]
    scores = {mark: _score(body, mark) for mark in DELIMITERS}
    best = max(DELIMITERS, key=lambda mark: scores[mark])
    if scores[best] == (0, 0):
        raise InputError(
            f"{path}: no columns; the first line is '{body[0][:60] if body else ''}'",
            "columns separated by comma, semicolon, tab or bar",
            "state the delimiter",
        )
    return best


def _score(body: Sequence[str], mark: str) -> tuple[int, int]:
    widths = _widths(body, mark)
    if not widths:
        return 0, 0
    width, lines = widths.most_common(1)[0]
    return lines, width


def _header(path: Path, lines: Sequence[str], delimiter: str) -> tuple[int, list[str]]:
    """Line number (from 0) and cells of the header: of the lines as wide as the table above its data the first with a
    name of a time column, else the first."""
    body = [line for line in lines if not NO_DATA_LINE.match(line.strip())]
    width = _widths(body, delimiter).most_common(1)[0][0]
    above: list[tuple[int, list[str]]] = []
    for place, line in enumerate(lines):
        cells = next(iter(_split([line], delimiter)), [])
        if NO_DATA_LINE.match(line.strip()) or len(cells) < max(2, width - 1):
            continue
        if not _is_data(cells):
            above.append((place, cells))
            continue
        named = next(((k, names) for k, names in above if _names_all(names)), None)
        below = None if named is not None else _header_below(lines, place, delimiter, width)
        found = named or below or next(iter(above), None)
        return found if found is not None else _commented(path, lines, place, delimiter)
    if above:
        return above[0]
    raise InputError(f"{path}: no header", f"a line of {width} names above the samples", "add a header line")


def _names_all(cells: Sequence[str]) -> bool:
    """Whether cells are the names of a table's columns: each another, all but one of them filled, one of a time."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    return len(filled) >= len(cells) - 1 and len({*filled}) == len(filled) and _names_time(cells)


def _names_time(cells: Sequence[str]) -> bool:
    """Whether one of some cells is the name of a time column; a unit alone is none."""
    return any(is_stamp(cell.strip()) and without_unit(cell.strip()) for cell in cells)


def _header_below(
    lines: Sequence[str], start: int, delimiter: str, width: int
) -> tuple[int, list[str]] | None:
    """A header under lines of a preamble that look like data: as wide as the table, no data, over a row of data.

    Within a few lines, with a name of a time column among its cells; a table without a header has none.
    """
    rows = [(k, next(iter(_split([lines[k]], delimiter)), [])) for k in range(start + 1, len(lines))][
        :PREAMBLE
    ]
    for (place, cells), (_, after) in pairwise(rows):
        if len(cells) >= width - 1 and _names_time(cells) and not _is_data(cells) and _is_data(after):
            return place, cells
    return None


def _commented(path: Path, lines: Sequence[str], data: int, delimiter: str) -> tuple[int, list[str]]:
    """A header that stands behind the last comment sign above the data."""
    wide = len(_split([lines[data]], delimiter)[0])
    above = _split([lines[data - 1].lstrip("# ")], delimiter) if data else []
    if above and len(above[0]) == wide and not _is_data(above[0]):
        return data - 1, above[0]
    raise InputError(
        f"{path}: no header; row {data + 1} is already data ('{lines[data][:60]}')",
        "a line of column names above the samples",
        "add a header line such as timestamp,FIC101.SP,FIC101.PV,FIC101.OP",
    )


def _is_data(cells: Sequence[str]) -> bool:
    filled = [cell.strip() for cell in cells if cell.strip()]
    return any(STAMP.match(cell) for cell in filled) or sum(map(_is_number, filled)) * 2 > len(filled)


def _is_number(cell: str) -> bool:
    return NUMBER.match(cell) is not None


def _padded(names: tuple[str, ...], rows: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Rows that end with a delimiter have a last column without a name."""
    width = Counter(len(row) for row in rows).most_common(1)[0][0]
    return names + ("",) * (width - len(names))


def _described(sheet: Sheet, said: tuple[str, ...] = ()) -> Sheet:
    types = tuple(array.type for array in sheet.head(range(len(sheet.names))))
    named = DELIMITER_NAMES.get(sheet.delimiter, repr(sheet.delimiter))
    mark = "comma" if sheet.decimal == "," else "point"
    note = f"delimited text: {named} between columns, decimal {mark}, encoding {sheet.encoding}"
    return replace(sheet, types=types, found=(note, *said))
