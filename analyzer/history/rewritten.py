"""Unusual layouts converted to plain tables: blocks of one tag after another, columns separated by blanks, and long
tables with tags in several columns."""

from __future__ import annotations

import csv
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from analyzer.history.table import COLUMNS, NAME_LENGTH, any_of, first_named, plain

LAYOUT_LINES = 12  # Lines within which a layout that is not a table is detected [lines]

DELIMITERS = (";", "\t", "|", ",")
TITLE = re.compile(rf"^\W*(?:{any_of('title')})\s*[:=]\s*(?P<tag>\S.*)$", re.IGNORECASE)
BARE_TITLE = re.compile(r"^\"?(?P<tag>[^\s\",;|A-Za-z]*[A-Za-z][^\s\",;|._:/-]*[._:/-][^\s\",;|]*)\"?$")
BEHIND = re.compile(r"\W+$")
STAMPED = re.compile(r"^\s*\"?\d{1,4}[-/. ]\w{1,10}[-/. ]\d{1,4}\b")
NUMBERED = re.compile(r"^[+-]?\d[\d.:/T+-]*Z?$")
"""Beginning of a row of data: a stamp or a number."""
GAP = re.compile(r"\s{2,}")
RULE = re.compile(r"^\s*-{3,}(?:\s+-{3,})+\s*$")

Rewrite = Callable[[Iterator[str]], Iterator[Sequence[str]]]


def rewritten(path: Path, encoding: str, lines: Sequence[str], place: Path) -> Path | None:
    """A plain table from a file in one of these layouts, tab-separated, in UTF-8; None for any other file.

    `lines` are the file's first ones; the copy is written under `place`.
    """
    filled = [line for line in lines if line.strip()]
    rewrite = _blocks(filled) or _in_parts(filled) or _columns(filled[: 4 * LAYOUT_LINES])
    if rewrite is None:
        return None
    out = Path(tempfile.mkdtemp(prefix="rewritten-", dir=place)) / path.name
    with (
        path.open(encoding=encoding, errors="replace", newline=None) as source,
        out.open("w", encoding="utf-8") as file,
    ):
        for cells in rewrite(source):
            file.write("\t".join(cell.replace("\t", " ") for cell in cells) + "\n")
    return out


def _title(line: str) -> str:
    """The tag, if a line is the title above its samples; otherwise ''."""
    if len(line) > NAME_LENGTH:
        return ""
    found = TITLE.match(line) or BARE_TITLE.match(line.strip())
    if found is None or STAMPED.match(line):
        return ""
    tag: str = found["tag"].strip()
    return (BEHIND.sub("", tag) or tag[:1]) if found.re is TITLE else tag.strip('"')


def _blocks(filled: Sequence[str]) -> Rewrite | None:
    """Reader for blocks of one tag after another, if the first lines are such a block."""
    at = next((k for k, line in enumerate(filled[:LAYOUT_LINES]) if _title(line)), None)
    if at is None:
        return None
    below = filled[at + 1 : at + 4]
    first = next((k for k, line in enumerate(below) if STAMPED.match(line)), None)
    if first is None or len(filled) < at + first + 4 or any(_title(line) for line in below[:first]):
        return None
    delimiter = next((d for d in DELIMITERS if d in below[first]), None)
    if delimiter is None or not 2 <= len(below[first].split(delimiter)) <= 4 or first > 1:
        return None

    def rows(source: Iterator[str]) -> Iterator[Sequence[str]]:
        yield "tag", "timestamp", "value", "quality"
        tag = ""
        for line in source:
            if not STAMPED.match(line):
                tag = _title(line) or tag
            elif tag:
                cells = [cell.strip().strip('"') for cell in line.rstrip("\n").split(delimiter)]
                yield [tag, *cells, *(["good"] if len(cells) < 3 else [])][:4]

    return rows


def _in_parts(filled: Sequence[str]) -> Rewrite | None:
    """Reader for a long table with only the role, PV or OP, as tag, and the loop in other columns."""
    lines = [line for line in filled if not line.startswith("#")]
    delimiter = max(DELIMITERS, key=lines[0].count) if lines else ""
    head, *rest = list(csv.reader(lines, delimiter=delimiter)) if lines else [[]]
    tag = first_named(head, COLUMNS["tag"])
    parts = [i for i, name in enumerate(head) if plain(name) in COLUMNS["name_part"] and i != tag]
    rows_here = [row for row in rest if len(row) == len(head) and row != head]
    if tag is None or not parts or len(rows_here) < len(rest) - 1 or not rows_here:
        return None
    if not all(plain(row[tag]) in COLUMNS["bare_ending"] for row in rows_here):
        return None
    kept = [i for i in range(len(head)) if i not in parts]

    def rows(source: Iterator[str]) -> Iterator[Sequence[str]]:
        yield [head[i] for i in kept]
        held = (line for line in source if line.strip() and not line.startswith("#"))
        for row in csv.reader(held, delimiter=delimiter):
            if len(row) == len(head) and row != head:
                loop = "/".join(row[i].strip() for i in parts if row[i].strip())
                yield [f"{loop}.{row[i].strip()}" if i == tag else row[i] for i in kept]

    return rows


def _columns(filled: Sequence[str]) -> Rewrite | None:
    """Reader for columns separated by blanks, if the first lines have such columns and no delimiter: below a ruled
    line by its strokes, by two blanks or more, or by one."""
    if len(filled) < 4 or any(d in line for d in DELIMITERS for line in filled[:4]):
        return None
    rule = next((line for line in filled[:LAYOUT_LINES] if RULE.match(line)), "")
    edges = [m.start() for m in re.finditer(r"(?<!\S)-", rule)]

    def cells(line: str) -> list[str]:
        if edges:
            return [line[a:b].strip() for a, b in zip(edges, [*edges[1:], None], strict=True)]
        return GAP.split(line.strip())

    widths = [len(cells(line)) for line in filled if not RULE.match(line)]
    if widths[0] < 2 or sum(w == widths[0] for w in widths) < 0.9 * len(widths):
        return _words(filled)

    def rows(source: Iterator[str]) -> Iterator[Sequence[str]]:
        found = (cells(line) for line in source if line.strip() and not RULE.match(line))
        return (row for row in found if len(row) == widths[0])

    return rows


def _words(filled: Sequence[str]) -> Rewrite | None:
    """Reader for columns separated by one blank, below a header of the same width, or one word narrower if a stamp is
    a date and a time of day under one name."""
    head, *rest = [line.split() for line in filled]
    more = Counter(map(len, rest)).most_common(1)[0][0] - len(head)
    fitting = sum(len(row) == len(head) + more and NUMBERED.match(row[0]) is not None for row in rest)
    if len(head) < 2 or more not in (0, 1) or fitting < max(3, 0.9 * len(rest)) or NUMBERED.match(head[0]):
        return None

    def rows(source: Iterator[str]) -> Iterator[Sequence[str]]:
        yield head
        for line in source:
            found = line.split()
            if len(found) == len(head) + more and found != head:
                yield [" ".join(found[: more + 1]), *found[more + 1 :]]

    return rows
