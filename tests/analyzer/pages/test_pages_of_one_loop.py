"""The pages of one named loop in a folder with other pages."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner

from analyzer.cli import main
from analyzer.store.store import Store
from reports.texts import slug
from tests.analyzer.conftest import RunPlant


def test_the_page_of_one_loop_is_that_among_all_pages(run_plant: RunPlant, tmp_path: Path) -> None:
    """--loop writes the page of the loop that is also among all pages, and no page of another loop."""
    store = Store(run_plant.store)
    loop = store.read("nights", store.require(), ["loop"]).column(0).to_pylist()[7]
    made = {}
    for name, more in (("all", ["--top", "30"]), ("one", ["--loop", loop])):
        out = tmp_path / name
        done = CliRunner().invoke(
            main, ["pages", str(store.path), "--out", str(out), *more, "--format", "markdown"]
        )
        assert done.exit_code == 0, done.output
        made[name] = {p.name: p.read_text("utf-8").splitlines() for p in out.glob("*.md")}
    assert f"{slug(loop)}.md" in made["one"]
    for name, lines in made["one"].items():
        kept = [line for line in made["all"][name] if ", made " not in line]
        assert [line for line in lines if ", made " not in line] == kept
    assert len(made["one"]) < 4


def test_a_loop_that_the_night_lacks_is_one_line(run_plant: RunPlant, tmp_path: Path) -> None:
    """--loop with an unknown loop ends with 2 and one line, and writes no page."""
    done = CliRunner().invoke(
        main, ["pages", str(run_plant.store), "--out", str(tmp_path / "p"), "--loop", "NONE1"]
    )
    assert done.exit_code == 2
    assert len(done.output.splitlines()) == 1
    assert not list(tmp_path.glob("p/*.html"))
