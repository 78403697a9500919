"""A row of a draft of loops.csv, and the draft as text."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace

from analyzer.finder.pair import SURE_PCT
from analyzer.loops.spec import COLUMNS as STATED_COLUMNS
from analyzer.loops.spec import RECORDED, ROLES, LoopSpec

COLUMNS = (
    *(
        "loop",
        "type",
        "master",
        "ratio_of",
        *ROLES,
        "pv_lo",
        "pv_hi",
        "pv_unit",
        "op_lo",
        "op_hi",
        *("kp", "ti", "td", "td_filter", "pv_filter_s"),
        "gain_unit",
        "ti_unit",
    ),
    *("scan_s", "ranges", "found_by", "sure_pct", "says"),
)


SETTINGS = ("kp", "ti", "td", "td_filter", "pv_filter_s", "gain_unit")
"""Columns of the settings found by data."""


HEAD = (
    "# A draft. Check first: rows found by data, then ranges that are only recorded (column ranges), then settings.",
    f"# Rows after a # have a confidence below {SURE_PCT:g} %: remove the # if the row is correct.",
)


@dataclass(frozen=True, slots=True)
class Row:
    """A loop of the draft: its row, its source ('names', 'data', 'stated', or 'recorded' if the loop is stated and
    its settings are identified from data), its confidence [%], the evidence for it, and whether its range of OP is
    known: not where OP looks like a current."""

    spec: LoopSpec
    found_by: str
    sure_pct: float
    evidence: str = ""
    op_ranged: bool = True

    @property
    def sure(self) -> bool:
        """Whether the row is confident enough; otherwise it is written commented out."""
        return self.sure_pct >= SURE_PCT

    @property
    def as_run(self) -> LoopSpec:
        """The loop as used in the batch run: a range that is only recorded does not count as stated."""
        return replace(self.spec, pv_lo=None, pv_hi=None)


def as_csv(rows: Sequence[Row]) -> str:
    """The draft as loops.csv; rows of low confidence are commented out."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    stated = {name for row in rows for name in row.spec.stated}
    columns = [*COLUMNS, *(name for name in STATED_COLUMNS if name in stated and name not in COLUMNS)]
    writer.writerow(columns)
    out.write("\n".join(HEAD) + "\n")
    for row in rows:
        at = out.tell()
        writer.writerow([_cell(row, column) for column in columns])
        if not row.sure:
            line = out.getvalue()[at:]
            out.seek(at)
            out.write(f"# {line}")
    return out.getvalue()


def _cell(row: Row, column: str) -> str:
    own = {
        "ranges": RECORDED if row.found_by not in ("stated", RECORDED) and row.spec.has_pv_range else "",
        "found_by": row.found_by,
        "sure_pct": f"{row.sure_pct:.0f}",
        "says": row.evidence,
    }
    if column in own:
        return own[column]
    if column in ("op_lo", "op_hi") and not row.op_ranged:
        return ""
    value = getattr(row.spec, column)
    settings = column in (*SETTINGS, "ti_unit")
    seen = (
        row.spec.kp is not None
        if settings
        else row.spec.has_pv_range or column in ("type", "master", "ratio_of", "pv_unit")
    )
    spoken = (
        (row.found_by not in ("stated", RECORDED) and seen)
        or column in row.spec.stated
        or column in ("loop", *ROLES)
    )
    if value is None or not spoken or (column == "pv_filter_s" and not value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
