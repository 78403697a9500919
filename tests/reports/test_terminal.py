"""Tables for a terminal are identical to those of rich, which takes twenty times as long."""

from __future__ import annotations

import numpy as np
import pytest
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reports.pages import Column
from reports.plain import table

HEADINGS = (
    Column("loop", "Loop"),
    Column("error", "Error %", numeric=True),
    Column("kp", "Kp"),
    Column("reason", "Reason", wide=True),
)
WORDS = ("cycles", "every", "10.2", "min:", "the", "valve", "sticks", "by", "5", "%", "\u03a4\u0399\u039a-1")


def drawn(rows: list[list[str]], width: int) -> list[str]:
    """The lines of headings and rows as rich draws them."""
    slow = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for h in HEADINGS:
        slow.add_column(h.title, justify="right" if h.numeric else "left", no_wrap=not h.wide)
    for row in rows:
        slow.add_row(*map(Text, row))
    console = Console(width=width)
    with console.capture() as capture:
        console.print(slow)
    lines = [line.rstrip() for line in capture.get().splitlines()]
    return [line for line in lines if line and set(line) != {" ", "\u2500"}]


@pytest.mark.parametrize("width", [70, 100, 180])
def test_a_table_is_the_one_that_rich_draws(width: int) -> None:
    """Each line and each blank is identical to rich's table, also with names in other scripts."""
    rng = np.random.default_rng(3)
    rows = [
        [
            f"{WORDS[rng.integers(len(WORDS))]}{k}",
            f"{rng.uniform(0, 100):.3g}",
            "" if k % 3 else f"{rng.uniform(0, 9):.3g} -> {rng.uniform(0, 9):.3g} %/%",
            " ".join(WORDS[i] for i in rng.integers(0, len(WORDS), rng.integers(0, 40))),
        ]
        for k in range(60)
    ]
    head, body = table(HEADINGS, rows, width)
    assert [head, *(line for lines in body for line in lines)] == drawn(rows, width)


def test_a_tag_is_never_cut() -> None:
    """A tag is printed in full on a terminal that is too narrow for it."""
    _, ((first, *_),) = table(HEADINGS, [["x" * 50, "1", "", "a reason"]], 40)
    assert "x" * 50 in first


def test_wide_characters_keep_the_line() -> None:
    """A reason in characters of double width loses no character, and its lines end before the terminal's width."""
    text = " ".join(["\u6d41\u91cf\u8ba1"] * 40)
    _, (lines,) = table(HEADINGS, [["FIC1", "1", "", text]], 80)
    assert "".join(lines).count("\u6d41\u91cf\u8ba1") == 40
    assert max(map(cell_len, lines)) < 80
