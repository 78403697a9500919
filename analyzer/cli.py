"""The command line: parse, call one function, print. Slow packages are imported where they are needed."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands import explain, loops, options, report, run, store, test_plan
from analyzer.commands.options import print_visible
from analyzer.loop.decisions import Lane
from reports.texts import visible

if TYPE_CHECKING:
    from analyzer.night.request import ExportRequest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
"""Loops run in parallel, one per process, on matrices of a few columns: threads of linear algebra only slow them
down. Set before numpy is imported."""


@click.group(
    cls=options.OneLineErrors,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="loop-triage", prog_name="triage")
def main() -> None:
    """Nightly triage of PID loops: which oscillate, why, new settings, and whether they helped.

    \b
    triage run export.parquet --loops loops.csv --store store
    triage rank store
    """


@main.command()
@options.finding
@options.export_options
def check(request: ExportRequest) -> None:
    """Check an export: loops, tags, gaps, quality, and the analyses that the data allow.

    Example: triage check export.csv --loops loops.csv
    """
    from analyzer.night.check import check_lines

    lost = 0
    for line, bad in check_lines(request):
        lost += bad
        click.echo(visible(line))  # one line, also if a tag contains control characters
    sys.exit(options.EXIT_SOME_FAILED if lost else 0)


@main.command()
@options.STORE
@click.option(
    "--by",
    "column",
    help="Column to sort by. Default: loops worth a look first, by loss where loops.csv states importance, else by "
    "oscillation_significance.",
)
@click.option("--top", type=click.IntRange(1), help="Number of loops shown.")
@options.NIGHT
@click.option("--ascending", is_flag=True, help="Smallest first.")
@click.option("--area", help="Only loops of this area.")
@click.option(
    "--lane",
    type=click.Choice([lane.replace(" ", "-") for lane in Lane]),
    callback=lambda _ctx, _param, value: None if value is None else Lane(value.replace("-", " ")),
    help="Only loops of this lane, sorted by its figure.",
)
@click.option("--groups", is_flag=True, help="Loops that share an oscillation, and where each starts.")
@click.option("--all", "everything", is_flag=True, help="Also loops that notes hide from the table.")
@click.option("--wide", is_flag=True, help="All columns of the table, also in a narrow terminal.")
@options.formats("table", "csv", "json", "markdown", text="Output format.")
def rank(
    store: Path, top: int | None, groups: bool, everything: bool, wide: bool, form: str, **by: Any
) -> None:
    """The morning list: the loops of one night, worst first.

    Example: triage rank store --top 20 --format markdown
    """
    from analyzer.pages.rank import hidden_loops, ranked, rendered
    from analyzer.store.store import Store

    if groups:
        from analyzer.pages import groups as shared

        click.echo(shared.rendered_groups(*shared.grouped(Store(store), by["night"], top), form))
        return
    rows, name = ranked(Store(store), **by)
    hidden = () if everything or form in ("csv", "json") else hidden_loops(rows, name)
    shown = [r for r in rows if r["loop"] not in hidden][:top]
    click.echo(rendered(shown, form, name, wide, by["lane"]))
    if hidden:
        print_visible(f"hidden by their notes (--all shows them): {', '.join(hidden)}", err=True)


@main.command()
@options.export_options
@options.of_loop("The loop to tune.")
@options.DECIDED
@options.formats("text", "json")
@click.option("--out", type=options.FOLDER, help="Directory for pictures, and a page to simulate settings.")
def tune(request: ExportRequest, tag: str, store: Path | None, form: str, out: Path | None) -> None:
    """One loop: the night's decision, model, predicted limit cycle, new Kp and Ti, forecast, travel map.

    Example: triage tune export.parquet --loops loops.csv --loop LIC2107 --store store --out pictures
    """
    from analyzer.loop.advice.tune import proposal
    from analyzer.night.opened import guarded
    from reports.plain import json_ready

    one = guarded(request).last_night(tag)
    tuning = proposal(one, options.decision(one, store), out is not None)
    if form == "json":
        click.echo(json.dumps(json_ready(tuning.as_data())))
    else:
        print_visible("\n".join(tuning.lines))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for name, picture in tuning.pictures.items():
            (out / name).write_bytes(picture)
            click.echo(f"written: {out / name}", err=form == "json")


@main.command()
def config() -> None:
    """All limits with their defaults as TOML: meaning, unit, range and source of each.

    Example: triage config > limits.toml; edit it; triage run export.parquet --config limits.toml --store store
    """
    from analyzer.config import Config, limits_document

    click.echo(limits_document(Config()))


for command in (
    *(loops.loops, run.run, report.report, report.pages, store.note, store.summary, store.store),
    *(explain.explain, explain.simulate, test_plan.test_plan),
):
    main.add_command(command)


if __name__ == "__main__":
    main()
