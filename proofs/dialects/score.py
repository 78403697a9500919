"""How exports of other products are read: python -m proofs.dialects.score [CASE...]

An independent generator, `make.py`, writes the exports; it shares no code with the readers. They are read and
compared with their truths sample by sample. Without CASE the command writes score.md here.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.history.export import open_export
from analyzer.history.series import Series
from analyzer.history.table import ReadOptions
from identification.errors import TriageError
from proofs.common import publish
from proofs.dialects.make import main as make

CLOSE_S = 0.03
"""Stamps count as equal within this difference [s]: serial numbers of days have no more digits."""
WARNS = ("state ", "in autumn", "in spring", "out of order", "no date", "since the start", "repeat a stamp")
"""Words in notes which report that some information could not be determined."""


@dataclass(frozen=True)
class Outcome:
    """The result of a case: right, wrong or refused; the error, or the refusal; whether a note warned of it."""

    case: str
    family: str
    kind: str
    verdict: str
    detail: str = ""
    warned: bool = False


def differences(series: Series, want: Mapping[str, Any], uncertain: list[int]) -> str:
    """The errors in the good samples of a tag; '' where there is none."""
    t = np.array(want["t"], float)
    v = np.array([np.nan if x is None else x for x in want["v"]], float)
    kept = ~series.bad & np.isfinite(series.value)
    stamp, value = series.stamp_s[kept], series.value[kept]
    if stamp.size == 0:
        return f"none of {np.isfinite(v).sum()} good samples" if np.isfinite(v).any() else ""
    near = np.clip(np.searchsorted(stamp, t - CLOSE_S), 0, stamp.size - 1)
    there = np.abs(stamp[near] - t) < CLOSE_S
    good = np.isfinite(v)
    missing = int((good & ~there).sum())
    other = int((good & there & (np.abs(value[near] - v) > 1e-6 * np.maximum(1.0, np.abs(v)))).sum())
    doubtful = np.zeros(t.size, bool)
    doubtful[uncertain] = True
    bad = int((~good & there & ~doubtful).sum())
    ordered = np.sort(t)
    place = np.clip(np.searchsorted(ordered, stamp - CLOSE_S), 0, t.size - 1)
    extra = int((np.abs(ordered[place] - stamp) > 2 * CLOSE_S).sum())
    result = {"missing": missing, "of another value": other, "bad read as good": bad, "too many": extra}
    return ", ".join(f"{n} {what}" for what, n in result.items() if n)


def name_of(tag: str, aliases: list[str], held: tuple[str, ...]) -> str | None:
    """The name of the tag, or a permitted alias, as the reader names it."""
    folded = {name.casefold(): name for name in held}
    return next((folded[n.casefold()] for n in (tag, *aliases) if n.casefold() in folded), None)


def outcome(case: Mapping[str, Any], folder: Path) -> Outcome:
    """Read one case and compare it."""
    head = case["case"], case["family"], case["kind"]
    try:
        options = ReadOptions(**case["options"], scratch=folder)
        export = open_export([folder / p for p in case["paths"]], options)
        names = {t: name_of(t, case.get("aliases", {}).get(t, []), export.tags) for t in case["tags"]}
        held = [n for n in names.values() if n is not None]
        series = export.read(held) if held else {}
        notes = " / ".join(export.notes)
    except TriageError as error:
        return Outcome(*head, "refused", str(error))
    wrong = [f"no tag {tag}" for tag, name in names.items() if name is None]
    for tag, name in names.items():
        if name is not None:
            found = differences(series[name], case["tags"][tag], case.get("uncertain", {}).get(tag, []))
            wrong += [f"{tag}: {found}"] if found else []
    warned = any(word in notes for word in WARNS)
    return Outcome(*head, "wrong" if wrong else "right", "; ".join(wrong), warned)


def outcomes(folder: Path, only: list[str] | None = None) -> list[Outcome]:
    """All cases, or some of them, made in a folder and read."""
    make(folder)
    cases = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return [outcome(case, folder) for case in cases if not only or case["case"] in only]


def table(found: list[Outcome]) -> str:
    """Counts by family as Markdown, and the cases that are not right."""
    lines = ["| family | exports | right | refused | wrong |", "|---|--:|--:|--:|--:|"]
    plain = [o for o in found if o.kind == "plain"]
    for family in sorted({o.family for o in plain}):
        counts = Counter(o.verdict for o in plain if o.family == family)
        lines.append(
            f"| {family} | {counts.total()} | {counts['right']} | {counts['refused']} | {counts['wrong']} |"
        )
    counts = Counter(o.verdict for o in plain)
    lines.append(f"| all | {len(plain)} | {counts['right']} | {counts['refused']} | {counts['wrong']} |")
    lines += ["", "Refused or wrong, although they can be read:", ""]
    lines += [
        f"- {o.case}: {o.verdict}. {o.detail.rsplit('/', 1)[-1]}" for o in plain if o.verdict != "right"
    ]
    refuse = [o for o in found if o.kind == "refuse"]
    lines += ["", f"To be refused: {sum(o.verdict == 'refused' for o in refuse)} of {len(refuse)} are."]
    lines += ["", "Information that the file does not contain (right, or reported):", ""]
    for o in found:
        if o.kind == "unknowable":
            result = (
                "right"
                if o.verdict == "right"
                else "refused"
                if o.verdict == "refused"
                else "read with an assumption"
            )
            lines.append(
                f"- {o.case}: {result}, {'with' if o.warned else 'without'} a note on the unknown part"
            )
    return "\n".join(lines)


def main() -> None:
    """Print the table and write it next to this file."""
    only = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        found = outcomes(Path(folder), only)
    if only:
        for o in found:
            print(o)
        return
    about = (
        "Exports in the formats of products, written by an independent generator, compared with their truths."
    )
    publish(__file__, "Exports of other products", "`python -m proofs.dialects.score`", about, table(found))


if __name__ == "__main__":
    main()
