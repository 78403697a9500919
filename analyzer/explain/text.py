"""An explanation as text for a terminal: the sentence first, then aligned columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

from analyzer.explain import words
from analyzer.explain.words import places, share, title
from analyzer.pages.words import number
from analyzer.words.decision import decided
from identification.mismatch.words import check, remarks
from reports.pages import Table

WIDTH = 110
"""Columns of text."""
Rows = Sequence[Sequence[str]]


def answer_lines(data: Mapping[str, Any]) -> list[str]:
    """The contract's answer as lines of text."""
    fit = data["fit"]
    head = f"{data['loop']}: {title(data['verdict']) if fit else 'not explained'}"
    block = f" ({data['block']})" if data["block"] != "none" else ""
    night = data.get("night")
    out = [*wrap(decided(data), WIDTH), ""] if night else []
    improvement = words.improvement(data) if fit else ""
    night_note = words.night_note(night, data["verdict"], data["block"]) if night and fit else ""
    texts = (data["reason"], improvement, night_note, check(data))
    out += [
        head + block,
        *(line for text in texts for line in wrap(text, WIDTH)),
    ]
    out += _part("Parameters (90 % intervals)", _texts(words.parameters(data)), (2,))
    out += _part("Controller, as SP, PV and OP show it", _controller_rows(data), (1,))
    simulations = _headed(("", "fitted", "fit %", "held out", "fit %"), _texts(words.misfits(data)))
    out += _part("Misfit, rms in % of span", [(*row, "") for row in simulations], (1, 2, 3, 4))
    others = [(name, plain, "→", *rest) for name, plain, *rest in _texts(words.others(data))]
    held_out = _headed(("", "baseline", "", "improved", "removed"), others)
    out += _part("On the recordings held out", held_out, (1, 3, 4))
    user_model = fit.get("brought", {}).get("note", "")
    for sentence in filter(None, (words.no_better(data), *remarks(fit), user_model)):
        out += ["", *wrap(sentence, WIDTH)]
    out += _part("Where", _where_rows(data))
    moved = [(name, before, "→", after, unit) for name, before, after, _, unit in _texts(words.moved(data))]
    out += _part("Changed constants of the baseline model", moved, (1, 3))
    return out + _part("Alternatives, and the test that distinguishes them", _texts(words.alternatives(data)))


def _part(name: str, rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    return ["", name, *lined_up(rows, numeric)] if rows else []


def _headed(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    return [head, *rows] if rows else []


def lined_up(rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    """Rows as lines with aligned columns, numbers to the right; the last column wraps."""
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    indent = 2 + sum(widths[:-1]) + 2 * (len(widths) - 1)
    out = []
    for row in rows:
        cells = [
            c.rjust(w) if i in numeric else c.ljust(w)
            for i, (c, w) in enumerate(zip(row, widths, strict=True))
        ]
        last = wrap(row[-1], max(WIDTH - indent, 30)) if len(cells[-1]) + indent > WIDTH else [cells[-1]]
        first, *more = last or [""]
        out.append(("  " + "  ".join([*cells[:-1], first])).rstrip())
        out += [" " * indent + m for m in more]
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


def _where_rows(data: Mapping[str, Any]) -> Rows:
    features = _texts(words.features(data))
    rest = ", ".join(name for name, _, carries, _ in features if carries == "no")
    return [
        *(
            (name if name.isupper() else name[:1].lower() + name[1:], at)
            for name, at in places(data["where"])
        ),
        *((name, f"{how} (p-value {p})") for name, p, carries, how in features if carries == "yes"),
        *([("not significant", rest)] if rest else []),
    ]
