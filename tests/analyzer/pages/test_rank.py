"""The morning list from a large store: in limited time, in order, and in each format."""

from __future__ import annotations

import csv
import io
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.columns import NIGHTS, row_of
from analyzer.pages import rank
from analyzer.pages.rank import as_table
from analyzer.store.store import Store
from analyzer.store.table import rows_table, write_table
from tests.steps import steps

LOOPS = 10_000
NIGHT = "2026-03-08"
STATED = """
loop, type, status, oscillation_significance, oscillating_pct, osc_valve_pct, osc_tuning_pct, osc_load_pct, cause,
valve_fault, source_loop, period_s, pv_amplitude_pct, average_absolute_error_pct, valve_travel_pct_per_h,
variability_pct, gain, time_constant_s, slope_pct_per_s, dead_time_s, backlash_pct, stickband_pct, slip_jump_pct,
kp, ti, kp_new, ti_new, action, reason
"""
CONTRACT = [column.strip() for column in STATED.split(",")]
"""Columns of `triage rank --format csv` according to DESIGN.md."""


def rows(loops: int) -> list[dict[str, object]]:
    """Rows of loops: each tenth was not assessed, and each fifth oscillates."""
    rng = np.random.default_rng(1)
    out = []
    for k in range(loops):
        row: dict[str, object] = {"loop": f"FIC{k:05d}", "type": "flow", "status": "ok", "night": NIGHT}
        if k % 10 == 3:
            out.append({**row, "status": "not assessed", "reason": "needs 200 good PV samples, has 12"})
            continue
        row |= {c.name: float(rng.uniform(0, 50)) for c in NIGHTS if c.is_number}
        cycles = k % 5 == 0
        row |= {
            "cause": "valve" if cycles else "none",
            "valve_fault": "backlash" if cycles else "none",
            "oscillation_significance": float(rng.uniform(0, 20)) if cycles else 0.0,
            "action": "retune" if cycles else "none",
            "loss": None,
            "importance": None,
            "lanes": "oscillation" if cycles else None,
            "reason": "cycles every 38 s: the valve has 2 % play (80 % of OP's range)"
            if cycles
            else "does not oscillate",
            "signs": json.dumps(
                [{"points_to": "valve", "strength": 0.9, "text": "a play explains PV better"}] * 4
            ),
        }
        out.append(row)
    return out


def written(path: Path, loops: int) -> Path:
    """A store of one night of so many loops."""
    write_table(rows_table(rows(loops), NIGHTS), path / "nights" / f"{NIGHT}.parquet")
    return path


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of 10,000 loops."""
    return written(tmp_path_factory.mktemp("large") / "store", LOOPS)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of 20 loops."""
    return written(tmp_path_factory.mktemp("small") / "store", 20)


def run_rank(*arguments: str | Path) -> Result:
    """Result of `triage rank`."""
    return CliRunner().invoke(main, ["rank", *map(str, arguments)])


# Imports and time


