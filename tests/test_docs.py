"""The documents agree with the program."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.loop.decisions import Action, Lane
from analyzer.loops import changes, spec
from analyzer.store.store import Store

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def shell_blocks() -> list[str]:
    """The fenced sh blocks of the README."""
    return re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)


def test_readme_starts_with_two_commands():
    """The README has two sh blocks of one command each: the main job and the tests."""
    blocks = shell_blocks()
    assert len(blocks) == 2
    assert all(block.count("\n") == 1 for block in blocks)
    assert "triage run" in blocks[0]
    assert "pytest" in blocks[1]


def test_the_architecture_page_names_modules_that_exist():
    """Each module and folder that docs/architecture.md names exists."""
    walk = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\b(?:analyzer|identification|tuning|reports)/[\w/]+(?:\.py)?", walk))
    assert len(named) > 25
    assert sorted(path for path in named if not (ROOT / path).exists()) == []


def test_ci_runs_the_readme_tests():
    """.ci/run runs the test command of the README."""
    command = re.search(r"\.venv/bin/python -m pytest.*", shell_blocks()[1])
    assert command is not None
    assert command.group(0) in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_oldest_versions_are_those_of_the_project():
    """.ci/oldest pins each dependency of a user once, at the oldest version that pyproject.toml allows."""
    command = [sys.executable, str(ROOT / ".ci" / "floors.py"), str(ROOT / "pyproject.toml")]
    pins = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert [pin.replace("==", ">=") for pin in pins[: len(project["dependencies"])]] == project[
        "dependencies"
    ]
    assert len({pin.split("==")[0] for pin in pins}) == len(pins)


@pytest.mark.parametrize("name", sorted(main.commands))
def test_each_command_has_help_and_an_example(name):
    """Each command has a help text with an example."""
    result = CliRunner().invoke(main, [name, "--help"])
    assert result.exit_code == 0
    assert "Example" in result.output


@pytest.mark.parametrize(
    "page", ["README.md", *(f"docs/{p.name}" for p in sorted((ROOT / "docs").glob("*.md")))]
)
def test_commands_on_pages_exist_in_the_program(page):
    """Each `triage` command on a page, in a block or in a sentence, exists and has the options that the page
    shows."""
    text = (ROOT / page).read_text(encoding="utf-8")
    shown = re.findall(r"(?:^|`|bin/)triage ([a-z-][^`&;|#\n]*)", text, re.MULTILINE)
    for name, *words in (line.split() for line in shown):
        command = main.commands[name]
        if isinstance(command, click.Group):
            command = command.commands[words[0]]
        known = {option for p in command.params for option in (*p.opts, *p.secondary_opts)}
        assert {word.split("=")[0] for word in words if word.startswith("--")} <= known, (name, words)


def headings(text: str) -> list[str]:
    """The headings of the list in a text."""
    line = next(x for x in text.splitlines() if x.startswith(" Loop "))
    return re.split(r"\s{2,}", line.strip())


@pytest.mark.skipif(os.environ.get("TRIAGE_WALK") != "all", reason="takes minutes: TRIAGE_WALK=all runs it")
def test_the_list_in_the_readme_is_what_the_command_prints(tmp_path):
    """The list in the README is identical to the first lines that the `rank` command prints."""
    triage, sample = [sys.executable, "-m", "analyzer.cli"], ROOT / "sample_data"
    run = [*triage, "run", str(sample / "mill.parquet"), "--loops", str(sample / "loops.csv")]
    more = ["--store", str(tmp_path), "--until", "2026-03-09", "--jobs", "2"]
    subprocess.run([*run, *more], capture_output=True, text=True, check=True)
    printed = subprocess.run([*triage, "rank", str(tmp_path)], capture_output=True, text=True, check=True)
    shown = re.search(r"```\n(Night .*?)```", README, flags=re.DOTALL)[1].splitlines()
    assert shown == [line.rstrip() for line in printed.stdout.splitlines()[: len(shown)]]


def test_main_job_of_the_readme_on_one_day(tmp_path):
    """The README's main job, on one day of the sample mill, ranks the loops with a simulated fault first. It
    reports the sticking valve of a cascade at the slave loop. It does not report the phases of a batch as an
    oscillation."""
    triage = [sys.executable, "-m", "analyzer.cli"]
    sample = ROOT / "sample_data"
    run = [*triage, "run", str(sample / "mill.parquet"), "--loops", str(sample / "loops.csv")]
    days = ["--store", str(tmp_path), "--since", "2026-03-04", "--until", "2026-03-05"]
    ran = subprocess.run([*run, *days], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "FIC2120: needs PV samples" in ran.stderr
    ranked = subprocess.run(
        [*triage, "rank", str(tmp_path)], capture_output=True, text=True, check=True
    ).stdout
    loops = re.findall(r"^ ([A-Z]{3}\d{4})", ranked, flags=re.MULTILINE)
    wide = subprocess.run(
        [*triage, "rank", str(tmp_path), "--wide"], capture_output=True, text=True, check=True
    ).stdout
    printed, shown = headings(wide), headings(README)
    assert [name for name in printed if name in shown] == shown
    assert set(loops[:12]) >= {"LIC2102", "LIC2105", "LIC2107", "TIC2104", "TIC2106", "FIC2110", "FIC2122"}
    held = Store(tmp_path)
    columns = ["loop", "cause", "source_loop", "master", "ratio_of", "oscillating_pct"]
    found = {r["loop"]: r for r in held.rows("nights", held.require(), columns)}
    assert (found["FIC2122"]["cause"], found["FIC2122"]["master"]) == ("valve", "TIC2121")
    assert found["TIC2121"]["source_loop"] == "FIC2122"
    assert found["FIC2123"]["ratio_of"] == "FIC2113"
    assert found["TIC2124"]["oscillating_pct"] == 0.0


def cells(path: str) -> list[list[str]]:
    """Rows of all tables of a page. The cells have no back quotes."""
    lines = (ROOT / path).read_text("utf-8").splitlines()
    rows = [
        [c.strip().strip("`") for c in line.strip("|").split("|")] for line in lines if line.startswith("|")
    ]
    return [row for row in rows if set(row[0]) - set("-")]


def test_loops_csv_is_documented_column_by_column() -> None:
    """docs/loops-csv.md lists every column that the readers of loops.csv and changes.csv know, and no other
    column."""
    named = [row[0] for row in cells("docs/loops-csv.md") if len(row) in (2, 3) and row[0] != "column"]
    assert sorted(named) == sorted([*spec.COLUMNS, *changes.COLUMNS[1:], "loop"])


def test_ten_systems_are_stated_in_values_that_loops_csv_allows() -> None:
    """Each of the ten systems has a gain unit, a time unit and a form that loops.csv allows."""
    rows = [row for row in cells("docs/loops-csv.md") if len(row) == 7][1:]
    assert len(rows) == 10
    for row in rows:
        for column, cell in zip(("gain_unit", "ti_unit", "form"), row[4:], strict=True):
            assert cell in [str(choice) for choice in spec.CHOICES[column]], row


def test_pages_are_documented_with_the_words_they_use() -> None:
    """docs/reading-a-page.md lists every action and every lane by its name."""
    text = (ROOT / "docs" / "reading-a-page.md").read_text("utf-8")
    actions = [row[0] for row in cells("docs/reading-a-page.md") if len(row) == 2]
    assert set(Action) <= set(actions)
    plain = text.lower().replace("in manual", "manual").replace("op at a limit", "at limit")
    assert all(lane in plain for lane in Lane)


def test_the_table_of_faults_names_tests_that_exist():
    """Each file, command and test that a line of RELIABILITY.md names exists."""
    page = (ROOT / "docs" / "RELIABILITY.md").read_text(encoding="utf-8")
    code = "\n".join(p.read_text(encoding="utf-8") for p in (ROOT / "tests").rglob("test_*.py"))
    for name in re.findall(r"\btest_[a-z0-9_]+\b(?!\.py)", page):
        assert f"def {name}" in code, name
    for path in re.findall(r"\b(?:tests|analyzer)/[\w/]+\.(?:py|md)\b", page):
        assert (ROOT / path).exists(), path
    for module in re.findall(r"python -m (tests\.[\w.]+)", page):
        assert (ROOT / (module.replace(".", "/") + ".py")).exists(), module


def test_the_commands_of_the_first_evening_work_unchanged(tmp_path, monkeypatch):
    """The five commands of docs/first-evening.md produce a list and pages from an export without loops.csv."""
    page = (ROOT / "docs" / "first-evening.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```sh\n(.*?)```", page, flags=re.DOTALL)
    commands = [line.split()[1:] for line in block.splitlines()]
    assert [command[0] for command in commands] == ["loops", "check", "run", "rank", "pages"]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    done = [CliRunner().invoke(main, command, catch_exceptions=False) for command in commands]
    assert [d.exit_code for d in done] == [
        0,
        1,
        0,
        0,
        0,
    ]  # one loop has no recorded data, and check reports it
    assert "21 of 22 loops assessed" in done[2].output
    assert "FIC2110" in done[3].output
    assert (tmp_path / "evening" / "pages" / "index.html").exists()
