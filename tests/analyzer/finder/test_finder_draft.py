"""`triage loops` writes a draft of loops.csv that the other commands read."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.finder.as_csv import Row, as_csv
from analyzer.finder.draft import type_of, unit_of
from analyzer.loops.spec import LoopSpec, read_loops
from proofs.controllers_plant import controlled
from tests.analyzer.finder.test_finder_pairs import pi_loop, unrelated_tags


def triage(*arguments: object) -> Result:
    """Result of a command."""
    return CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)


@pytest.fixture(scope="module")
def mixed_export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of one loop with named tags, one loop without, and measurements that belong to no loop."""
    named, nameless = pi_loop(2.0, 60.0, 0.5, seed=2), pi_loop(-1.0, 40.0, -0.8, seed=3)
    others = unrelated_tags(6000, 6, 9)
    table = pd.DataFrame({"timestamp": pd.date_range("2026-03-02", periods=6000, freq="s")})
    table[["TIC7.SP", "TIC7.PV", "TIC7.OP"]] = named
    table[["X3", "X1", "X2"]] = nameless + np.array([7.0, 7.0, 0.0])
    table[[f"Y{k}" for k in range(6)]] = others
    path = tmp_path_factory.mktemp("bag") / "export.csv"
    table[table.columns[1:]] = table[table.columns[1:]].round(3)
    table.to_csv(path, index=False)
    return path


def test_the_draft_is_read_as_loops_csv(mixed_export: Path, tmp_path: Path) -> None:
    """The output of the command is a valid loops.csv: the loop by names and the loop by data, with its settings."""
    done = triage("loops", mixed_export, "--out", tmp_path / "loops.csv")
    assert done.exit_code == 0
    assert "2 loops (1 names, 1 data)" in done.output
    named, found = read_loops(tmp_path / "loops.csv")
    assert (named.loop, named.op, named.extra["found_by"]) == ("TIC7", "TIC7.OP", "names")
    assert (found.sp, found.pv, found.op, found.extra["found_by"]) == ("X3", "X1", "X2", "data")
    assert found.kp == pytest.approx(-1.0, rel=0.1)
    assert found.ti == pytest.approx(40.0, rel=0.1)
    assert found.extra["ranges"] == "recorded"


def test_a_draft_states_no_range_of_an_op_in_milliamperes(tmp_path: Path) -> None:
    """If all OPs lie within 4 to 20, as in mA, the draft leaves their range open, and `check` reports that.

    With a range of 0 to 100 it would be percent.
    """
    table = pd.DataFrame({"timestamp": pd.date_range("2026-03-02", periods=6000, freq="s")})
    for name, gain in (("TIC7", 0.5), ("TIC8", 0.4)):
        loop = pi_loop(2.0, 60.0, gain, seed=int(name[-1]))
        loop[:, 2] = 12.0 + 6.0 * (loop[:, 2] - loop[:, 2].mean()) / np.ptp(loop[:, 2])
        table[[f"{name}.SP", f"{name}.PV", f"{name}.OP"]] = loop.round(4)
    table.to_csv(tmp_path / "export.csv", index=False)
    triage("loops", tmp_path / "export.csv", "--out", tmp_path / "loops.csv")
    specs = read_loops(tmp_path / "loops.csv")
    assert [s.stated & {"op_lo", "op_hi"} for s in specs] == [set(), set()]
    assert all("like mA: state op_lo and op_hi" in s.extra["says"] for s in specs)
    output = triage("check", tmp_path / "export.csv", "--loops", tmp_path / "loops.csv").output
    assert "OP of 2 loops lies between 4 and 20, like mA" in output


def test_settings_that_are_not_stated_are_drafted_as_recorded(mixed_export: Path, tmp_path: Path) -> None:
    """A stated loop without kp and ti gets the settings that its data show, and keeps everything that its row
    states.
    """
    (tmp_path / "stated.csv").write_text("loop,description,pv_lo,pv_hi,gap\nTIC7,column's foot,-50,150,0.5\n")
    done = triage("loops", mixed_export, "--loops", tmp_path / "stated.csv", "--out", tmp_path / "loops.csv")
    assert done.exit_code == 0
    spec = next(s for s in read_loops(tmp_path / "loops.csv") if s.loop == "TIC7")
    assert spec.extra["found_by"] == "recorded"
    assert (spec.kp, spec.ti) == pytest.approx((2.0, 60.0), rel=0.1)
    assert (spec.gain_unit, spec.ti_unit) == ("engineering", "s")
    assert (spec.description, spec.pv_lo, spec.pv_hi, spec.gap) == ("column's foot", -50.0, 150.0, 0.5)


