"""The time for long lines and cells grows with their length and not with its square."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
from identification.errors import InputError

ROWS = "".join(f"2024-11-21 08:00:{k:02d},{k / 4},{k}\n" for k in range(60))
HEAD = "time,a.PV,a.OP\n"
LONG = 100_000
"""Characters: a time proportional to the square would be minutes, and to the length milliseconds."""
FIRST = "2024-11-21 07:00:00,"
LINES = {
    "points": HEAD + "a.b." * (LONG // 4) + "\n" + ROWS,
    "points before a blank": "a.b." * (LONG // 4) + " ;\n" + HEAD + ROWS,
    "a title and blanks": "tag: a" + " " * LONG + ".b\n" + HEAD + ROWS,
    "a title and points": "tag: " + ". " * (LONG // 2) + "\n" + HEAD + ROWS,
    "digits": HEAD + FIRST + "1" * LONG + ",3\n" + ROWS,
    "digits and a letter": HEAD + FIRST + "1" * LONG + "x,3\n" + ROWS,
    "grouped digits": HEAD + FIRST + "1'" * (LONG // 2) + "x,3\n" + ROWS,
    "digits and a minus": HEAD + FIRST + "1" * LONG + "--,3\n" + ROWS,
    "a stamp of zeros": HEAD + "0" * LONG + ":00:00,1,3\n" + ROWS,
    "a stamp of blanks": HEAD + "2024-11-21" + " " * LONG + "x,1,3\n" + ROWS,
    "a name of blanks": HEAD.replace("time", "time" + " " * LONG + "x") + ROWS,
    "marks of error": HEAD + FIRST + "?" * LONG + "x,3\n" + ROWS,
    "words": "a " * (LONG // 2) + "\n" + HEAD + ROWS,
}


ORDINARY = HEAD + ROWS * (LONG // len(ROWS))
"""The same number of characters in ordinary lines; its reading time is the reference."""


def read(folder: Path, text: str) -> tuple[int, float]:
    """Length of the longest message about an export of this text, and its processor time [s]."""
    (folder / "x.csv").write_text(text, encoding="utf-8")
    begun = time.process_time()
    try:
        export = open_export([folder / "x.csv"], ReadOptions(scratch=folder))
        export.span()
        export.read(export.tags)
        longest = max(map(len, export.notes), default=0)
    except InputError as error:
        longest = len(str(error))
    return longest, time.process_time() - begun


@pytest.mark.parametrize("what", LINES)
def test_a_long_line_is_read_in_time(tmp_path: Path, what: str) -> None:
    """An export with one long line takes at most a hundred times the time of an ordinary one of its size, with short
    notes.
    """
    floor = max(read(tmp_path, ORDINARY)[1] for _ in range(2))
    longest, cost = read(tmp_path, LINES[what])
    assert cost < 100 * floor
    assert longest < 1000