def test_ranking_imports_no_large_package(small):
    """Neither help nor ranking imports packages that only the analysis needs."""
    code = (
        "import sys\nfrom analyzer.cli import main\n"
        "for form in ('csv', 'table'):\n"
        f"    main(['rank', {str(small)!r}, '--format', form], standalone_mode=False)\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    imported = set(done.stderr.split())
    assert "analyzer.cli" in imported
    assert not imported & {"numba", "scipy", "matplotlib", "pandas"}


CALLS_A_LOOP = {"table": 600, "csv": 300, "json": 1500, "markdown": 600}
"""Calls that a loop of the complete list may need; the layout by rich needs more than five thousand."""


@pytest.mark.parametrize("form", CALLS_A_LOOP)
def test_the_whole_list_of_a_large_store_is_quick(tmp_path, form):
    """A loop of the complete list needs few calls in each format, and not more in a list twice as long."""
    stores = {loops: written(tmp_path / str(loops), loops) for loops in (1_000, 2_000)}
    for path in stores.values():
        assert run_rank(path, "--format", form).stdout.count("FIC") >= 1_000
    taken = {loops: steps(lambda p=p: run_rank(p, "--format", form)) for loops, p in stores.items()}
    assert taken[1_000] < 1_000 * CALLS_A_LOOP[form]
    assert taken[2_000] < 2.1 * taken[1_000]


# Order


def test_csv_is_the_contract(large):
    """All loops have the columns of the contract in their order, empty if they are not assessed."""
    found = list(csv.reader(io.StringIO(run_rank(large, "--format", "csv").stdout)))
    assert found[0][: len(CONTRACT)] == list(CONTRACT)
    assert {"gain_unit", "ti_unit", "form", "pv_unit"} <= set(found[0])
    assert len(found) == LOOPS + 1
    assert {len(row) for row in found} == {len(found[0])}
    lost = [row for row in found[1:] if row[2] == "not assessed"]
    assert len(lost) == LOOPS // 10
    assert {tuple(row[3:9]) for row in lost} == {("",) * 6}
    assert "nan" not in run_rank(large, "--format", "csv").stdout.lower()


def test_the_worst_come_first_and_the_unknown_last(small):
    """Loops are sorted by significance, those without a figure last by name; --ascending reverses only the known
    figures.
    """
    expected = sorted(
        (r for r in rows(20) if r["status"] == "ok"),
        key=lambda r: (-r["oscillation_significance"], r["loop"]),
    )
    lost = [r["loop"] for r in rows(20) if r["status"] != "ok"]
    found = json.loads(run_rank(small, "--format", "json").stdout)
    assert [r["loop"] for r in found] == [r["loop"] for r in expected] + lost
    turned = json.loads(run_rank(small, "--format", "json", "--ascending").stdout)
    assert [r["loop"] for r in turned][-2:] == lost
    figures = [r["oscillation_significance"] for r in turned[:-2]]
    assert figures == sorted(figures)


@pytest.mark.parametrize("column", CONTRACT)
def test_any_column_sorts(small, column):
    """--by accepts each column of the contract, with texts from A to Z and numbers from the largest."""
    found = [r[column] for r in json.loads(run_rank(small, "--format", "json", "--by", column).stdout)]
    known = [value for value in found if value not in (None, "")]
    assert found[: len(known)] == known
    assert known == sorted(known, reverse=bool(known) and not isinstance(known[0], str))


def test_top_gives_the_first_loops_of_the_complete_list(large):
    """--top 7 gives the first seven loops of the complete list."""
    whole = run_rank(large, "--format", "csv").stdout.splitlines()
    assert run_rank(large, "--format", "csv", "--top", "7").stdout.splitlines() == whole[:8]


# Formats


def test_formats_agree(small):
    """CSV, JSON, Markdown and table list the same loops in the same order."""
    order = [r["loop"] for r in json.loads(run_rank(small, "--format", "json").stdout)]
    table, markdown, values = (
        run_rank(small, "--format", form).stdout.splitlines() for form in ("table", "markdown", "csv")
    )
    assert [line.split(",")[0] for line in values[1:]] == order
    assert [line.split("|")[1].strip() for line in markdown[2:]] == order
    assert [line.split()[0] for line in table if line.lstrip().startswith("FIC")] == order
    assert {line.count("|") for line in markdown} == {markdown[0].count("|")}


def test_json_has_numbers_and_null(small):
    """JSON has the contract's keys, numbers as numbers and null where not assessed."""
    found = json.loads(run_rank(small, "--format", "json").stdout)
    assert list(found[0])[: len(CONTRACT)] == list(CONTRACT)
    assert isinstance(found[0]["period_s"], float)
    assert found[-1]["period_s"] is None


def test_text_of_the_plant_does_not_break_the_markdown(tmp_path):
    """Bars, line ends and tags in the name of a loop stay text in the Markdown table."""
    odd = {**rows(1)[0], "loop": "FIC|1\n<b>", "reason": "a | b"}
    table = rows_table([odd], NIGHTS)
    write_table(table, tmp_path / "nights" / f"{NIGHT}.parquet")
    found = run_rank(tmp_path, "--format", "markdown").stdout.splitlines()
    assert len(found) == 3
    assert "<b>" not in found[2]
    assert found[2].replace("\\|", "").count("|") == found[0].count("|")


@pytest.mark.parametrize("width", [80, 120])
def test_a_narrow_table_keeps_tags_action_and_reason(tmp_path, width):
    """At 80 and 120 columns no line is longer, each tag is complete, and action and reason are shown."""
    tags = [f"{k:02d}-UNIT-FIC{k:05d}.PID" for k in range(5)]
    odd = [{**rows(1)[0], "loop": tag, "kp": 3.0, "kp_new": 2.61, "ti": 1.5, "ti_new": 13.4} for tag in tags]
    text = as_table([row_of(row) for row in odd], NIGHT, width)
    assert max(map(len, text.splitlines())) <= width
    assert all(tag in text for tag in tags)
    assert "Action" in text
    assert "Reason" in text
    assert ("Load %" in text) < ("Load %" in as_table([row_of(row) for row in odd], NIGHT, 240))


def test_a_terminal_has_colours_and_the_same_words(small, monkeypatch):
    """On a terminal a loop has the colour of its cause, the words equal those of a pipe, and NO_COLOR removes
    colours.
    """
    held = [row_of(row) for row in rows(10)]
    plain = as_table(held, NIGHT, 180)
    monkeypatch.setattr(rank, "interactive", lambda: True)
    monkeypatch.delenv("NO_COLOR", raising=False)
    coloured = as_table(held, NIGHT, 180)
    assert "\x1b[31mFIC00000\x1b[0m" in coloured
    assert re.sub(r"\x1b\[\d+m", "", coloured) == plain
    monkeypatch.setenv("NO_COLOR", "1")
    assert as_table(held, NIGHT, 180) == plain


def test_wide_has_every_column(small):
    """--wide shows all columns of the table."""
    head = run_rank(small, "--wide").stdout.splitlines()[2]
    assert all(
        title in head for title in ("Signif.", "Valve %", "Load %", "OP travel %/h", "Kp", "Ti", "Reason")
    )


def test_only_the_loops_of_an_area_are_listed(tmp_path):
    """--area lists only the loops of that area, independently of capitals; an unknown area gives one line with the
    known ones.
    """
    held = [{**row, "area": "Wet End" if k % 3 else "Dry end"} for k, row in enumerate(rows(9))]
    write_table(rows_table(held, NIGHTS), tmp_path / "nights" / f"{NIGHT}.parquet")
    found = json.loads(run_rank(tmp_path, "--area", "wet end", "--format", "json").stdout)
    assert sorted(r["loop"] for r in found) == [f"FIC{k:05d}" for k in range(9) if k % 3]
    refused = run_rank(tmp_path, "--area", "Boiler")
    assert refused.exit_code == 2
    assert "Dry end, Wet End" in refused.stderr


@pytest.mark.parametrize("importance", [None, 2.0])
def test_percent_of_the_recorded_range_is_never_first(tmp_path, importance):
    """A loop without a stated range comes after those with one, for any size of its figures, and without a loss.

    It is marked in table and Markdown with an explanation of the mark; without such a loop there is no mark.
    """
    held = [r for r in rows(20) if r["status"] == "ok" and r["oscillation_significance"]]
    held = [{**r, "importance": importance, "loss": importance and 1.0, "percent_of": "stated"} for r in held]
    own = {"loop": "WIDE", "percent_of": "recorded", "loss": None, "average_absolute_error_pct": 15.0}
    odd = {**held[0], **own, "oscillation_significance": 900.0}
    for name, kept in (("without", held), ("with", [odd, *held])):
        write_table(rows_table(kept, NIGHTS), tmp_path / name / "nights" / f"{NIGHT}.parquet")
    for form in ("table", "markdown"):
        shown = run_rank(tmp_path / "with", "--format", form, "--wide").stdout
        order = re.findall(r"WIDE|FIC\d{5}", shown)
        assert order[-1] == "WIDE"
        assert len(order) == len(held) + 1
        assert re.search(r"WIDE.* 15\\?\*", shown)
        assert "percent of the recorded range" in shown
        assert "recorded range" not in run_rank(tmp_path / "without", "--format", form).stdout
    listed = list(csv.DictReader(io.StringIO(run_rank(tmp_path / "with", "--format", "csv").stdout)))
    assert [r["percent_of"] for r in listed] == ["stated"] * len(held) + ["recorded"]


@pytest.mark.parametrize("lane", ["frozen", "sluggish", "valve-travel"])
@pytest.mark.parametrize("form", ["table", "markdown"])
def test_an_empty_lane_is_a_sentence(small, lane, form):
    """A lane without loops is reported as empty."""
    found = run_rank(small, "--lane", lane, "--format", form)
    assert found.stdout == f"Night {NIGHT}: no loop is in the lane {lane.replace('-', ' ')}\n"


# Errors


@pytest.mark.parametrize(
    ("arguments", "fragments"),
    [
        (["--by", "oscilation"], ["column 'oscilation'", "one such as oscillating_pct", "correct --by"]),
        (["--night", "1999-01-01"], ["night 1999-01-01", NIGHT, "check --night"]),
    ],
)
def test_an_unknown_column_or_night_is_one_line(small, arguments, fragments):
    """An unknown column and an unknown night give one line on stderr, no output on stdout, and exit status 2."""
    result = run_rank(small, *arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert all(fragment in result.stderr for fragment in fragments)


def test_no_store_is_one_line(tmp_path):
    """A path that is no store gives one line with the command to run first, and exit status 2."""
    for path in (tmp_path / "none", tmp_path):
        result = run_rank(path)
        assert result.exit_code == 2
        assert len(result.stderr.splitlines()) == 1
        assert "triage run EXPORT --store DIR" in result.stderr


def test_latest_night_is_the_default(small, tmp_path):
    """Without --night the latest complete night is shown, and with it the named one."""
    for night, loop in (("2026-03-01", "OLD"), ("2026-03-02", "NEW")):
        table = rows_table([{"loop": loop, "status": "ok"}], NIGHTS)
        write_table(table, tmp_path / "nights" / f"{night}.parquet")
    assert Store(tmp_path).nights() == ["2026-03-01", "2026-03-02"]
    assert "NEW" in run_rank(tmp_path).stdout
    assert "OLD" in run_rank(tmp_path, "--night", "2026-03-01").stdout


def test_csv_contains_no_formula(tmp_path):
    """Tags and texts that begin like a formula get an apostrophe in CSV; negative numbers stay numbers."""
    for k, tag in enumerate(("=HYPERLINK(1)", "+FIC1", "-FIC2", "@FIC3")):
        odd = {**rows(1)[0], "loop": tag, "reason": tag, "gain": -4.5}
        store = tmp_path / str(k)
        write_table(rows_table([odd], NIGHTS), store / "nights" / f"{NIGHT}.parquet")
        (row,) = csv.DictReader(io.StringIO(run_rank(store, "--format", "csv").stdout))
        assert (row["loop"], row["reason"], row["gain"]) == (f"'{tag}", f"'{tag}", "-4.5")


def test_markdown_makes_no_link_and_no_picture(tmp_path):
    """Links, pictures, addresses and mentions of people in tags and texts stay text in the Markdown table."""
    text = "![x](http://a.example/b) [y](javascript:z) @all www.a.example"
    odd = {**rows(1)[0], "reason": text}
    write_table(rows_table([odd], NIGHTS), tmp_path / "nights" / f"{NIGHT}.parquet")
    shown = run_rank(tmp_path, "--format", "markdown").stdout.splitlines()[-1]
    assert not any(live in shown for live in ("http:", "@all", "www.a"))
    assert re.search(r"(?<!\\)[!\[\]]", shown) is None


def test_settings_are_shown_with_their_units(tmp_path):
    """Kp and Ti, old and new, have the units of loops.csv in table and Markdown."""
    odd = {
        **rows(1)[0],
        "kp": 125.0,
        "kp_new": 96.2,
        "ti": 0.8,
        "ti_new": 7.67,
        "gain_unit": "band",
        "ti_unit": "min",
    }
    write_table(rows_table([odd], NIGHTS), tmp_path / "nights" / f"{NIGHT}.parquet")
    for form in ("table", "markdown"):
        shown = run_rank(tmp_path, "--format", form).stdout
        assert "% band" in shown
        assert "7.67 min" in shown


def test_new_settings_are_shown_without_present_ones(tmp_path):
    """If loops.csv states no Kp and Ti, the list shows the new ones, with the mark of a recorded range."""
    unstated = {
        "kp": None,
        "ti": None,
        "kp_new": 0.17,
        "ti_new": 24.7,
        "gain_unit": "percent",
        "ti_unit": "s",
    }
    row = {**rows(1)[0], **unstated, "percent_of": "recorded"}
    write_table(rows_table([row], NIGHTS), tmp_path / "nights" / f"{NIGHT}.parquet")
    shown = run_rank(tmp_path, "--wide").stdout
    assert "-> 0.17 %/%*" in shown
    assert "-> 24.7 s" in shown