def test_stated_loops_are_kept(mixed_export: Path, tmp_path: Path) -> None:
    """A loop of --loops is kept as stated, and its tags are used for no other loop."""
    (tmp_path / "stated.csv").write_text("loop,pv,op,kp,ti\nQ,X1,Y0,3,7\n")
    done = triage("loops", mixed_export, "--loops", tmp_path / "stated.csv")
    rows = {r["loop"]: r for r in csv.DictReader(x for x in done.stdout.splitlines() if x[:1] != "#")}
    assert (rows["Q"]["pv"], rows["Q"]["op"], rows["Q"]["kp"], rows["Q"]["ti"]) == ("X1", "Y0", "3", "7")
    assert rows["Q"]["found_by"] == "stated"
    assert set(rows) == {"Q", "TIC7"}


def test_a_less_sure_loop_is_commented_out(tmp_path: Path) -> None:
    """A row below the required probability is written as a comment and is read by no command."""
    rows = [Row(LoopSpec("A", pv="a"), "data", 89.0, "x, y"), Row(LoopSpec("B", pv="b"), "data", 91.0)]
    (tmp_path / "loops.csv").write_text(as_csv(rows))
    assert "\n# A," in as_csv(rows)
    assert [s.loop for s in read_loops(tmp_path / "loops.csv")] == ["B"]


def test_a_first_night_needs_no_file(mixed_export: Path, tmp_path: Path) -> None:
    """Without loops.csv a run assesses the loops found by names, and with --find-loops also those found by data;
    `check` says why.
    """
    alone = triage("run", mixed_export, "--store", tmp_path / "a")
    assert "1 of 1 loops assessed" in alone.output
    found = triage("run", mixed_export, "--find-loops", "--store", tmp_path / "b")
    assert "2 of 2 loops assessed" in found.output
    output = triage("check", mixed_export, "--find-loops").output
    assert "X1: found by data" in output
    assert "X2 follows X1 by a law (PI, direct acting)" in output


@pytest.mark.parametrize(
    "tag", ["FIC101.PV flow", "LC12 level", "a1/PIC-7.pv pressure", "TT_3 temperature", "T0001 ", "FAN3 "]
)
def test_a_type_is_given_by_isa_letters(tag: str) -> None:
    """The first letter of an ISA instrument name gives the measured quantity; other names give none."""
    name, _, kind = tag.partition(" ")
    assert type_of(name) == kind


@pytest.mark.parametrize(
    ("tag", "unit"),
    [
        ("PV FIC101 (m3/h)", "m3/h"),
        ("TIC7.PV [°C]", "°C"),
        ("FIC101 (PV)", ""),
        ("AI[12]", ""),
        ("FIC101.PV", ""),
    ],
)
def test_the_unit_is_that_in_brackets_of_the_name(tag: str, unit: str) -> None:
    """A unit in brackets at the end of a name is the unit of PV; a role or an index in brackets is no unit."""
    assert unit_of(tag) == unit


def test_a_draft_has_the_derivative_and_the_filter_that_the_data_show(tmp_path: Path) -> None:
    """For independently simulated controllers, a PID is drafted with its derivative time, and a PI with a PV filter
    with that filter.

    A PI without both gets neither; gains and integral times are right within 10 %.
    """
    made = {
        f"TIC{k}": controlled(form, "set point moves", 61, 0.25)
        for k, form in enumerate(("PI", "ideal PID", "PV filter"))
    }
    table = pd.concat([c.trends(tag, 1).set_index("timestamp") for tag, c in made.items()], axis=1)
    table.reset_index().to_parquet(tmp_path / "export.parquet")
    done = triage("loops", tmp_path / "export.parquet", "--out", tmp_path / "loops.csv")
    assert done.exit_code == 0
    plain, pid, filtered = read_loops(tmp_path / "loops.csv")
    assert (plain.td, plain.pv_filter_s, filtered.td) == (None, 0.0, None)
    assert pid.td == pytest.approx(made["TIC1"].ideal[2], rel=0.25)
    assert filtered.pv_filter_s == pytest.approx(float(str(made["TIC2"].extras["pv_filter_s"])), rel=0.25)
    for spec, c in zip((plain, pid, filtered), made.values(), strict=True):
        assert (spec.kp, spec.ti) == pytest.approx(c.ideal[:2], rel=0.1)
