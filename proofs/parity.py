"""Do two trees print the same? `python -m proofs.parity OUT` in each of them, then `... A B --what compare`.

The first command runs every command on sample_data, and nights of further plants (`--plants FOLDER...`, each with
loops.csv and its exports). It saves every help text, list, page, picture and store table as text. The second command
counts the files that are equal byte for byte and lists the others. Where only numbers differ, it gives the largest
relative change.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd

from proofs.common import command_line, table

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "sample_data"
COMMANDS = (
    "check",
    "run",
    "rank",
    "tune",
    "explain",
    "simulate",
    "report",
    "pages",
    "summary",
    "note",
    "config",
    "store",
)
TUNED = ("LIC2102", "TIC2104", "PIC2112", "FIC2110")
EXPLAINED = ("TIC2106", "FIC2113", "LIC2101", "PIC2116")
LANES = (
    "oscillation",
    "manual",
    "at-limit",
    "lasting-error",
    "frozen",
    "sluggish",
    "valve-travel",
    "wear",
    "windup",
)
OF_THE_HOUR = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d(?=; times|, ordered)|\n?explain: .* s, trying [^\n]*")
"""Time of a run, and how long it took."""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def triage(out: Path, name: str, *words: object) -> None:
    """Save the output of a command under a name, followed by its errors."""
    start = "import sys; from analyzer.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", start, *map(str, words)], capture_output=True, cwd=ROOT, check=False
    )
    printed = (
        done.stdout
        + (b"\n-- stderr\n" + done.stderr if done.stderr else b"")
        + f"\n-- exit {done.returncode}\n".encode()
    )
    (out / name).parent.mkdir(parents=True, exist_ok=True)
    (out / name).write_bytes(printed.replace(str(out).encode(), b"OUT").replace(str(ROOT).encode(), b"ROOT"))


def tables_of(store: Path, out: Path) -> None:
    """Every table of a store as CSV, sorted by loop and time, because workers end in any order."""
    for folder in sorted({p.parent for p in store.rglob("*.parquet")}):
        whole = pd.concat([pd.read_parquet(p) for p in sorted(folder.glob("*.parquet"))])
        whole = whole.drop(columns=[c for c in whole.columns if c in ("version", "written", "took_s")])
        order = [c for c in ("loop", "night", "hour_s", "time_s") if c in whole.columns]
        whole = whole.sort_values(order, kind="stable") if order else whole
        target = out / "tables" / f"{'-'.join(folder.relative_to(store).parts) or 'store'}.csv"
        target.parent.mkdir(parents=True, exist_ok=True)
        whole.to_csv(target, index=False)


def night(out: Path, exports: list[Path], loops: Path, *more: object) -> Path:
    """A night in its own store, with its lists, mails and pages."""
    store = out / "store"
    triage(out, "run.txt", "run", *exports, "--loops", loops, "--store", store, "--jobs", 2, *more)
    for format_ in ("table", "csv", "json", "markdown"):
        triage(out, f"rank.{format_}", "rank", store, "--format", format_)
    triage(out, "wide.txt", "rank", store, "--wide", "--all")
    triage(out, "groups.txt", "rank", store, "--groups")
    for lane in LANES:
        triage(out, f"lane-{lane}.txt", "rank", store, "--lane", lane)
    for format_ in ("text", "html", "markdown"):
        triage(out, f"summary.{format_}", "summary", store, "--format", format_)
    for format_ in ("html", "markdown"):
        triage(
            out,
            f"pages-{format_}.txt",
            "pages",
            store,
            "--format",
            format_,
            "--out",
            out / f"pages-{format_}",
        )
    tables_of(store, out)
    return store


def sample(out: Path) -> None:
    """Every command, run on the sample mill."""
    mill, loops, changes = SAMPLE / "mill.parquet", SAMPLE / "loops.csv", SAMPLE / "changes.csv"
    for name in COMMANDS:
        triage(out, f"help-{name}.txt", name, "--help")
    triage(out, "config.toml", "config")
    triage(out, "check.txt", "check", mill, "--loops", loops, "--until", "2026-03-03")
    triage(out, "check-day.txt", "check", SAMPLE / "mill-day.csv", "--loops", loops)
    store = night(out, [mill], loops, "--changes", changes)
    for format_ in ("html", "markdown"):
        how = ("--changes", changes, "--format", format_, "--out", out / f"report-{format_}")
        triage(out, f"report-{format_}.txt", "report", store, *how)
    triage(out, "found.txt", "report", store, "--find", "--out", out / "found")
    triage(
        out,
        "note.txt",
        "note",
        store,
        "LIC2102",
        "positioner ordered",
        "--owner",
        "Laine",
        "--state",
        "ordered",
    )
    triage(out, "store.txt", "store", "check", store)
    day = (mill, "--loops", loops, "--since", "2026-03-03", "--until", "2026-03-04")
    for loop in TUNED:
        triage(out, f"tune-{loop}.txt", "tune", *day, "--loop", loop, "--out", out / f"tune-{loop}")
    for loop in EXPLAINED:
        explained(out, loop, day)


def explained(out: Path, loop: str, day: tuple[object, ...]) -> None:
    """A loop of a day explained in every format, and its model simulated in open and in closed loop."""
    model = out / f"{loop}.json"
    for format_ in ("text", "json", "html", "markdown"):
        where = ("--out", out / f"explain-{loop}-{format_}") if format_ in ("html", "markdown") else ()
        saved = ("--save-model", model) if format_ == "json" else ()
        how = ("--loop", loop, "--format", format_, *where, *saved)
        triage(out, f"explain-{loop}.{format_}.txt", "explain", *day, *how)
    for closed in ((), ("--closed-loop",)):
        target = out / f"simulated-{loop}{'-closed' * len(closed)}.parquet"
        triage(out, f"{target.stem}.txt", "simulate", model, *day, "--loop", loop, "--out", target, *closed)
        if target.exists():
            pd.read_parquet(target).to_csv(target.with_suffix(".csv"))


def saved_files(out: Path) -> dict[str, bytes]:
    """All saved files by their path; Parquet is saved as CSV."""
    files = (
        p
        for p in sorted(out.rglob("*"))
        if p.is_file() and p.suffix != ".parquet" and "store" not in p.relative_to(out).parts[:-1]
    )
    return {str(p.relative_to(out)): OF_THE_HOUR.sub(b"", p.read_bytes()) for p in files}


def difference(a: bytes, b: bytes) -> str:
    """The difference: words, or numbers only with their largest change."""
    if a == b:
        return ""
    (x, y) = (t.decode("utf-8", "replace") for t in (a, b))
    if NUMBER.sub("#", x) != NUMBER.sub("#", y):
        lines = sum(m != n for m, n in zip(x.splitlines(), y.splitlines(), strict=False))
        return (
            f"words, {lines} lines"
            if len(x.splitlines()) == len(y.splitlines())
            else "words, lines added or gone"
        )
    pairs = ((float(m), float(n)) for m, n in zip(NUMBER.findall(x), NUMBER.findall(y), strict=True))
    return f"numbers, by {max(abs(m - n) / max(abs(m), abs(n), 1e-12) for m, n in pairs):.1g} at most"


def compared(a: Path, b: Path) -> bool:
    """Whether two trees print the same; differences are printed."""
    before, after = saved_files(a), saved_files(b)
    differ = {n: difference(before[n], after[n]) for n in before.keys() & after.keys()}
    rows = [(n, d) for n, d in sorted(differ.items()) if d]
    rows += [(n, "only in the first") for n in sorted(before.keys() - after.keys())]
    rows += [(n, "only in the second") for n in sorted(after.keys() - before.keys())]
    print(f"{sum(not d for d in differ.values())} of {len(before)} the same byte for byte")
    if rows:
        print(table("what | differs in", rows))
    return not rows


def main() -> None:
    """Run all commands, or compare."""
    options = command_line(__doc__, folders="+", what="run", plants=[Path()])
    if options.what == "compare":
        sys.exit(0 if compared(*options.folders) else 1)
    out = options.folders[0].resolve()
    sample(out)
    for plant in options.plants:
        if plant != Path():
            night(
                out / "-".join(plant.resolve().parts[-2:]),
                sorted(plant.resolve().glob("*.parquet")),
                plant.resolve() / "loops.csv",
            )


if __name__ == "__main__":
    main()
