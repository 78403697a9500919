"""Do all commands give the same answer for a loop? A night of the mill and of two plants through rank, tune, explain
and pages: python -m proofs.walk ../shared/plants/a ../shared/plants/b"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from analyzer.cli import main as triage
from analyzer.explain.text import answer_lines
from analyzer.explain.words import TEXTS, held_out
from analyzer.loop.decisions import Due
from analyzer.pages.night import pages_of_night
from analyzer.store.store import Store
from analyzer.words.reason import in_short
from analyzer.words.units import number
from proofs.common import command, command_line, publish, table
from reports.pages import Page

MILL = (
    *("sample_data/mill.parquet", "--loops", "sample_data/loops.csv"),
    *("--since", "2026-03-03", "--until", "2026-03-04"),
)
CELLS = (
    *("cause", "valve_fault", "backlash_pct", "stickband_pct", "source_loop"),
    *("action", "kp_new", "ti_new", "reason"),
)
"""Cells in which all commands have to agree."""
VALVE_EFFECTS = {"backlash": "backlash", "stiction": "stiction", "positioner": "backlash"}
"""The `valve_fault` that corresponds to an effect of `explain` at the valve."""


def output_of(*words: str) -> str:
    """The stdout of a command, empty where it has too little data; RuntimeError where it fails."""
    result = CliRunner().invoke(triage, words)
    if result.exit_code not in (0, 2):
        raise RuntimeError(f"triage {' '.join(words)}: {result.exit_code}: {result.output[-300:]}")
    return result.stdout


def cells(row: dict[str, Any]) -> dict[str, Any]:
    """The cells in which commands must agree, numbers to six digits."""
    return {k: float(f"{row[k]:.6g}") if isinstance(row[k], float) else row[k] for k in CELLS}


def parted(row: dict[str, Any], other: dict[str, Any], where: str) -> Iterator[str]:
    """Cells that differ from the row of `rank`."""
    ours, theirs = cells(row), cells(other)
    yield from (f"{where}: {k} {theirs[k]}, rank {ours[k]}" for k in CELLS if ours[k] != theirs[k])


def of_tune(export: tuple[str, ...], row: dict[str, Any], store: str) -> Iterator[str]:
    """Contradictions between the row and `tune`, with the night's store and without it."""
    for more in ((), ("--store", store)):
        text = output_of("tune", *export, "--loop", row["loop"], "--format", "json", *more)
        if not text:
            if row["status"] == "ok":
                yield "tune: no answer for a loop that was assessed"
            continue
        found = json.loads(text)
        yield from parted(row, found["decision"], "tune" + (" with the store" if more else ""))
        due = f" at the {Due.SHUTDOWN}" if row["due"] == Due.SHUTDOWN else ""
        if f"action: {row['action']}{due}" not in found["text"]:
            yield f"tune: its text lacks the action {row['action']}"


def of_explain(export: tuple[str, ...], row: dict[str, Any], store: str) -> Iterator[str]:
    """Contradictions between the row and `explain`."""
    text = output_of("explain", *export, "--loop", row["loop"], "--format", "json", "--store", store)
    if not text:
        if row["status"] == "ok":
            yield "explain: no answer for a loop that was assessed"
        return
    found = json.loads(text)
    if "night" in found:
        yield from parted(row, found["night"], "explain")
    named = {VALVE_EFFECTS[e["name"]] for e in found["effects"] if e["name"] in VALVE_EFFECTS}
    stated_so = TEXTS["beside_verdict"]["calm_valve"] in " ".join(answer_lines(found))
    if (
        row["valve_fault"] in ("none", "backlash", "stiction")
        and named - {row["valve_fault"]}
        and not stated_so
    ):
        yield f"explain: {', '.join(sorted(named))} where the night has valve_fault {row['valve_fault']}"
    if found["moved"]:
        baseline, better = held_out(found)
        claimed = "improved model" in "\n".join(answer_lines(found))
        if claimed and better >= baseline:
            yield f"explain: an improved model whose held-out error rises from {baseline:.4g} to {better:.4g}"


def of_page(page: Page, row: dict[str, Any]) -> Iterator[str]:
    """Contradictions between the row and the loop's page."""
    first, *_ = page.sections
    facts = dict(next(s for s in page.sections if s.title == "What and why").blocks[0].items)  # type: ignore[union-attr]
    for name, ours in (("Action", row["action"]), ("Cause", row["cause"] or "not assessed")):
        if facts[name] != ours:
            yield f"page: {name} {facts[name]}, rank {ours}"
    if first.blocks[0].paragraphs[0].lower() != f"{in_short(row['reason'])[0]}.".lower():  # type: ignore[union-attr]
        yield f"page: begins with {first.blocks[0].paragraphs[0]!r}, rank {row['reason']!r}"  # type: ignore[union-attr]
    settings = facts.get("Settings to type in", "")
    retuned = row["action"] == "retune"
    if (number(row["kp_new"]) not in settings) if retuned else bool(settings):
        yield f"page: settings {settings!r}, rank {row['kp_new']}"


def of_row(row: dict[str, Any]) -> Iterator[str]:
    """Contradictions within the row."""
    if row["action"] == "undecided" and row["cause"] not in ("undecided", None):
        yield f"rank: action undecided with the cause {row['cause']}"
    if (row["kp_new"] is not None) != (row["action"] == "retune"):
        yield f"rank: action {row['action']} with new Kp {row['kp_new']}"


def walked(export: tuple[str, ...], jobs: int) -> tuple[int, list[tuple[str, str]]]:
    """Number of loops of a night, and each contradiction with its loop."""
    rows: list[tuple[str, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        store = str(Path(folder) / "store")
        output_of("run", *export, "--store", store, "--jobs", str(jobs))
        ranked = json.loads(output_of("rank", store, "--format", "json"))
        pages = {page.title: page for page in pages_of_night(Store(Path(store)))}
        for row in ranked:
            found = [*of_row(row), *of_page(pages[row["loop"]], row)]
            found += [*of_tune(export, row, store), *of_explain(export, row, store)]
            rows += [(row["loop"], line) for line in found]
            print(f"{row['loop']}: {'; '.join(found) or 'one answer'}", file=sys.stderr, flush=True)
    return len(ranked), rows


def main() -> None:
    """Run all commands on all nights, and write the differences."""
    options = command_line(__doc__, folders="*", jobs=2)
    exports = {"mill": MILL}
    exports |= {
        f"plant {f.name}": (str(f / "export.parquet"), "--loops", str(f / "loops.csv"))
        for f in options.folders
    }
    counts, rows = [], []
    for name, words in exports.items():
        loops, found = walked(words, options.jobs)
        counts.append((name, loops, len({loop for loop, _ in found}), len(found)))
        rows += [(name, *row) for row in found]
    publish(
        __file__,
        "Do all commands give the same answer for a loop?",
        command(__file__, *map(str, options.folders)),
        table("export|loops|with a contradiction|contradictions", counts, numbers=True),
        *([table("export|loop|contradiction", rows)] if rows else []),
    )


if __name__ == "__main__":
    main()
