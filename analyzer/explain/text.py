"""An explanation as text for a terminal: the sentence first, then columns that line up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

from analyzer.explain import words
from analyzer.explain.words import places, share, title
from analyzer.pages.words import number
from identification.mismatch.words import check, seen_ahead, two_plain_loops
from reports.pages import Table

WIDTH = 110
"""Columns of text."""
Rows = Sequence[Sequence[str]]


def answer_lines(data: Mapping[str, Any]) -> list[str]:
    """The answer as lines of text.

    Parameters
    ----------
    data : mapping
        The contract's answer.
    """
    head = f"{data['loop']}: {title(data['verdict']) if data['fit'] else 'not told'}"
    block = f" ({data['block']})" if data["block"] != "none" else ""
    out = [head + block, *wrap(data["reason"], WIDTH), *wrap(check(data), WIDTH)]
    out += _titled_part("Parameters (90 % intervals)", _texts(words.parameters(data)), (2,))
    out += _titled_part("Controller, as SP, PV and OP show it", _controller_rows(data), (1,))
    out += _titled_part("Misfit, rms in % of span", _fit_rows(data), (1, 2, 3, 4))
    out += _titled_part("On the recordings held out", _others(data), (1, 3, 4))
    out += _wrapped(seen_ahead(data["fit"])) + _wrapped(two_plain_loops(data["fit"]))
    out += _wrapped(data["fit"].get("brought", {}).get("note", ""))
    for first in data["effects"][:1]:
        if first["held_out_share"] is not None:
            removed = share(first["held_out_share"])
            out += _wrapped(f"{first['name']} removes {removed} of the held-out misfit's mean square.")
    out += _titled_part("Where", _where_rows(data))
    out += _titled_part("The plain loop's constants moved", _moved(data), (1, 3))
    return out + _titled_part("Could also be, and what would tell", _texts(words.alternatives(data)))


def _wrapped(sentence: str) -> list[str]:
    return ["", *wrap(sentence, WIDTH)] if sentence else []


def _titled_part(name: str, rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    return ["", name, *lined_up(rows, numeric)] if rows else []


def lined_up(rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    """Rows as lines whose columns line up, numbers to the right; the last column wraps."""
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    left = 2 + sum(widths[:-1]) + 2 * (len(widths) - 1)
    out = []
    for row in rows:
        cells = [
            c.rjust(w) if i in numeric else c.ljust(w)
            for i, (c, w) in enumerate(zip(row, widths, strict=True))
        ]
        last = wrap(row[-1], max(WIDTH - left, 30)) if len(cells[-1]) + left > WIDTH else [cells[-1]]
        first, *more = last or [""]
        out.append(("  " + "  ".join([*cells[:-1], first])).rstrip())
        out += [" " * left + m for m in more]
    return out


def _texts(table: Table) -> list[tuple[str, ...]]:
    return [tuple(cell.text for cell in row) for row in table.rows]


def _controller_rows(data: Mapping[str, Any]) -> Rows:
    law = data.get("controller")
    if law is None:
        return []
    ti = "none" if law["ti_s"] is None else number(law["ti_s"])
    rows = (("Kp", number(law["kp"]), "% OP/% PV"), ("Ti", ti, "s"))
    return [*rows, ("explains", share(law["explained"]), "of OP's variance")]


def _fit_rows(data: Mapping[str, Any]) -> Rows:
    rows = [(*row, "") for row in _texts(words.misfits(data))]
    return [("", "fitted", "fit %", "held out", "fit %", ""), *rows] if rows else []


def _others(data: Mapping[str, Any]) -> Rows:
    rows = [
        (name, plain, "→", better, removed) for name, plain, better, removed in _texts(words.others(data))
    ]
    return [("", "plain", "", "improved", "removed"), *rows] if rows else []


def _moved(data: Mapping[str, Any]) -> Rows:
    return [(name, before, "→", after, unit) for name, before, after, _, unit in _texts(words.moved(data))]


def _where_rows(data: Mapping[str, Any]) -> Rows:
    rows = [
        (name if name.isupper() else name[:1].lower() + name[1:], text)
        for name, text in places(data["where"])
    ]
    features = _texts(words.features(data))
    rows += [
        (name, f"{how} (chance {chance})") for name, chance, carries, how in features if carries == "yes"
    ]
    rest = ", ".join(name for name, _, carries, _ in features if carries == "no")
    return [*rows, ("not tied to", rest)] if rest else rows
