"""Twenty natural mistakes of a first hour, each as files and a command, with the expected answer.

The trends are of a level loop that cycles because of its valve: a backlash and a tank of a few lines of code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

HOURS = 3


@dataclass(frozen=True)
class Mistake:
    """A mistake: its files and command, given a folder; the exit status; a part of the message."""

    what: str
    made: Callable[[Path], list[str]]
    status: int
    message: str


@cache
def trends(hours: float = HOURS, seed: int = 0) -> pd.DataFrame:
    """SP, PV and OP of LIC1, one sample a second: a PI loop with a backlash of 4 % before a tank."""
    n = round(3600 * hours)
    noise = 0.05 * np.random.default_rng(seed).normal(size=n)
    pv, op = np.empty(n), np.empty(n)
    y, stem, total, late = 52.0, 50.0, 50.0, np.full(4, 50.0)
    for k in range(n):
        pv[k] = y + noise[k]
        e = 50.0 - pv[k]
        total += 0.5 * e / 20.0
        op[k] = 0.5 * e + total
        stem = min(max(stem, op[k] - 2.0), op[k] + 2.0)
        late[k % 4] = stem
        y += 0.02 * (late[(k + 1) % 4] - 50.0)
    stamp = pd.date_range("2026-03-02", periods=n, freq="s")
    return pd.DataFrame({"timestamp": stamp, "LIC1.SP": 50.0, "LIC1.PV": pv.round(3), "LIC1.OP": op.round(3)})


LOOPS = "loop,pv_lo,pv_hi,kp,ti\nLIC1,0,100,0.5,20\n"


def export(folder: Path, table: pd.DataFrame | None = None, name: str = "export.csv", **how: object) -> str:
    """An export in a folder."""
    (trends() if table is None else table).to_csv(folder / name, index=False, **how)  # type: ignore[call-overload]
    return str(folder / name)


def loops(folder: Path, text: str = LOOPS) -> str:
    """loops.csv in a folder."""
    (folder / "loops.csv").write_text(text, encoding="utf-8")
    return str(folder / "loops.csv")


def run(folder: Path, *arguments: str, stated: str = LOOPS) -> list[str]:
    """The command run with a store in the folder."""
    return ["run", *arguments, "--loops", loops(folder, stated), "--store", str(folder / "store")]


def _wrong_path(d: Path) -> list[str]:
    return run(d, str(d / "exprot.csv"))


def _wrong_columns(d: Path) -> list[str]:
    table = trends().rename(columns=lambda c: {"LIC1.SP": "a", "LIC1.PV": "b", "LIC1.OP": "c"}.get(c, c))
    return ["run", export(d, table), "--store", str(d / "store")]


def _other_tags(d: Path) -> list[str]:
    return run(d, export(d), stated=LOOPS.replace("LIC1", "LIC7"))


def _gain_column(d: Path) -> list[str]:
    return run(d, export(d), stated="loop,gain,reset\nLIC1,0.5,20\n")


def _loop_twice(d: Path) -> list[str]:
    return run(d, export(d), stated=LOOPS + "LIC1,0,100,0.6,20\n")


def _bom(d: Path) -> list[str]:
    return run(d, export(d, encoding="utf-8-sig"))


def _semicolons(d: Path) -> list[str]:
    return run(d, export(d, sep=";", decimal=","))


def _minute(d: Path) -> list[str]:
    return run(d, export(d, trends(24.0).iloc[::240]))


def _one_hour(d: Path) -> list[str]:
    return run(d, export(d, trends(1.0)))


def _few(d: Path) -> list[str]:
    return run(d, export(d, trends().head(100)))


def _without_op(d: Path) -> list[str]:
    return run(d, export(d, trends().drop(columns="LIC1.OP")))


def _old_settings(d: Path) -> list[str]:
    return run(d, export(d), stated=LOOPS.replace("0.5,20", "1.5,60"))


def _no_settings(d: Path) -> list[str]:
    return run(d, export(d), stated="loop,pv_lo,pv_hi\nLIC1,0,100\n")


def _mixed_dates(d: Path) -> list[str]:
    table = trends().copy()
    half = len(table) // 2
    early = table.timestamp[:half].dt.strftime("%Y-%m-%d %H:%M:%S")
    late = table.timestamp[half:].dt.strftime("%d/%m/%Y %H:%M:%S")
    return run(d, export(d, table.assign(timestamp=[*early, *late])))


def _preamble(d: Path) -> list[str]:
    path = Path(export(d))
    path.write_text("Historian,2026-03-02,to,2026-03-03\n" + path.read_text("utf-8"), "utf-8")
    return run(d, str(path))


def _packed(d: Path) -> list[str]:
    path = d / "export.7z"
    path.write_bytes(b"7z\xbc\xaf\x27\x1c" + bytes(2000))
    return run(d, str(path))


def _xlsx(d: Path) -> list[str]:
    (d / "export.xlsx").write_bytes(b"PK\x03\x04" + bytes(2000))
    return run(d, str(d / "export.xlsx"))


def _loops_as_export(d: Path) -> list[str]:
    return ["check", loops(d)]


def _rank_before_run(d: Path) -> list[str]:
    return ["rank", str(d / "store")]


def _wrong_zone(d: Path) -> list[str]:
    return [*run(d, export(d)), "--timezone", "Helsinki"]


def _outside(d: Path) -> list[str]:
    return [*run(d, export(d)), "--since", "2025-01-01", "--until", "2025-02-01"]


MISTAKES = (
    Mistake("the export's path is misspelt", _wrong_path, 2, "no such file or folder"),
    Mistake("the export's columns name no loop", _wrong_columns, 2, "state them with --loops"),
    Mistake("loops.csv is of another area", _other_tags, 2, "no PV tag of any loop is in the export"),
    Mistake("loops.csv calls kp and ti gain and reset", _gain_column, 2, "rename it to 'kp'"),
    Mistake("loops.csv names a loop twice", _loop_twice, 2, "loop LIC1 in rows 2, 3"),
    Mistake("the file begins with a byte order mark", _bom, 0, "1 of 1 loops assessed"),
    Mistake("semicolons and decimal commas", _semicolons, 0, "decimal comma"),
    Mistake(
        "one sample every four minutes of a loop with a cycle of five minutes",
        _minute,
        0,
        "1 of 1 loops assessed",
    ),
    Mistake("one hour", _one_hour, 0, "1 of 1 loops assessed"),
    Mistake("a hundred samples", _few, 2, "needs 200 good PV samples, has 100"),
    Mistake("no OP in the export", _without_op, 0, "1 of 1 loops assessed"),
    Mistake("settings in loops.csv that were changed long ago", _old_settings, 0, "1 of 1 loops assessed"),
    Mistake("no settings in loops.csv", _no_settings, 0, "1 of 1 loops assessed"),
    Mistake("dates written in two ways in one file", _mixed_dates, 0, "night 2026-03-02"),
    Mistake("a line of the historian above the header", _preamble, 0, "1 of 1 loops assessed"),
    Mistake("the export is packed as 7z", _packed, 2, "a 7z archive"),
    Mistake("a workbook that is cut short", _xlsx, 2, "open it and save it again"),
    Mistake("loops.csv given as the export", _loops_as_export, 2, "no time column"),
    Mistake("rank before run", _rank_before_run, 2, "run 'triage run EXPORT --store DIR' first"),
    Mistake("a time zone that does not exist", _wrong_zone, 2, "an IANA name such as Europe/Helsinki"),
    Mistake(
        "a span of time that the export does not hold", _outside, 2, "no samples between --since and --until"
    ),
)
"""The answer is one line, or a night whose list reports what the trends can show."""
LISTED = {
    "one sample every four minutes of a loop with a cycle of five minutes": (
        "needs data",
        "needs a sample every",
    ),
    "one hour": ("needs data", "new settings need 2 good hours"),
    "no OP in the export": ("needs data", "needs OP"),
    "settings in loops.csv that were changed long ago": ("check settings", "are not those of the controller"),
    "no settings in loops.csv": ("retune", "valve backlash"),
}
"""The list for the mistakes that end in a night: the action, and a part of the reason."""
