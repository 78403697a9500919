"""A recording in which settings changed is explained in parts, each with constant settings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analyzer.config import Config
from analyzer.explain.case import latest_night, requested_cases, stretch_of_night
from analyzer.explain.parts import PART_SAMPLES, parts, parts_note
from analyzer.history.series import Series
from analyzer.loop.record.quality import prepare
from analyzer.loops.changes import TuningChange
from analyzer.loops.spec import LoopSpec
from analyzer.night.nights import ALWAYS
from analyzer.night.opened import guarded
from analyzer.night.request import ExportRequest
from identification.estimation.problem import in_blocks
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from tests.analyzer.explain.test_explain import run_command

SPEC = LoopSpec("A", pv="A.PV", op="A.OP", kp=2.0, ti=50.0)
N = 5000


def trends(n: int = N) -> dict[str, Series]:
    """PV and OP, a sample a second from time 0."""
    stamp = np.arange(n, dtype=np.float64)
    return {tag: Series(stamp, np.sin(stamp), np.zeros(n, dtype=bool)) for tag in ("A.PV", "A.OP")}


def changed(at_s: float, kp_old: float, kp_new: float, loop: str = "A") -> TuningChange:
    """A change of one controller's gain."""
    return TuningChange(loop, at_s, kp_old=kp_old, kp_new=kp_new)


def test_each_part_has_the_settings_of_its_time() -> None:
    """Two changes give three parts, the longest first, each with the gain in force; no two parts share a sample."""
    found = parts(SPEC, trends(), (changed(3000, 1.0, 1.5), changed(4000, 1.5, 2.0)), "UTC")
    assert [(p.samples, p.spec.kp) for p in found] == [(3000, 1.0), (1000, 1.5), (1000, 2.0)]
    stamps = np.concatenate([p.series["A.OP"].stamp_s for p in found])
    np.testing.assert_array_equal(np.sort(stamps), np.arange(N))
    assert "1970-01-01 00:00 to 1970-01-01 00:49" in parts_note(found)


def test_changes_elsewhere_leave_one_part() -> None:
    """Changes of other loops, and changes before or after the recording, divide nothing, and no note is written."""
    outside = (changed(2000, 1.0, 1.5, "B"), changed(-5.0, 1.0, 2.0), changed(N + 10, 2.0, 3.0))
    found = parts(SPEC, trends(), outside, "UTC")
    assert [(p.samples, p.spec.kp) for p in found] == [(N, 2.0)]
    assert parts_note(found) == ""


def test_a_part_that_is_too_short_is_left_out() -> None:
    """A part that is too short is left out, and the rest keeps its own settings."""
    found = parts(SPEC, trends(), (changed(N - PART_SAMPLES + 1, 1.0, 2.0),), "UTC")
    assert [(p.samples, p.spec.kp) for p in found] == [(N - PART_SAMPLES + 1, 1.0)]


def test_dated_rows_of_loops_csv_divide_the_recording() -> None:
    """A row of loops.csv with a start date within the recording divides it in the same way as a change."""
    spec = replace(SPEC, valid_from_s=2000.0, earlier=(replace(SPEC, kp=0.7),))
    found = parts(spec, trends(), (), "UTC")
    assert [(p.samples, p.spec.kp) for p in found] == [(3000, 2.0), (2000, 0.7)]


@pytest.mark.parametrize("still", [0, 1, 2])
def test_part_with_constant_op_is_left_out(tmp_path: Path, still: int) -> None:
    """Of three parts the one with a constant OP is neither explained nor held out, even if it is the longest; the
    others are used.
    """
    lengths, rng = (2500, 1500, 1000), np.random.default_rng(1)
    op = np.concatenate([np.cumsum(rng.normal(0, 0.1, n)) * (i != still) + 50 for i, n in enumerate(lengths)])
    stamp = pd.Timestamp("2026-03-02", tz="UTC") + pd.to_timedelta(np.arange(op.size), unit="s")
    frame = pd.DataFrame({"timestamp": stamp, "A.PV": 50 + rng.normal(0, 0.1, op.size), "A.OP": op})
    frame.to_parquet(tmp_path / "x.parquet", index=False)
    start = stamp[0].timestamp()
    changes = (changed(start + 2500, 1.0, 1.5), changed(start + 4000, 1.5, 2.0))
    request = ExportRequest((tmp_path / "x.parquet",), None, changes, ALWAYS, Config(), "UTC", {})
    explained, others = requested_cases(request, guarded(request), "A", ())
    moving = [n for i, n in enumerate(lengths) if i != still]
    assert [len(c.prepared.record) for c in (explained, *others.values())] == moving


@pytest.mark.slow
def test_backlash_is_tested_under_the_other_settings(tmp_path: Path) -> None:
    """A backlash found under the old settings is tested on the week with the new ones, and the answer mentions the
    change.
    """
    rng = np.random.default_rng(4)
    frames, at = [], pd.Timestamp("2026-03-02")
    for kp, ti in ((1.8, 20.0), (0.9, 40.0)):
        sp = 50 + np.repeat(rng.uniform(-7, 7, 4000 // 150 + 1), 150)[:4000]
        r = closed_loop(
            Loop(Fopdt(1.2, 20.0, 3.4), Pid(kp, ti), Backlash(2.0)), sp, rng.normal(0, 0.08, 4000)
        )
        stamp = at + pd.to_timedelta(np.arange(4000), unit="s")
        frames.append(
            pd.DataFrame({"timestamp": stamp, "A.SP": sp, "A.PV": r.pv.round(2), "A.OP": r.op.round(2)})
        )
        at = stamp[-1] + pd.Timedelta(seconds=1)
    pd.concat(frames).to_parquet(tmp_path / "x.parquet", index=False)
    (tmp_path / "loops.csv").write_text("loop,kp,ti,scan_s,pv_lo,pv_hi\nA,0.9,40,1,0,100\n")
    (tmp_path / "changes.csv").write_text(
        "loop,time,kp_old,ti_old,kp_new,ti_new\nA,2026-03-02T01:06:40Z,1.8,20,0.9,40\n"
    )
    status, text = run_command(
        "explain", tmp_path / "x.parquet", "--loops", tmp_path / "loops.csv", "--changes", tmp_path / "changes.csv",
        "--loop", "A", "--format", "json",
    )  # fmt: skip
    answer = json.loads(text.splitlines()[-1])
    assert (status, answer["verdict"]) == (0, "backlash")
    assert answer["effects"][0]["parameters"]["backlash_pct"]["value"] == pytest.approx(2.0, rel=0.05)
    assert answer["held_out_on"][0]["share"] > 0.3
    assert "Settings changed" in answer["reason"]


@pytest.mark.parametrize(("most", "first", "count"), [(100_000, 100_000, 86_400), (40_000, 125_000, 15_000)])
def test_a_long_recording_is_explained_on_the_stretch_that_its_night_fitted(
    most: int, first: int, count: int
) -> None:
    """Of 186,400 s, the last night is explained, or its 15,000 s up to the end of the stretch that the night
    fitted.
    """
    n = 186_400
    whole = prepare(SPEC, trends(n), Config().quality)
    problem = in_blocks(np.zeros(3000), np.zeros(30_000), np.ones(3000, dtype=bool), 10.0, 10, first=10_000)
    verdict = SimpleNamespace(require_measured=SimpleNamespace(problem=problem))
    part, text = stretch_of_night(whole, verdict, most)  # type: ignore[arg-type]
    assert (len(latest_night(whole).record), len(part.record)) == (86_400, count)
    assert part.record.start_s == whole.record.start_s + first
    assert f"{count} of {n} samples" in text
