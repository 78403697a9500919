"""An explanation as text for a terminal: the sentence first, then columns that line up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

from analyzer.explain.page_words import (
    FEATURES,
    HIDDEN,
    MOVED,
    ROWS,
    called,
    carried_by,
    chance,
    figure,
    found_in,
    interval,
    rms,
    share,
    spans_said,
    title,
)
from analyzer.pages.words import number
from identification.mismatch.words import check, discriminating_test, seen_ahead, two_plain_loops

WIDTH = 110
"""Columns of text."""
Rows = Sequence[Sequence[str]]


def columns(rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    """Rows as lines whose columns line up, numbers to the right; the last column wraps."""
    if not rows:
        return []
    widths = [max(len(r[i]) for r in rows) for i in range(len(rows[0]))]
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


def _part(name: str, rows: Rows, numeric: Sequence[int] = ()) -> list[str]:
    return ["", name, *columns(rows, numeric)] if rows else []


def _parameters(data: Mapping[str, Any]) -> Rows:
    return [
        (x["name"], called(k), number(v["value"]), interval(v), v["unit"])
        for x in found_in(data)
        for k, v in x["parameters"].items()
        if k not in HIDDEN
    ]


def _controller(data: Mapping[str, Any]) -> Rows:
    law = data.get("controller")
    if law is None:
        return []
    ti = "none" if law["ti_s"] is None else number(law["ti_s"])
    rows = (("Kp", number(law["kp"]), "% OP/% PV"), ("Ti", ti, "s"))
    return [*rows, ("explains", share(law["explained"]), "of OP's variance")]


def _fit(data: Mapping[str, Any]) -> Rows:
    shown = [k for k in ROWS if k in data["fit"] and (k != "explained" or data["moved"])]
    rows = [
        (ROWS[k], *(x for part in ("fitted", "held_out") for x in _misfit(data["fit"][k][part])), "")
        for k in shown
    ]
    return [("", "fitted", "fit %", "held out", "fit %", ""), *rows] if rows else []


def _others(data: Mapping[str, Any]) -> Rows:
    rows = [
        (x["recording"], rms(x["baseline"]["rmse"]), "→", rms(x["explained"]["rmse"]), share(x["share"]))
        for x in data.get("held_out_on", [])
    ]
    return [("", "plain", "", "improved", "removed"), *rows] if rows else []


def _misfit(m: Mapping[str, float]) -> tuple[str, str]:
    return rms(m["rmse"]), f"{m['fit_pct']:.1f}"


def _where(where: Mapping[str, Any]) -> Rows:
    rows = [("spans", spans_said(where["spans"]))] if where.get("spans") else []
    for key, name, unit in (("pv_range", "PV", "%"), ("op_range", "OP", "%"), ("band_s", "periods", "s")):
        if where.get(key):
            rows.append((name, f"{number(where[key][0])} to {figure(where[key][1], unit)}"))
    if where.get("direction"):
        rows.append(("direction of OP", where["direction"]))
    features = where.get("features", [])
    rows += [
        (FEATURES[f["name"]], f"{carried_by(f)} (chance {chance(f['p'])})") for f in features if f["carries"]
    ]
    rest = [FEATURES[f["name"]] for f in features if not f["carries"]]
    return [*rows, ("not tied to", ", ".join(rest))] if rest else rows


def _moved(data: Mapping[str, Any]) -> Rows:
    return [(MOVED[k][0], number(a), "→", number(b), MOVED[k][1]) for k, (a, b) in data["moved"].items()]


def lines(data: Mapping[str, Any]) -> list[str]:
    """The answer as lines of text.

    Parameters
    ----------
    data : mapping
        The contract's answer.
    """
    head = f"{data['loop']}: {title(data['verdict']) if data['fit'] else 'not told'}"
    block = f" ({data['block']})" if data["block"] != "none" else ""
    out = [head + block, *wrap(data["reason"], WIDTH), *(wrap(check(data), WIDTH) if check(data) else [])]
    out += _part("Parameters (90 % intervals)", _parameters(data), (2,))
    out += _part("Controller, as SP, PV and OP show it", _controller(data), (1,))
    out += _part("Misfit, rms in % of span", _fit(data), (1, 2, 3, 4))
    out += _part("On the recordings held out", _others(data), (1, 3, 4))
    for told in (seen_ahead(data["fit"]), two_plain_loops(data["fit"])):
        out += ["", *wrap(told, WIDTH)] if told else []
    if "brought" in data["fit"]:
        out += ["", *wrap(data["fit"]["brought"]["note"], WIDTH)]
    first = data["effects"][0] if data["effects"] else None
    if first is not None and first["held_out_share"] is not None:
        out += [
            "",
            f"{first['name']} removes {share(first['held_out_share'])} of the held-out misfit's mean square.",
        ]
    out += _part("Where", _where(data["where"]))
    out += _part("The plain loop's constants moved", _moved(data), (1, 3))
    if first is not None:
        tests = [(a, discriminating_test(first["name"], a)) for a in first["alternatives"]]
        out += _part("Could also be, and what would tell", tests)
    return out
